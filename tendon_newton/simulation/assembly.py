"""Kernels made to measure: one set per structure of mechanism, actuator, list of effects and precision."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import warp as wp

from tendon_newton.actuators import find_actuator
from tendon_newton.device_code.placeholders import bindings, struct_type
from tendon_newton.device_code.templates import Specialiser
from tendon_newton.effects import EFFECTS, Stage, find_effect
from tendon_newton.simulation import (
    pipeline,
    planar_chain,
    rollout_kernels,
    spatial_chain,
)

Precision = Literal["float32", "float64"]


@dataclass(frozen=True, kw_only=True)
class Structure:
    """All that decides a kernel's code; numbers that only decide results are not in it."""

    parents: tuple[int, ...]
    """Index of each joint's parent joint, -1 for the base, shape (J,)."""
    revolute: tuple[bool, ...]
    """Whether each joint turns (or else slides), shape (J,)."""
    tendon_count: int
    actuator: str
    effects: tuple[str, ...]
    """Names in the order of the catalogue."""
    planar: bool = True
    """Whether the chain moves in one plane, which costs a third of the general equations."""
    precision: Precision = "float64"

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.parents)

    @property
    def offsets(self) -> dict[str, int]:
        """Where each effect's first parameter stands in a world's parameter vector."""
        at = len(find_actuator(self.actuator).parameters)
        table = {}
        for name in self.effects:
            table[name] = at
            at += len(find_effect(name).parameters)
        return table

    @property
    def parameter_count(self) -> int:
        """Length P of a world's parameter vector, two zeros of padding included."""
        effects = sum(len(find_effect(name).parameters) for name in self.effects)
        return len(find_actuator(self.actuator).parameters) + effects + 2

    def moves(self) -> tuple[tuple[bool, ...], ...]:
        """Return whether joint j carries link k, shape (J, J)."""
        table = [[False] * self.joint_count for _ in self.parents]
        for link in range(self.joint_count):
            joint = link
            while joint >= 0:
                table[joint][link] = True
                joint = self.parents[joint]
        return tuple(map(tuple, table))


@dataclass(frozen=True, kw_only=True)
class KernelSet:
    """The compiled kernels of one structure, with the Warp types of their arguments."""

    structure: Structure
    types: dict[str, Any]
    settle: wp.Kernel
    rollout: wp.Kernel


def in_catalogue_order(effects: tuple[str, ...]) -> tuple[str, ...]:
    """Sort effects by the catalogue, which is the order in which they act within a stage."""
    for name in effects:
        find_effect(name)
    return tuple(name for name in EFFECTS if name in effects)


@lru_cache(maxsize=None)
def kernel_set(structure: Structure) -> KernelSet:
    """Assemble the kernels of a structure; Warp compiles them at first launch and caches them on disk."""
    types = argument_types(structure)
    specialiser = Specialiser(types)
    for slot, function in stage_functions(structure, types).items():
        specialiser.bind(slot, function)
    actuator = find_actuator(structure.actuator)
    specialiser.bind("actuator_force", specialiser.function(actuator.force))
    specialiser.bind("armature", specialiser.function(actuator.armature))
    effects = [inspect.getsource(find_effect(name)) for name in structure.effects]
    identity = "\n".join([repr(structure), inspect.getsource(pipeline), *effects])
    chain = planar_chain if structure.planar else spatial_chain
    specialiser.bind("chain_terms", specialiser.function(chain.chain_terms))
    return KernelSet(
        structure=structure,
        types=types,
        settle=specialiser.kernel(rollout_kernels.settle_kernel, identity, enable_backward=False),
        rollout=specialiser.kernel(rollout_kernels.rollout_kernel, identity, enable_backward=False),
    )


