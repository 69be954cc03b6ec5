"""What two choices that were made with errors in sight change on logs that they were not made on.

``python -m lab.studies.comparison.settings --xl330 LOGS --sts3215 LOGS --price 0.05`` diagnoses the
different fits of these servos, and with ``--so101 LOGS`` those of an arm's joints, at another price
of a number than `PRICE`. ``--in-sight`` gives each diagnosis the plain model that was chosen with
errors of the XL330's logs in sight. What is in ``settings.json`` is not made again.
"""

import argparse
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from statistics import mean
from typing import Any

from lab.results.cells import table as as_table
from lab.studies.comparison.rows import IN_SIGHT, alike, diagnosed, keep, results_in, wanted
from lab.studies.comparison.splits import splits_of
from lab.studies.comparison.table import ARM, OURS, Results
from tendon_newton.diagnosis import diagnose
from tendon_newton.diagnosis.search.decide.plain_models import PLAIN_MODELS
from tendon_newton.diagnosis.search.rule import PRICE

RESULTS = Path(__file__).with_name("settings.json")
GIVEN = "as it is, given the plain model that was chosen in sight"


def at_price(price: float) -> str:
    """Say a price."""
    return f"a price of {price:g} nat"


def main() -> None:
    """Diagnose what waits by one setting."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--xl330", type=Path)
    parser.add_argument("--sts3215", type=Path)
    parser.add_argument("--so101", type=Path)
    parser.add_argument("--price", type=float, default=PRICE, help="of a number [nat per row]")
    parser.add_argument("--in-sight", action="store_true", help="give it the model chosen in sight")
    parser.add_argument("--results", type=Path, default=RESULTS, help="where they are kept")
    parser.add_argument("--split", action="append", help="splits that are made: all by default")
    chosen = parser.parse_args()
    setting = GIVEN if chosen.in_sight else at_price(chosen.price)
    if chosen.in_sight:
        PLAIN_MODELS.update(IN_SIGHT)
    find_causes: Any = diagnose.find_causes
    diagnose.find_causes = partial(find_causes, price=chosen.price)
    every = splits_of(chosen.xl330, chosen.sts3215, chosen.so101)
    for place, split in enumerate(every):
        again = set(alike(split, every)) & {other.key for other in every[:place]}
        kept = results_in(chosen.results).get(split.key, {})
        if again or setting in kept or not wanted(split.key, chosen.split):
            continue
        row = diagnosed(split)
        keep(chosen.results, split, setting, row)
        print(f"{split.key}, {setting}: {row['held_out']:.1f} mrad; {row['says']}", flush=True)


def table(settings: Results, results: Results) -> str:
    """Return held-out errors of each setting beside those of the comparison, on the same fits."""
    keys = [key for key in settings if not key.startswith(ARM)]
    merged = {key: {at_price(PRICE): results[key][OURS], **settings[key]} for key in keys}
    servos = dict.fromkeys(key.split(":")[0] for key in keys)
    lines: list[list[str]] = []
    for setting in sorted(dict.fromkeys(s for rows in merged.values() for s in rows)):
        cells = [cell(merged, servo, setting) for servo in servos]
        changed = sum(names(rows[setting]) != names(rows[at_price(PRICE)])
                      for rows in merged.values() if setting in rows)  # fmt: skip
        made = sum(setting in rows for rows in merged.values())
        lines.append([setting, *cells, f"{changed} of {made}"])
    heads = ("setting", *(f"{servo.upper()}: mean (range)" for servo in servos), "other causes")
    return as_table(heads, lines)


def cell(merged: Results, servo: str, setting: str) -> str:
    """Return the held-out errors of a servo's fits by one setting."""
    left = [rows[setting]["held_out"] for key, rows in merged.items()
            if key.startswith(f"{servo}:") and setting in rows]  # fmt: skip
    if not left:
        return "waits"
    return f"{mean(left):.1f} ({min(left):.1f} to {max(left):.1f}), {len(left)} fits"


def names(row: Mapping[str, Any]) -> frozenset[str]:
    """Return the causes that an answer names."""
    return frozenset(row["named"])


if __name__ == "__main__":
    main()
