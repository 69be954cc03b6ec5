"""The Python file beside an exported bench: a drive for Newton with the model's own device code."""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.device_code import slots, structs
from tendon_newton.effects import Effect, Stage, find_effect
from tendon_newton.exports.carried_code import CarriedCode
from tendon_newton.exports.mujoco.program import literal, literal_rows, without_effects
from tendon_newton.exports.newton import device, grips
from tendon_newton.exports.newton.structs import Answer, Bench, Kept
from tendon_newton.simulation.model.parameter_table import ParameterTable
from tendon_newton.simulation.model.structure import in_catalogue_order
from tendon_newton.simulation.tendons import pipeline

TEMPLATE = "drive.template"
STAGES: dict[Stage, Any] = {
    Stage.RADIUS: slots.radius_effects,
    Stage.STRING: slots.string_effects,
    Stage.SPEED: slots.speed_effects,
    Stage.STRETCH: slots.stretch_effects,
    Stage.ANGLE: slots.angle_effects,
    Stage.ERROR: slots.error_effects,
    Stage.DUTY: slots.duty_effects,
    Stage.MOTOR_FORCE: slots.motor_force_effects,
    Stage.SPOOL_FORCE: slots.spool_force_effects,
    Stage.TENSION: slots.tension_effects,
    Stage.TRANSMISSION: slots.transmission_effects,
    Stage.ENCODER: slots.encoder_effects,
    Stage.SPRING: slots.spring_effects,
    Stage.DAMPING: slots.damping_effects,
    Stage.JOINT_FRICTION: slots.joint_friction_effects,
}
"""Stages that a drive has, with the functions that call their effects."""
MEMORIES: dict[Stage, Any] = {
    Stage.ERROR: slots.error_memory,
    Stage.DUTY: slots.duty_memory,
    Stage.MOTOR_FORCE: slots.motor_force_memory,
    Stage.SPOOL_FORCE: slots.spool_force_memory,
    Stage.TENSION: slots.tension_memory,
    Stage.SPRING: slots.spring_memory,
}
"""Stages after which a drive's effects renew what they remember."""
STRUCTS = (structs.Tendon, structs.Joint, structs.Flow, Kept, Bench, Answer)
MARK = re.compile(r"\{\{(\w+)\}\}")


@dataclass(frozen=True, kw_only=True)
class DriveNumbers:
    """What a drive knows of its bench."""

    tendons: Sequence[dict[str, Any]]
    """Per tendon: path, spool radius, limits, inertia."""
    joints: Sequence[dict[str, Any]]
    """Per joint: spring, damper, range."""
    free_spool: bool
    """Whether a rotor stands between the motor and the string."""
    delay: float
    """Of the command [s]."""
    step: float
    """Longest step [s]."""
    period: float
    """Seconds that pass in one second of the log's clock [1]."""
    network: dict[str, Any] | None = None
    """File, rate [Hz] and window of a force network."""


@dataclass(kw_only=True)
class Places:
    """Where each effect's numbers and memories stand."""

    names: tuple[str, ...]
    free_spool: bool
    offsets: dict[str, int]
    memories: dict[str, tuple[int, ...]] = field(default_factory=dict)
    count: int = 0

    def hook(self, effect: type[Effect], stage: Stage) -> Any:
        """Return an effect's device function of a stage, None where it does not act."""
        replaced = self.free_spool and stage in effect.spool_stages
        return None if replaced else effect.hook(stage)

    def add_memories(self) -> None:
        """Give a place to each number that an effect remembers."""
        for name in self.names:
            effect = find_effect(name)
            if effect.memory is None or (self.free_spool and effect.memory in effect.spool_stages):
                continue
            size = len(effect.renewals())
            self.memories[name] = tuple(range(self.count, self.count + size))
            self.count += size

    def values(self, name: str, owner: str | None) -> str:
        """Return the text of an effect's own numbers and memories."""
        at = self.offsets[name]
        kept = [f"{owner}.memory[{k}]" for k in self.memories.get(name, ()) if owner]
        kept += ["real(0.0)"] * (2 - len(kept))
        return f"Values(p[{at}], p[{at + 1}], p[{at + 2}], {kept[0]}, {kept[1]})"


