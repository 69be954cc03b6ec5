"""What each placeholder of the device code stands for in the kernels of one structure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import bindings, struct_type
from tendon_newton.effects import Stage
from tendon_newton.simulation.model.structure import Structure

REST = {"float64": 1.0e-9, "float32": 1.0e-6}
"""Speed below which a dry friction may stick [m/s, rad/s]: some roundings of a finger's speed."""

TOUCHING_STRIDE = 0.02
"""Longest step towards equilibrium past obstacles [rad, m]: a link must not leap over one."""


def kernel_types(structure: Structure) -> dict[str, Any]:
    """Return types and constants, the structs included."""
    t = bindings(
        structure.coordinate_count,
        structure.tendon_count,
        structure.parameter_count,
        structure.memory_count,
        getattr(wp, structure.precision),
    )
    rows = structure.tendon_count + structure.spool_count
    t["ROWS"], t["LINKS"] = rows, structure.joint_count
    t["RowVector"], t["RowMatrix"] = t["TendonVector"], t["ArmMatrix"]
    if structure.free_spool:
        t["RowVector"] = wp.types.vector(length=rows, dtype=t["real"])
        t["RowMatrix"] = wp.types.matrix(shape=(rows, t["JOINTS"]), dtype=t["real"])
    t["FREE_SPOOL"], t["HAS_ROTOR"] = structure.free_spool, structure.has_rotor
    t |= structure.routes.bindings(structure.coordinate_parents, structure.tendon_count)
    t |= structure.touch.bindings()
    t |= argument_structs(t, structure.planar)
    t |= inner_structs(t, structure.planar)
    slow_cell = structure.uses(Stage.CELL_LAG) or structure.uses(Stage.CELL_CLOCK)
    slow_cell = slow_cell and structure.driven_by == "command"
    with_memory = [effect for effect in structure.declarations if structure.remembers(effect)]
    t["PARENT"] = structure.coordinate_parents
    t["REVOLUTE"] = (*structure.revolute, *[False] * structure.spool_count)
    t["MOVES"] = structure.moves()
    t["DRY_OFFSETS"] = structure.dry_offsets
    t["MAY_HOLD"] = bool(structure.dry_offsets) or structure.uses(Stage.SPEED)
    t["HAS_DUTY"] = structure.uses(Stage.DUTY)
    t["HAS_MEMORY"] = bool(with_memory) or t["TOUCHES"]
    t["MEMORY_OFFSETS"] = tuple(structure.offsets[effect.name] for effect in with_memory)
    t["MEMORY_NULLS"] = tuple(effect.parameters[0].null for effect in with_memory)
    t["HOLDS_ROUTED"] = t["ROUTED"] and t["MAY_HOLD"]
    t["REMEMBERS_ROUTED"] = t["ROUTED"] and t["HAS_MEMORY"]
    t["REST"] = REST[structure.precision]
    t["HAS_SLOW_CELL"] = slow_cell
    t["CELL_MEMORY"] = structure.cell_memory
    t["MEMORY_SIZE"] = structure.memory_count
    t["HOLDS_FORCE"] = structure.holds_force
    t["HELD_MEMORY"] = structure.held_memory
    if t["TOUCHES"]:
        t["CONTACT_MEMORY"] = structure.contact_memory
        t["CONTACT_TABLE"] = whole_table(structure.touch.contacts)
        t["CARRIES"] = t["JointMatrix"](*map(float, chain.from_iterable(structure.moves())))
        t["STRIDE"] = TOUCHING_STRIDE
    return t


