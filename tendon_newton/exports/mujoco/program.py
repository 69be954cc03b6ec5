"""One Python file that steps an exported model: runtime, effects' code and numbers in one text."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.actuators.learned import hold_answer
from tendon_newton.data.model_file import Model
from tendon_newton.effects import EFFECTS, Effect, Stage, find_effect
from tendon_newton.exports.carried_code import CarriedCode
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.model.parameter_table import ParameterTable, spool_radius_of
from tendon_newton.simulation.model.structure import in_catalogue_order

RUNTIME = ("jets", "servos", "resting", "stepping", "networks", "rows")
"""Files of the runtime, in the order in which they are joined."""
TENDON_STAGES = (
    Stage.CLOCK,
    Stage.RADIUS,
    Stage.STRING,
    Stage.STRETCH,
    Stage.ANGLE,
    Stage.ERROR,
    Stage.DUTY,
    Stage.MOTOR_FORCE,
    Stage.SPOOL_FORCE,
    Stage.TENSION,
    Stage.ENCODER,
    Stage.TRANSMISSION,
    Stage.SPEED,
)
WORLD_STAGES = (
    Stage.PERIOD,
    Stage.SPRING,
    Stage.DAMPING,
    Stage.JOINT_FRICTION,
    Stage.INERTIA,
    Stage.TILT,
    Stage.CELL_CLOCK,
    Stage.CELL_LAG,
    Stage.CELL,
)
REMEMBERING = ("error", "duty", "motor_force", "spool_force", "tension")
"""Stages along a tendon after which effects renew what they remember."""
IMPORT = re.compile(r"^(?:from|import) [^\n(]*(?:\([^)]*\))?\n", re.MULTILINE)
DOCSTRING = re.compile(r'\A"""(.*?)"""\n', re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class NetworkFacts:
    """What a program must know to ask a force network."""

    file: str
    """Name of the ONNX file beside the program."""
    rate: float
    window: int
    streaming: bool


@dataclass(kw_only=True)
class Pieces:
    """Effects by stage, as text."""

    code: CarriedCode = field(default_factory=CarriedCode)
    stages: dict[str, list[str]] = field(default_factory=dict)
    memories: dict[Stage, int] = field(default_factory=dict)

    def add(self, effect: type[Effect], values: tuple[float, ...], *, free_spool: bool) -> None:
        """Add one effect with its numbers to every stage in which it acts."""
        places: tuple[int, ...] = ()
        replaced = effect.spool_stages if free_spool else ()
        if effect.memory is not None and effect.memory not in replaced:
            owner = Stage.SPRING if effect.memory is Stage.SPRING else Stage.TENSION
            first = self.memories.get(owner, 0)
            places = tuple(range(first, first + len(effect.renewals())))
            self.memories[owner] = first + len(places)
            for renewal, place in zip(effect.renewals(), places, strict=True):
                name = f"{effect.name}_{renewal.__name__}"
                self._put(f"remember_{effect.memory.value}", renewal, name, values, places, place)
        for stage in Stage:
            hook = effect.hook(stage)
            if hook is not None and stage not in replaced:
                self._put(stage.value, hook, f"{effect.name}_{stage.value}", values, places)

    def _put(
        self,
        stage: str,
        function: Any,
        name: str,
        values: tuple[float, ...],
        places: tuple[int, ...],
        result: int = -1,
    ) -> None:
        carried = self.code.carry(function, name)
        padded = (*values, *(0.0,) * (3 - len(values)))
        first, second = (*places, -1, -1)[:2]
        piece = f"Piece({carried}, {literal(padded)}, {first}, {second}, {result})"
        self.stages.setdefault(stage, []).append(piece)

    def text(self, stages: tuple[str, ...]) -> str:
        """Return a dictionary of stages as text."""
        rows = [f"    {s!r}: [{', '.join(self.stages.get(s, []))}]," for s in stages]
        return "{\n" + "\n".join(rows) + "\n}"


def program_text(
    mechanism: Mechanism,
    model: Model,
    servos: list[dict[str, Any]],
    *,
    title: str,
    span: tuple[float, float],
    network: NetworkFacts | None = None,
) -> str:
    """Return the Python file that steps an exported model.

    Args:
        mechanism: The bench with the model's own numbers.
        model: Actuator and effects.
        servos: `servo_numbers`.
        title: First line of its docstring.
        span: Motor angles [rad] between which its own commands move.
        network: Its force network, if it has one.
    """
    pieces = pieces_of(mechanism, model)
    actuator = find_actuator(model.actuator.name)
    force = pieces.code.carry(actuator.force, "actuator_force")
    hold = pieces.code.carry(hold_answer, "hold_answer") if actuator.held else "None"
    duty = "None"
    if actuator.modulated:
        asked = pieces.code.carry(actuator.duty, "actuator_duty")
        duty = f"({asked}, {pieces.code.carry(actuator.driven, 'actuator_driven')})"
    remembering = tuple(f"remember_{stage}" for stage in REMEMBERING)
    tendon_stages = (*(s.value for s in TENDON_STAGES), *remembering)
    world_stages = (*(s.value for s in WORLD_STAGES), "remember_spring")
    memories = pieces.memories.get(Stage.TENSION, 0)
    rows = [{**servo, "memories": memories} for servo in servos]
    opened = "None"
    if network is not None:
        opened = (
            f"Network(FOLDER / {network.file!r}, {network.rate!r}, {network.window}, "
            f"{network.streaming})"
        )
    return "\n".join(
        [
            f'"""{title}\n\n{PREFACE}"""\n',
            "from __future__ import annotations\n",
            IMPORTS,
            runtime_text(),
            "\n# ---- the model's actuator and effects, as they stand in the catalogue\n",
            "TENDONS = 1\nHELD_MEMORY = 0\n",
            pieces.code.text(),
            "\n# ---- the model's numbers\n",
            f"FOLDER = Path(__file__).resolve().parent\nSPAN = {literal(span)}",
            f"SERVOS = {literal_rows(rows)}",
            f"JOINTS = {literal_rows(joint_rows(mechanism))}",
            f"TENDON_STAGES = {pieces.text(tendon_stages)}",
            f"WORLD_STAGES = {pieces.text(world_stages)}",
            f"SPRING_MEMORIES = {pieces.memories.get(Stage.SPRING, 0)}\n\n",
            MAKE.format(force=force, duty=duty, hold=hold, network=opened),
        ]
    )


PREFACE = """Made by tendon-newton export. It needs mujoco and numpy, and onnxruntime for a force
network. In a program of your own:

    import mujoco, tendon_step

    model = mujoco.MjModel.from_xml_path("model.xml")
    hook = tendon_step.make_hook(model, mujoco.MjData(model))
    hook.reset([0.5])
    hook.command[:] = 1.0
    hook.step()
    print(hook.read())

