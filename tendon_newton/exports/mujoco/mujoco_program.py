"""One Python file that steps an exported model: runtime, the law and the model's numbers."""

from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.effects import EFFECTS
from tendon_newton.exports.linking import Linker, Text
from tendon_newton.exports.model_law import ModelLaw
from tendon_newton.exports.model_numbers import number
from tendon_newton.exports.runtime import (
    commands,
    engine,
    facts,
    jets,
    networks,
    resting,
    rows,
    servos,
    stepping,
)
from tendon_newton.law.servo import HELD
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.model.parameter_table import force_limit_of, spool_radius_of

# Modules of the program, in the order in which they are joined
RUNTIME = (jets, servos, resting, networks, commands, stepping, rows)
# What a motor at its greatest speed holds against, in shares of its greatest force [1]: MuJoCo's
# solver loses its digits to a bound that is no force of the bench
HOLDING = 4.0
LONGEST_STEP = 1.0e-4  # Default step [s]


def program_text(
    mechanism: Mechanism,
    model: Model,
    servos: list[dict[str, Any]],
    *,
    title: str,
    span: tuple[float, float],
    network: dict[str, Any] | None = None,
) -> str:
    """Return the Python file that steps an exported model.

    `servos` are those of `servo_numbers`; its own commands move between two motor angles [rad].
    """
    rotor = find_actuator(model.actuator.name).rotor
    free = rotor and any(not tendon.direct for tendon in mechanism.tendons)
    law = ModelLaw(model, free)
    most = max(tendon.force_limit for tendon in mechanism.tendons)
    linker = Linker(law, device=False, numbers={"HELD": min(HELD, HOLDING * most)})
    known = {
        "FOLDER": Text("Path(__file__).resolve().parent"),
        "PARAMETERS": law.parameters,
        "SERVO_ROWS": servos,
        "JOINT_ROWS": joint_rows(mechanism),
        "MEMORY_SIZE": law.memory_size,
        "SPAN": span,
        "PERIOD": number(model, "sample_period_error", "scale"),
        "NETWORK": network,
        "TIME_STEP": LONGEST_STEP,
    }
    given = {facts.__name__: "", engine.__name__: "import mujoco"}
    return linker.program(f"{title}\n\n{PREFACE}", known, RUNTIME, given=given, last="run(make)")


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


def servo_numbers(
    mechanism: Mechanism, model: Model, signs: list[float], offsets: list[float]
) -> list[dict[str, Any]]:
    """Return what a program knows of each servo.

    Signs and offsets [m] are as for `add_servo`.
    """
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
            "force_limit": force_limit_of(model) or tendon.force_limit,
            "direct": tendon.direct,
            "dry": dry,
        }
        for tendon, sign, offset in zip(mechanism.tendons, signs, offsets, strict=True)
    ]


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