def argument_structs(t: dict[str, Any], planar: bool) -> dict[str, Any]:
    """Return the structs that kernels take as arguments: what is constant, and what is recorded."""
    real, joints, tendons = t["real"], t["JointVector"], t["TendonVector"]
    place, inertia = (t["Vec2"], real) if planar else (t["Vec3"], t["Mat33"])

    def array(dtype: Any, ndim: int = 1) -> Any:
        return wp.array(dtype=dtype, ndim=ndim)

    per_joint = (
        "stiffness",
        "rest",
        "damping",
        "friction",
        "armature",
        "lower",
        "upper",
        "limit_stiffness",
        "limit_damping",
    )
    per_tendon = ("excursion_offset", "spool_radius", "force_limit", "least_tension")
    mechanism = {
        **{name: array(joints) for name in per_joint},
        **{name: array(tendons) for name in per_tendon},
        **{name: array(place, 2) for name in ("offset", "centre", "axis")},
        **{name: array(place) for name in ("gravity", "gravity_across", "gravity_along")},
        "arms": array(t["ArmMatrix"]),
        "mass": array(real, 2),
        "inertia": array(inertia, 2),
    }
    if t["ROUTED"]:
        mechanism |= {
            "path_point": array(t["Vec3"], 2),
            "path_frame": array(t["Mat33"], 2),
            "path_radius": array(real, 2),
            "path_turn": array(real, 2),
        }
    if t["TOUCHES"]:
        mechanism |= contact_arrays(t, planar)
    commands = {
        "first": array(wp.int32),
        "count": array(wp.int32),
        "time": array(real),
        "angle": array(tendons),
        "voltage": array(real),
        "enabled": array(real),
        "starts_measured": array(wp.int32),
        "start_angle": array(tendons),
        "start_rate": array(tendons),
    }
    return {
        "Mechanism": struct_type("Mechanism", mechanism),
        "Commands": struct_type("Commands", commands),
    }


def contact_arrays(t: dict[str, Any], planar: bool) -> dict[str, Any]:
    """Return what a mechanism has more where links may meet obstacles; see `contacts`."""
    vector, square, real = t["Vec3"], t["Mat33"], t["real"]
    kinds = {
        "obstacle_position": vector,
        "obstacle_rotation": square,
        "obstacle_size": vector,
        "obstacle_stiffness": real,
        "obstacle_dissipation": real,
        "obstacle_friction": real,
        "capsule_start": vector,
        "capsule_end": vector,
        "capsule_radius": real,
    }
    arrays = {name: wp.array(dtype=kind, ndim=2) for name, kind in kinds.items()}
    return arrays | ({"contact_plane": wp.array(dtype=square)} if planar else {})


def inner_structs(t: dict[str, Any], planar: bool) -> dict[str, Any]:
    """Return the structs that live inside kernels."""
    real, jet, memory = t["real"], t["Jet"], t["MemoryVector"]
    joints, tendons, square = t["JointVector"], t["TendonVector"], t["JointMatrix"]
    rows = t["RowVector"]
    place = t["Vec2"] if planar else t["Vec3"]
    fields = {
        "ChainTerms": {"mass_matrix": square, "torque": joints},
        "Forces": {
            "mass_matrix": square,
            "torque": joints,
            "stiffness": square,
            "damping": square,
            "slack": tendons,
            "line": tendons,
        },
        "Motion": {
            "q": joints,
            "v": joints,
            "mass_matrix": square,
            "memory": memory,
            "divided": real,
            "line": tendons,
        },
        "Modes": {
            "joint": joints,
            "joint_sticks": joints,
            "touch": joints,
            "tendon": rows,
            "tendon_sticks": rows,
            "least_side": rows,
            "most_side": rows,
            "hold": rows,
        },
        "Event": {
            "fraction": real,
            "row": wp.int32,
            "speed": real,
            "joint": wp.int32,
            "touch": real,
            "tendon": wp.int32,
            "slack": real,
        },
        "Drive": {
            "time": real,
            "command": tendons,
            "voltage": real,
            "enabled": real,
            "elapsed": real,
            "acceleration": joints,
            "memory": memory,
            "remembers": real,
            "inertia": real,
            "gravity": place,
            "friction": joints,
            "dry": real,
            "greatest_speed": tendons,
            "slack": tendons,
            "string": real,
            "carried": tendons,
        },
        "Reading": {"angle": tendons, "angle_rate": tendons, "force": tendons},
        "Cell": {"force": tendons, "due": wp.int32},
        "Joint": {
            "index": wp.int32,
            "elapsed": real,
            "memory": memory,
            "position": real,
            "velocity": real,
            "stiffness": real,
            "rest": real,
            "damping": real,
            "lower": real,
            "upper": real,
        },
        "Tendon": {
            "index": wp.int32,
            "time": real,
            "elapsed": real,
            "memory": memory,
            "voltage": real,
            "enabled": real,
            "slack": real,
            "command": real,
            "error": real,
            "tension": real,
            "force_limit": real,
            "carried": real,
            "nominal_radius": real,
            "spool_radius": real,
            "inverse_radius": real,
            "length": real,
            "wound": real,
            "velocity": real,
            "acceleration": real,
            "side": real,
            "direction": real,
            "angle_rate": jet,
        },
        "Flow": {
            "angle": jet,
            "error": jet,
            "duty": jet,
            "motor_force": jet,
            "tension": jet,
            "pull": jet,
            "line": real,
            "slack": real,
            "tension_gain": real,
            "pull_gain": real,
        },
        "Spool": {
            "inertia": real,
            "force": jet,
            "force_by_lead": real,
            "pull": jet,
            "pull_by_lead": real,
            "tension": real,
        },
    }
    fields["JointPose"] = {
        "origin": t["SpaceMatrix"],
        "axis": t["SpaceMatrix"],
        "rotation": t["TurnMatrix"],
    }
    for name, members in route_fields(t).items():
        # The device functions of routes need their own types even where no kernel calls them.
        if t["ROUTED"] or name not in fields:
            fields[name] = {**fields.get(name, {}), **members}
    if t["TOUCHES"]:
        fields |= contact_fields(t)
    types = {name: struct_type(name, members) for name, members in fields.items()}
    types["Motion"] = struct_type("Motion", {**fields["Motion"], "modes": types["Modes"]})
    return types


