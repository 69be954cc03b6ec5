"""The page on model files: ``python docs/make_model_file.py`` writes it from the tables."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from math import isinf
from pathlib import Path

from tendon_newton.actuators import ACTUATORS
from tendon_newton.data.bench_overrides import BENCH_OVERRIDE_RANGES
from tendon_newton.data.model_file import KNOWN_KEYS
from tendon_newton.data.parameters import Parameter
from tendon_newton.effects import EFFECTS
from tendon_newton.simulation.model.bench_numbers import TOLERANCE
from tendon_newton.simulation.model.parameter_table import SPOOL_RADII

PAGE = Path(__file__).resolve().parent / "model_file.md"
SIDES = {
    "actuator": "Between the command and the load cell",
    "transmission": "Between the spool and the mechanism",
    "mechanism": "The mechanism",
    "sensor": "The sensors",
}
HEADINGS = {
    "actuator": "[the actuator](#the-actuator): its kind and its numbers",
    "effects": "[effects](#effects) that the model has already, an `[[effects]]` table each",
    "bench_overrides": "[numbers of a bench](#numbers-of-a-bench) that differ from its asset",
    "fit": "[unknown numbers](#unknown-numbers), refitted by a diagnosis",
    "tolerances": "standard deviations of stated numbers, as shares or in SI, where you know "
    "better: `load_cell_gain = 0.01`. An effect with 0 is exact, and no cause: "
    "`acceleration_limit = 0` where a register holds it",
}
EXAMPLE = """\
fit = ["torque_constant", "resistance"]

[bench_overrides.finger]
mass = [0.012, 0.008]

[actuator]
kind = "pwm_servo"
duty_per_rad = 0.1
max_duty = 0.9
supply_voltage = 9.0
torque_constant = 1.15
resistance = 13.9
armature = 0.002
spool_radius = 0.0125

[[effects]]
name = "coulomb_friction"
force = 1.2
"""
INTRODUCTION = (
    "# The model file\n\n"
    "A model file states the actuator and the effects of a bench, in SI units and radians. "
    "`collect` and `import` write one beside the recordings: correct its numbers, and leave the "
    "effects to `diagnose`, which writes the extended one. [The equations](model.md) say what the "
    "numbers do.\n\n"
    f"```toml\n{EXAMPLE}```\n\n"
    "Which kind?\n\n"
    "- only command, angle and perhaps the tension are known: `ideal`\n"
    "- a DC motor whose supply is known as well: `pwm_servo`\n"
    "- a motor that is given a torque: `pd_torque`\n"
    "- a joint under an unknown load: `ideal_position`\n"
    "- a transmission that was measured at both ends: `measured_path`\n\n"
)


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page in Markdown."""
    keys = rows(("key", "what it holds"), ([f"`{key}`", HEADINGS[key]] for key in KNOWN_KEYS))
    parts = [INTRODUCTION + keys, actuators(), effects(), benches(), unknown()]
    return "\n".join(parts)


def actuators() -> str:
    """Describe each kind with its keys."""
    low, high = SPOOL_RADII
    table = rows(
        ("kind", "what it is", "key", "unit", "typical", "range"),
        (
            [
                *named(kind, actuator, place),
                f"`{p.name}`",
                p.unit,
                number(p.nominal),
                span(p) + may_lack(p),
            ]
            for kind, actuator in ACTUATORS.items()
            for place, p in enumerate(actuator.parameters)
        ),
    )
    return "\n".join(
        [
            "## The actuator\n",
            "All keys of the `kind` must be there, except those that may be left out, and those of "
            "`learned`, which the card of its network has.\n",
            table,
            f"Any kind takes `spool_radius`, {low:g} to {high:g} m; without it that of the asset "
            "counts. So does `force_limit` [N], the motor's greatest force before its gear. "
            "`learned` needs `file`, the path of the network that `train-force` wrote.\n",
            "Ranges are those of the nominal finger and its servo. On a machine of another size "
            "forces, angles and lengths may be up to 10,000 times as large or as small.\n",
        ]
    )


def named(name: str, declared: type, place: int) -> tuple[str, str]:
    """Return a name and what it is, for the first of its rows alone."""
    return (f"`{name}`", summary(declared)) if place == 0 else ("", "")


def may_lack(parameter: Parameter) -> str:
    """Say of a number whether a file may leave it out."""
    return "; may be left out" if parameter.optional else ""


def effects() -> str:
    """List the effects with their keys and null values."""
    parts = [
        "## Effects\n",
        "Each `[[effects]]` table has the effect's `name` and all its keys. At its **null value** "
        "an effect does nothing, as if its table were left out.\n",
        "On a bench of several servos `servo = 1` restricts an effect to servo 1 (columns "
        "`theta_d_1`, `theta_1` and `force_1`). Without this key an effect is of all servos that "
        "have none of their own. Effects of the mechanism take the key on a hand only, where it "
        "names the finger of servo 1. `gravity_misalignment` and `sample_period_error` never take "
        "it. No export holds an effect of one servo.\n",
    ]
    for side, heading in SIDES.items():
        table = rows(
            ("name", "what it is", "key", "unit", "null", "range"),
            (
                [*named(name, effect, place), f"`{p.name}`", p.unit, number(p.null), span(p)]
                for name, effect in EFFECTS.items()
                if effect.side == side
                for place, p in enumerate(effect.parameters)
            ),
        )
        parts.append(f"### {heading}\n\n{table}")
    return "\n".join(parts)


def benches() -> str:
    """List the numbers of a bench that a model may state."""
    table = rows(
        ("key", "unit", "range"),
        (
            [f"`{key}`", unit, f"{number(low)} to {number(high)}"]
            for key, (low, high, unit) in BENCH_OVERRIDE_RANGES.items()
        ),
    )
    return (
        "## Numbers of a bench\n\n"
        "`[bench_overrides.BENCH]` states what differs from the asset of that name, with one "
        "value per joint from the base to the tip; an entry of `dataset.toml` does so for one "
        "recording. `arm_mass` is the mass of a uniform arm from the joint to the "
        "link's centre, in addition to `mass`.\n\n"
        + table
        + "\nThe last four are one number each: "
        "how many times the first number of that effect is what the model says of it. Every bench "
        "has its own line, so a diagnosis of several benches fits these for all but the first, and "
        "says which differ.\n"
    )


def unknown() -> str:
    """Say what fit does."""
    return (
        "## Unknown numbers\n\n"
        "`fit` lists keys of the actuator, its `spool_radius`, or keys of a bench's numbers, that "
        "nobody has measured. A diagnosis refits them with every cause that it tries; other "
        "numbers of the actuator stay as they are.\n\n"
        "Masses, lengths and moment arms of a bench may differ from its drawing, usually by less "
        f"than {100.0 * TOLERANCE:.0f} %, and no cause is named for that. The fitted ones stand in "
        "`bench_overrides` of the answer's `model.toml`. Numbers that you state in "
        "`bench_overrides` are not changed.\n"
    )


def summary(declared: type) -> str:
    """Return the first line of a docstring, fit for a cell of a table."""
    return (inspect.getdoc(declared) or "").split("\n")[0].replace("|", "\\|")


def span(parameter: Parameter) -> str:
    """Return a range in words."""
    return f"{number(parameter.lower)} to {number(parameter.upper)}"


def number(value: float) -> str:
    """Return a number as a reader takes it in."""
    return ("-" if value < 0 else "") + "infinite" if isinf(value) else f"{value:g}"


def rows(head: Iterable[str], cells: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""
    titles = list(head)
    lines = [titles, ["---"] * len(titles), *map(list, cells)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    main()