def drive_text(model: Model, numbers: DriveNumbers) -> str:
    """Return the Python file of a drive.

    Args:
        model: Actuator and effects.
        numbers: Of its bench.
    """
    names = in_catalogue_order(tuple(effect.name for effect in model.effects))
    table = ParameterTable(actuator=model.actuator.name, effects=names)
    vector = [float(x) for x in table.vector(model)]
    actuator = find_actuator(model.actuator.name)
    offsets = {name: table.columns(name)[0] for name in names}
    places = Places(names=names, free_spool=numbers.free_spool, offsets=offsets)
    places.add_memories()
    held = places.count
    count = places.count + (2 if actuator.held else 0)
    duty = any(find_effect(name).hook(Stage.DUTY) is not None for name in names)
    facts = {
        "PARAMETERS": literal(vector),
        "MEMORY": str(max(count, 1)),
        "HELD": str(held),
        "HAS_ROTOR": repr(actuator.rotor and not numbers.free_spool),
        "FREE_SPOOL": repr(numbers.free_spool),
        "HAS_DUTY": repr(duty),
        "RIGID": repr(numbers.free_spool and "tendon_compliance" not in names),
        "STEP": repr(numbers.step),
        "STRUCTS": "\n\n".join(struct_text(declared) for declared in STRUCTS),
        "CODE": carried_text(model, places, duty=duty),
        "TENDONS": literal_rows(numbers.tendons),
        "JOINTS": literal_rows(numbers.joints),
        "DELAY": repr(numbers.delay),
        "PERIOD": repr(numbers.period),
        "NETWORK": literal(numbers.network),
        "HOLD": literal([float(x) for x in table.vector(without_effects(model))[:2]])
        if actuator.held
        else "[0.0, 0.0]",
        "NETWORK_CLASS": "" if numbers.network is None else network_class(),
    }
    text = files("tendon_newton.exports.newton").joinpath(TEMPLATE).read_text("utf-8")
    return MARK.sub(lambda match: facts[match[1]], text)


def carried_text(model: Model, places: Places, *, duty: bool) -> str:
    """Return actuator, effects, and what calls them, as device code."""
    code = CarriedCode(device=True)
    actuator = find_actuator(model.actuator.name)
    code.carry(actuator.force, "actuator_force")
    code.carry(pipeline.clip, "clip")
    if duty:
        asked = actuator.duty if actuator.modulated else pipeline.duty_of_force
        given = actuator.driven if actuator.modulated else pipeline.force_of_duty
        code.carry(asked, "asked_duty")
        code.carry(given, "driven_force")
    for stage, slot in STAGES.items():
        code.add(stage_text(code, stage, slot, places))
    for stage, slot in MEMORIES.items():
        code.add(memory_text(code, stage, slot, places))
    for function in (device.at_rest, device.answered, grips.joint_grip, pipeline.spring_torque):
        code.carry(function, function.__name__)
    code.carry(pipeline.damping_torque, "damping_torque")
    return code.text()


def network_class() -> str:
    """Return the class that asks a force network, as text."""
    text = files("tendon_newton.exports.runtime").joinpath("networks.py").read_text("utf-8")
    return text[text.index("class Network:") :] + "\n"


def header(slot: Any) -> tuple[str, list[str]]:
    """Return the first line of a slot's function, and the names of its arguments."""
    kinds = inspect.get_annotations(slot)
    arguments = [name for name in kinds if name != "return"]
    given = ", ".join(f"{name}: {kinds[name]}" for name in arguments)
    return f"@wp.func\ndef {slot.__name__}({given}) -> {kinds['return']}:", arguments


def stage_text(code: CarriedCode, stage: Stage, slot: Any, places: Places) -> str:
    """Return the function that lets the effects of a stage act one after the other."""
    first, arguments = header(slot)
    signal, *others = arguments
    owner = next((name for name in others if name in ("tendon", "joint")), None)
    lines = [first, f"    out = {signal}"]
    for name in places.names:
        hook = places.hook(find_effect(name), stage)
        if hook is not None:
            carried = code.carry(hook, f"{name}_{stage.value}")
            seen = f", {owner}" if owner else ""
            lines.append(f"    out = {carried}(out{seen}, {places.values(name, owner)})")
    return "\n".join([*lines, "    return out"])


def memory_text(code: CarriedCode, stage: Stage, slot: Any, places: Places) -> str:
    """Return the function that lets the effects of a stage renew what they remember."""
    first, (signal, owner, _, memory) = header(slot)
    lines = [first, f"    out = {memory}"]
    for name, kept in places.memories.items():
        effect = find_effect(name)
        if effect.memory is not stage:
            continue
        for renewal, place in zip(effect.renewals(), kept, strict=True):
            carried = code.carry(renewal, f"{name}_{renewal.__name__}")
            value = f"{carried}({signal}, {owner}, {places.values(name, owner)})"
            lines.append(f"    out[{place}] = {value}")
    return "\n".join([*lines, "    return out"])


def struct_text(declared: type) -> str:
    """Return a struct's declaration as Warp takes it.

    Fields that few kernels have are left out, and so are the marks of sleeping effects: a drive has
    those of its model alone.
    """
    fields = inspect.get_annotations(declared)
    own = {n: kind for n, kind in fields.items() if not kind.startswith(("Annotated", "Flags"))}
    lines = [f"    {n}: {kind}" for n, kind in own.items()]
    return "\n".join(["@wp.struct", f"class {declared.__name__}:", *lines])
