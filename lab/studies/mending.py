"""Names judged by what mending changes: units with three wrong things, and the same without them.

Each unit is recorded with its wrong things and diagnosed as a newcomer does it, then recorded
without them and held against its answer, which is told what was mended: wrong things that were
named, or with which a name is mistaken. Their numbers must move back by what was planted, within
their intervals. What is in DIR already is not done again; ``mending.json`` has every unit and the
rates.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lab.studies.days import Row, compared, diagnosed, inside, recorded
from lab.studies.unit_score import rate
from lab.studies.units import read, truth_of
from tendon_hardware.virtual_bench.physics.wear import planted_causes


def mends_of(unit: int, out: Path) -> Row:
    """Record, diagnose and mend one unit."""
    folder = out / f"unit_{unit}"
    folder.mkdir(parents=True, exist_ok=True)
    spoilt = recorded(unit, "planted", 1, folder / "planted")
    model = diagnosed(spoilt, folder)
    answer = read(model.with_name("diagnosis.json"))
    mended = recorded(unit, "new", 2, folder / "mended")
    heard = {
        name
        for cause in (*answer["effects"], *answer["suspected"])
        for name in (cause["name"], *cause["indistinguishable_from"])
    }
    said = [kind for kind in planted_causes(unit) if kind in heard]
    changes = compared(mended, spoilt, model, folder / "mend", said)
    numbers = {number["cause"]: number for number in changes["numbers"]}
    own = numbers.keys() & {*said}
    causes = {
        kind: {"size": size, "named": kind in heard}
        | (went(numbers[kind], kind, size, (spoilt, mended)) if kind in own else {})
        for kind, size in planted_causes(unit).items()
    }
    errors = {key: changes[key] for key in ("before", "after", "on_its_own_day")}
    moved = sorted(name for name, number in numbers.items() if number["moved"])
    return {"unit": unit, "planted": causes, "moved": moved, **errors}


def went(number: Mapping[str, Any], kind: str, size: float, days: tuple[Path, Path]) -> Row:
    """Tell whether a mended cause's number moved, and whether by what was taken away."""
    if kind == "viscous_friction":  # planted as a factor of the servo's own
        before, after = (truth_of(day)[kind][0]["coefficient"] for day in days)
        size = before - after
    if kind in ("viscous_friction", "tendon_slack"):  # there is no less than none
        size = min(size, number["before"])
    kept = {
        key: number[key] for key in ("before", "value", "ci95", "moved", "probability", "rivals")
    }
    return kept | {"inside": inside(number, kind, size, back=True)}


def summary(rows: Sequence[Row]) -> Row:
    """Return the rates of all units."""
    causes = [cause for row in rows for cause in row["planted"].values()]
    named = [cause for cause in causes if cause["named"]]
    return {
        "named": rate(len(named), len(causes)),
        **{k: rate(sum(c.get(k, False) for c in named), len(named)) for k in ("moved", "inside")},
    }