def stage_functions(structure: Structure, types: dict[str, Any]) -> dict[str, Any]:
    """Return the device function of each stage, made of the structure's effects."""
    templates = {
        Stage.CLOCK: pipeline.clock_stage,
        Stage.SPRING: pipeline.joint_stage,
        Stage.DAMPING: pipeline.joint_stage,
    }
    functions = {}
    for stage in Stage:
        names = [name for name in structure.effects if find_effect(name).stage is stage]
        specialiser = Specialiser(types)
        applied = tuple(specialiser.function(find_effect(name).apply) for name in names)
        specialiser.bind("FUNCTIONS", applied)
        specialiser.bind("OFFSETS", tuple(structure.offsets[name] for name in names))
        template = templates.get(stage, pipeline.tendon_stage)
        functions[f"{stage.value}_effects"] = specialiser.function(template)
    return functions


def argument_types(structure: Structure) -> dict[str, Any]:
    """Return what each placeholder stands for, the structs included."""
    precision = getattr(wp, structure.precision)
    t = bindings(
        structure.joint_count, structure.tendon_count, structure.parameter_count, precision
    )
    real, joints, tendons, jet = t["real"], t["JointVector"], t["TendonVector"], t["Jet"]
    square = t["JointMatrix"]

    def array(dtype: Any, ndim: int = 1) -> Any:
        return wp.array(dtype=dtype, ndim=ndim)

    place, inertia = (t["Vec2"], real) if structure.planar else (t["Vec3"], t["Mat33"])
    per_joint = ("stiffness", "rest", "damping", "friction", "armature", "lower", "upper",
                 "limit_stiffness", "limit_damping")  # fmt: skip
    per_tendon = ("excursion_offset", "spool_radius", "force_limit", "least_tension")
    t["Mechanism"] = struct_type("Mechanism", {
        **{name: array(joints) for name in per_joint},
        **{name: array(tendons) for name in per_tendon},
        "arms": array(t["ArmMatrix"]),
        "offset": array(place, 2), "centre": array(place, 2), "axis": array(place, 2),
        "gravity": array(place), "mass": array(real, 2), "inertia": array(inertia, 2),
    })  # fmt: skip
    t["Commands"] = struct_type("Commands", {
        "first": array(wp.int32), "count": array(wp.int32),
        "time": array(real), "angle": array(tendons), "voltage": array(real), "enabled": array(real),
        "starts_measured": array(wp.int32), "start_angle": array(tendons), "start_rate": array(tendons),
    })  # fmt: skip
    t["ChainTerms"] = struct_type("ChainTerms", {"mass_matrix": square, "torque": joints})
    t["Forces"] = struct_type("Forces", {
        "mass_matrix": square, "torque": joints, "stiffness": square, "damping": square,
    })  # fmt: skip
    t["Motion"] = struct_type("Motion", {"q": joints, "v": joints, "mass_matrix": square})
    t["Modes"] = struct_type("Modes", {
        "joint": joints, "joint_sticks": joints, "touch": joints,
        "tendon": tendons, "tendon_sticks": tendons, "hold": tendons,
    })  # fmt: skip
    t["Event"] = struct_type("Event", {
        "fraction": real, "row": wp.int32, "stop": wp.int32, "joint": wp.int32, "touch": real,
    })  # fmt: skip
    t["Drive"] = struct_type("Drive", {
        "time": real, "command": tendons, "voltage": real, "enabled": real,
    })  # fmt: skip
    t["Reading"] = struct_type("Reading", {"angle": tendons, "angle_rate": tendons, "force": tendons})
    t["Joint"] = struct_type("Joint", {name: real for name in (
        "position", "velocity", "stiffness", "rest", "damping", "lower", "upper")})  # fmt: skip
    t["Tendon"] = struct_type("Tendon", {
        "time": real, "voltage": real, "enabled": real, "spool_radius": real, "velocity": real,
        "direction": real, "angle": jet, "angle_rate": jet,
    })  # fmt: skip
    t["PARENT"] = structure.parents
    t["REVOLUTE"] = structure.revolute
    t["MOVES"] = structure.moves()
    offsets = structure.offsets
    t["DRY_OFFSETS"] = tuple(offsets[name] for name in structure.effects if find_effect(name).dry)
    return t