def route_fields(t: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what structs have more where tendons are routed; see `routes`."""
    real, vector, square = t["real"], t["Vec3"], t["Mat33"]
    tendons, arms = t["TendonVector"], t["ArmMatrix"]
    joints = t["JOINTS"]
    t["BendMatrix"] = wp.types.matrix(shape=(t["TENDONS"] * joints, joints), dtype=real)
    t["WayVector"] = wp.types.vector(length=joints, dtype=wp.int32)
    if t["ROUTED"]:
        for name in ("SPAN_TABLE", "START_WAY", "END_WAY"):
            t[name] = whole_table(t[name])
        t["POINT_BODY"] = wp.types.vector(length=len(t["POINT_BODY"]), dtype=wp.int32)(
            *t["POINT_BODY"]
        )
    return {
        "SpanTerms": {
            "length": real,
            "start": vector,
            "end": vector,
            "start_start": square,
            "start_end": square,
            "end_end": square,
        },
        "Routes": {"length": tendons, "slope": arms, "bend": t["BendMatrix"]},
        "RouteTerms": {"length": real, "slope": t["JointVector"], "bend": t["JointMatrix"]},
        "Drive": {"length": tendons, "arms": arms, "bow": tendons, "bend": t["BendMatrix"]},
        "Forces": {"arms": t["RowMatrix"], "bow": t["RowVector"]},
        "Motion": {"arms": t["RowMatrix"]},
    }


def whole_table(rows: Sequence[Sequence[int]]) -> Any:
    """Return whole numbers as a matrix that device code indexes."""
    table = wp.types.matrix(shape=(len(rows), len(rows[0])), dtype=wp.int32)
    return table(*chain.from_iterable(rows))


def contact_fields(t: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the structs of contacts; see `contacts` and `contact_distances`."""
    real, vector, joints, square = t["real"], t["Vec3"], t["JointVector"], t["JointMatrix"]
    t["CapsuleMatrix"] = wp.types.matrix(shape=(t["CAPSULES"], 3), dtype=real)
    return {
        "ContactPose": {
            "origin": t["SpaceMatrix"],
            "axis": t["SpaceMatrix"],
            "start": t["CapsuleMatrix"],
            "end": t["CapsuleMatrix"],
        },
        "Surface": {"distance": real, "normal": vector},
        "Overlap": {"depth": real, "normal": vector, "point": vector},
        "Grip": {
            "force": real,
            "stiffness": real,
            "damping": real,
            "drag": vector,
            "direction": vector,
            "shear_stiffness": real,
            "shear_damping": real,
            "stretch": vector,
        },
        "ContactTerms": {
            "torque": joints,
            "stiffness": square,
            "damping": square,
            "force": vector,
            "stretch": vector,
        },
    }
