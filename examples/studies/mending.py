"""Names judged by what mending changes: units with three wrong things, and the same without them.

``python -m examples.studies.mending 110 111 112 --out DIR [--jobs N]``

Each unit is recorded with its wrong things and diagnosed as a newcomer does it, then recorded
without them and held against its answer, which is told what was mended: wrong things that were
named, or with which a name is mistaken. Their numbers must move back by what was planted, within
their intervals. What is in DIR already is not done again; ``mending.json`` has every unit and the
rates.
"""

import argparse
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from examples.studies.days import Row, compared, diagnosed, inside, recorded
from examples.studies.unit_score import rate
from examples.studies.units import read, truth_of
from tendon_hardware.virtual_bench.physics.wear import planted_causes
from tendon_newton.data.files.json_file import write_json
from tendon_newton.scheduler import JobOptions, completed


def unit_row(unit: int, out: Path) -> Row:
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


def main() -> None:
    """Print a row for each unit and the rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("units", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=1)
    a = parser.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    for _, row in completed(partial(unit_row, out=a.out), a.units, JobOptions(jobs=a.jobs)):
        rows.append(row)
        print(
            f"{row['unit']:4d}  planted {sorted(row['planted'])}, moved {row['moved']}", flush=True
        )
    rows.sort(key=lambda row: row["unit"])
    causes = [cause for row in rows for cause in row["planted"].values()]
    named = [cause for cause in causes if cause["named"]]
    total = {
        "named": rate(len(named), len(causes)),
        **{k: rate(sum(c.get(k, False) for c in named), len(named)) for k in ("moved", "inside")},
    }
    write_json(a.out / "mending.json", {"summary": total, "units": rows})
    for name, found in total.items():
        print(f"{name:24s} {found['hits']} of {found['of']}")


if __name__ == "__main__":
    main()
