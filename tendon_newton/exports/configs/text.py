"""A configuration file as text."""

from pathlib import Path
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.exports.configs.students import (
    RATE,
    Scales,
    fit_mlp,
    lessons_of,
    write_torchscript,
)
from tendon_newton.exports.linking import literal
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

PHYSICS_STEP = 0.005  # Step of the physics [s] for which delays are counted
CONFIG_FILE, NETWORK_FILE = "servo_cfg.py", "mlp.pt"
MLP_STEPS = 1500  # Steps of training
FAST = 1.0e6  # A speed [rad/s, m/s] that nothing reaches: the network knows the motor's


def config_text(title: str, imports: list[str], entries: dict[str, Any]) -> str:
    """Return a Python file with a dictionary of configuration objects: key -> (class, fields)."""
    lines = [f'"""{title}"""', "", *imports, "", "ACTUATORS = {"]
    for key, (kind, numbers) in entries.items():
        lines.append(f"    {key!r}: {kind}(")
        lines += [f"        {field}={literal(value)}," for field, value in numbers.items()]
        lines.append("    ),")
    return "\n".join([*lines, "}", ""])


def gravity_text(gravity: Array) -> str:
    """Return gravity [m/s2] as Python text."""
    return "(" + ", ".join(f"{value + 0.0:.8g}" for value in gravity) + ")"


def write_network(
    folder: Path, mechanism: Mechanism, model: Model
) -> tuple[Scales | None, str, tuple[Path, ...]]:
    """Write an MLP that has learned a force network; return its scales, a note on it and its file.

    Of any other servo there is none.
    """
    if not find_actuator(model.actuator.name).held:
        return None, "", ()
    lessons = lessons_of(mechanism, model)
    network, error = fit_mlp(lessons, steps=MLP_STEPS)
    write_torchscript(folder / NETWORK_FILE, network)
    note = NETWORK_NOTE.format(rate=RATE, error=error)
    return lessons.scales, note, (folder / NETWORK_FILE,)


NETWORK_NOTE = """
The network sees error and speed at {rate:g} Hz: take physics steps of that length. On runs of the
model that it has not seen its force strays by {error:.4f} N.
"""
