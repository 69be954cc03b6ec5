"""One Python file that steps an exported model: runtime, the law and the model's numbers."""

from textwrap import indent
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.effects import law_of
from tendon_newton.exports.linking import Linker
from tendon_newton.exports.model_law import ModelLaw
from tendon_newton.exports.model_numbers import number
from tendon_newton.exports.runtime import commands, jets, networks, resting, rows, servos, stepping
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
        "PARAMETERS": law.parameters,
        "SERVO_ROWS": servos,
        "JOINT_ROWS": joint_rows(mechanism),
        "SPAN": span,
        "PERIOD": number(model, "sample_period_error", "scale"),
        "NETWORK": network,
        "TIME_STEP": LONGEST_STEP,
    }
    return linker.program(f"{title}\n\n{PREFACE}", known, RUNTIME, last="run(make)")


USE = """import mujoco, tendon_step

model = mujoco.MjModel.from_xml_path("model.xml")
model.opt.timestep = 1.0e-4
hook = tendon_step.make_hook(model, mujoco.MjData(model))
hook.reset([0.5])      # desired motor angle [rad], one per tendon
hook.command[:] = 1.0
hook.step()            # in place of mujoco.mj_step
print(hook.read())     # angle [rad], speed [rad/s], force [N]
"""

PREFACE = (
    "Made by tendon-newton export. It needs mujoco and numpy, and onnxruntime for a force\n"
    "network. In a program of your own:\n\n"
    + indent(USE, "    ")
    + "\nor: python tendon_step.py commands.csv --out replay.csv\n"
)


def servo_numbers(
    mechanism: Mechanism, model: Model, signs: list[float], offsets: list[float]
) -> list[dict[str, Any]]:
    """Return what a program knows of each servo.

    Signs and offsets [m] are as for `add_servo`.
    """
    dry, smooth = (
        any(e.values[name] != 0.0 for e in model.effects for name in getattr(law_of(e.name), kind))
        for kind in ("dry", "smooth")
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
            "dry": dry and not smooth,
            "bristles": dry and smooth,
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