or: python tendon_step.py commands.csv --out replay.csv
"""
IMPORTS = """import argparse
import csv
import math
from collections import deque
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, SupportsFloat

import mujoco
import numpy as np
"""
MAKE = '''def make_hook(model: Any, data: Any) -> Hook:
    """Return the hook of a MuJoCo model that holds the exported bodies and tendons."""
    servos = [Servo(row, TENDON_STAGES, {force}, {duty}, {hold}) for row in SERVOS]
    return Hook(model, data, servos, JOINTS, WORLD_STAGES, SPRING_MEMORIES, {network})


if __name__ == "__main__":
    run(make_hook, FOLDER, SPAN)
'''


@cache
def runtime_text() -> str:
    """Return the runtime's files as one text, without their imports."""
    parts = []
    for name in RUNTIME:
        text = files("tendon_newton.exports.runtime").joinpath(f"{name}.py").read_text("utf-8")
        body = IMPORT.sub("", DOCSTRING.sub("", text))
        summary = text.split("\n", 1)[0].strip('"').rstrip(".")
        parts.append(f"\n# ---- {summary}\n\n{body.strip()}\n")
    return "\n".join(parts)


def pieces_of(mechanism: Mechanism, model: Model) -> Pieces:
    """Return a model's effects by stage, in the order of the catalogue."""
    names = in_catalogue_order(tuple(effect.name for effect in model.effects))
    table = ParameterTable(actuator=model.actuator.name, effects=names)
    vector = table.vector(model)
    rotor = find_actuator(model.actuator.name).rotor
    free = rotor and any(not tendon.direct for tendon in mechanism.tendons)
    pieces = Pieces()
    for name in names:
        values = tuple(float(vector[i]) for i in table.columns(name))
        pieces.add(find_effect(name), values, free_spool=free)
    return pieces


def servo_numbers(
    mechanism: Mechanism, model: Model, signs: list[float], offsets: list[float]
) -> list[dict[str, Any]]:
    """Return what a program knows of each servo.

    Args:
        mechanism: The bench.
        model: Actuator and effects.
        signs: Whether MuJoCo's tendon grows (+1) or shrinks (-1) when it is wound in.
        offsets: Excursion [m] at which MuJoCo's tendon has no length.
    """
    actuator = find_actuator(model.actuator.name)
    table = ParameterTable(actuator=model.actuator.name, effects=())
    values = [float(x) for x in table.vector(without_effects(model))[: len(actuator.parameters)]]
    armature = 0.0
    if actuator.rotor:
        armature = values[[p.name for p in actuator.parameters].index("armature")]
    dry = any(
        effect.values[name] != 0.0 for effect in model.effects for name in EFFECTS[effect.name].dry
    )
    radius = spool_radius_of(model)
    return [
        {
            "name": tendon.name,
            "sign": sign,
            "offset": offset,
            "spool_radius": tendon.spool_radius if radius is None else radius,
            "force_limit": tendon.force_limit,
            "direct": tendon.direct,
            "dry": dry,
            "actuator": {"values": values, "rotor": actuator.rotor, "armature": armature},
        }
        for tendon, sign, offset in zip(mechanism.tendons, signs, offsets, strict=True)
    ]


def without_effects(model: Model) -> Model:
    """Return a model's actuator alone."""
    return Model(actuator=model.actuator)


def joint_rows(mechanism: Mechanism) -> list[dict[str, Any]]:
    """Return what a program knows of each joint."""
    return [
        {
            "name": joint.name,
            "stiffness": joint.stiffness,
            "rest": joint.rest,
            "damping": joint.damping,
            "friction": joint.friction,
            "lower": joint.limits[0],
            "upper": joint.limits[1],
            "stop_stiffness": joint.stop_stiffness,
            "stop_damping": joint.stop_damping,
        }
        for joint in mechanism.joints
    ]


def literal(value: Any) -> str:
    """Return a value as Python text; infinity has no literal of its own."""
    if isinstance(value, float):
        if math.isinf(value):
            return "math.inf" if value > 0.0 else "-math.inf"
        return repr(float(value))
    if isinstance(value, tuple):
        return "(" + ", ".join(literal(v) for v in value) + ("," if len(value) == 1 else "") + ")"
    if isinstance(value, list):
        return "[" + ", ".join(literal(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k!r}: {literal(v)}" for k, v in value.items()) + "}"
    return repr(value)


def literal_rows(rows: Sequence[dict[str, Any]]) -> str:
    """Return a list of dictionaries, one a line."""
    return "[\n" + "".join(f"    {literal(row)},\n" for row in rows) + "]"
