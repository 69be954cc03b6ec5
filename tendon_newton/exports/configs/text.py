"""A configuration file as text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidOutput
from tendon_newton.exports.base import Coverage
from tendon_newton.exports.mjcf_servo import number
from tendon_newton.exports.program import literal

PHYSICS_STEP = 0.005
"""Step of the physics [s] for which delays are counted."""
CONFIG_FILE = "servo_cfg.py"


def dry_friction(model: Model) -> tuple[float, float]:
    """Return the dry friction [N] of a servo that slides, and that of one that sticks."""
    ways = [number(model, "asymmetric_friction", way) for way in ("winding", "unwinding")]
    plain = number(model, "coulomb_friction", "force") + 0.5 * sum(ways)
    slides = plain + number(model, "stribeck_friction", "coulomb_force")
    return slides, plain + number(model, "stribeck_friction", "static_force")


def config_text(title: str, imports: list[str], name: str, entries: dict[str, Any]) -> str:
    """Return a Python file with configuration objects.

    Args:
        title: Its docstring.
        imports: Import lines.
        name: Of the dictionary.
        entries: Key -> (class, numbers by field).
    """
    lines = [f'"""{title}"""', "", *imports, "", f"{name} = {{"]
    for key, (kind, numbers) in entries.items():
        lines.append(f"    {key!r}: {kind}(")
        lines += [f"        {field}={expression(value)}," for field, value in numbers.items()]
        lines.append("    ),")
    return "\n".join([*lines, "}", ""])


def gravity_text(gravity: Array) -> str:
    """Return gravity [m/s2] as Python text."""
    return "(" + ", ".join(f"{value + 0.0:.8g}" for value in gravity) + ")"


class Expression(str):
    """Text that stands in a file as it is."""


def expression(value: Any) -> str:
    """Return a value as Python text."""
    return str(value) if isinstance(value, Expression) else literal(value)


def write_text(path: Path, text: str) -> None:
    """Write a file.

    Raises:
        InvalidOutput: It cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidOutput(f"{path}: {error.strerror or error}") from error


def coverage_of(exact: tuple[str, ...], nearly: tuple[str, ...]) -> dict[str, Coverage]:
    """Return what becomes of every effect, of which most have no field."""
    out: dict[str, Coverage] = dict.fromkeys(EFFECTS, "none")
    out.update(dict.fromkeys(exact, "exact"))
    out.update(dict.fromkeys(nearly, "approximate"))
    return out
