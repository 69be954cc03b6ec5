"""Rows of the documentation's tables: ``python -m lab.studies.force_table FOLDER ...``.

Each folder is one that ``tendon-newton evaluate-force`` wrote. A row is a family of networks, with
mean and standard deviation over its seeds; the ideal sources come last, from the first folder.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

BENCHES = ("finger", "spring_strong", "spring_weak")
RAMPS = ("contact_ramp", "contact_ramp_tape_roll", "contact_ramp_hand")
SINE = "closing_sine_hand_perturbation"
SHOWN_HOLD = 2.0  # [s]

Table = Mapping[str, Any]


def main() -> None:
    """Print the rows of all folders."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    files = [folder / "evaluation.json" for folder in parser.parse_args().folders]
    tables = {
        file.parent.name: json.loads(file.read_text(encoding="utf-8"))
        for file in files
        if file.is_file()
    }
    print(
        "| from | model | seeds | steps, RMSE [N] | share of 21 N "
        "| finger / strong / weak, held 2 s [N] | ramps free / tape roll / hand [N] "
        "| perturbed sine [N] | late on steps [ms] |"
    )
    print(f"{'|---' * 9}|")
    for name, table in tables.items():
        for family in families(table):
            print(f"| {name} {row(table, family)}")
    for name, table in list(tables.items())[:1]:
        for family in families(table, ideal=True):
            print(f"| {name} {row(table, family)}")


def families(table: Table, *, ideal: bool = False) -> list[str]:
    """Return the families of networks of an evaluation, or those of the ideal source."""
    rows = [m["family"] for m in table["models"] if ("gain_n_per_rad" in m) == ideal]
    return list(dict.fromkeys(rows))


def row(table: Table, family: str) -> str:
    """Return one family's row."""
    own = [m for m in table["models"] if m["family"] == family]
    steps = [m["steps_rmse"] for m in own]
    share = 100.0 * float(np.mean(steps)) / table["share_of_n"]
    held = [rmse(table, family, bench, "steps", SHOWN_HOLD) for bench in BENCHES]
    ramps = [rmse(table, family, "finger", ramp) for ramp in RAMPS]
    cells = [
        family,
        str(len(own)),
        spread(steps),
        f"{share:.1f} %",
        " / ".join(held),
        " / ".join(ramps),
        rmse(table, family, "finger", SINE),
        late(own),
    ]
    return f"| {' | '.join(cells)} |"


def rmse(table: Table, family: str, bench: str, kind: str, hold: float | None = None) -> str:
    """Return a family's error on an experiment [N], mean over its seeds."""
    for experiment in table["experiments"]:
        if (experiment["bench"], experiment["kind"], experiment["hold"]) == (bench, kind, hold):
            return f"{experiment['families'][family]['rmse']:.2f}"
    return "-"


def late(models: Sequence[Table]) -> str:
    """Return by how much changes of the force are late on all steps [ms], with standard error."""
    lags = [m["steps_change_lag_s"] for m in models if m["steps_change_lag_s"] is not None]
    if not lags:
        return "-"
    shift, error = (
        1.0e3 * float(np.mean([lag[key] for lag in lags])) for key in ("shift", "error")
    )
    return f"{shift:+.0f} ± {error:.0f}"


def spread(values: Sequence[float]) -> str:
    """Return mean and standard deviation [N]."""
    deviation = f" ± {np.std(values, ddof=1):.3f}" if len(values) > 1 else ""
    return f"{np.mean(values):.3f}{deviation}"


if __name__ == "__main__":
    main()
