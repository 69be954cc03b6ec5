"""False names against the price of a cause.

``python -m lab.exams.calibrate SETS --out DIR``.

Every set of an exam is searched with a low price. What each cause that is named there is worth, on
all rows and on parts left out, says at which prices it would go; the truth says whether it should.
Writes DIR/worths.json and the table DIR/calibration.txt.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.scheduler import JobOptions, open_executor

LOW = 0.03  # Price of the searches [nat per row and number]
PRICES = (0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0)  # Prices of the table


def worths_of(sets: Path, price: float, name: str) -> list[dict[str, Any]]:
    """Return every cause that a search with a low price names, with what each number is worth."""
    from tendon_newton.data.dataset import load_dataset
    from tendon_newton.data.model_file import load_model
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.diagnosis.search.decide.account import HELD_OUT, LOSS
    from tendon_newton.diagnosis.search.decide.find_causes import find_causes
    from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
    from tendon_newton.effects import EFFECTS, find_effect
    from tendon_newton.identification.study import Study
    from tendon_newton.identification.testable import testable_effects

    quiet_warp()
    truth = json.loads((sets / "truth" / f"{name}.json").read_text(encoding="utf-8"))
    right = {e["name"] for e in truth["effects"]}
    right |= {name for cause in truth["outside"] for name in cause["near"]}
    recordings, model = load_dataset(sets / name).train, load_model(sets / name / "model.toml")
    study = Study(recordings, model, tuple(EFFECTS), time_step=SEARCH_STEP, in_segments=True)
    names = testable_effects(study)
    found = find_causes(recordings, study, model, names, price=price)
    out = []
    for cause, criteria in found.criteria.items():
        values = {c.name: c.value for c in criteria}
        rivals = {other for other, _ in found.classes.get(cause, ())}
        worth = min(values[LOSS], values[HELD_OUT]) / len(find_effect(cause).parameters)
        true = bool(right & {cause, *rivals})
        out.append({"set": name, "cause": cause, "worth": worth, "true": true})
    return out


def table(worths: Sequence[dict[str, Any]], sets: int) -> Iterator[str]:
    """Say for each price how many names would stay, right and wrong ones."""
    yield f"{'price':>7s} {'false names per set':>20s} {'true names left':>16s}"
    true = np.array([w["worth"] for w in worths if w["true"]])
    false = np.array([w["worth"] for w in worths if not w["true"]])
    for price in PRICES:
        kept = float(np.mean(true >= price)) if true.size else 1.0
        yield f"{price:7.2f} {float(np.sum(false >= price)) / sets:20.3f} {kept:16.3f}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Search all sets of an exam and print the curve."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sets", type=Path, help="made by lab.exams.draw")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--price", type=float, default=LOW)
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args(arguments)
    names = sorted(path.stem for path in (chosen.sets / "truth").glob("*.json"))
    chosen.out.mkdir(parents=True, exist_ok=True)
    worths: list[dict[str, Any]] = []
    with open_executor(JobOptions(jobs=chosen.jobs)) as pool:
        found = pool.map(partial(worths_of, chosen.sets, chosen.price), names)
        for sets, own in enumerate(found, start=1):
            worths += own
            write(worths, sets, chosen.price, chosen.out)


def write(worths: Sequence[dict[str, Any]], sets: int, price: float, out: Path) -> None:
    """Write what some sets gave; a run that breaks off leaves the curve of those before."""
    text = json.dumps({"sets": sets, "price": price, "worths": list(worths)}, indent=1)
    (out / "worths.json").write_text(text + "\n", encoding="utf-8")
    lines = "\n".join(table(worths, sets))
    (out / "calibration.txt").write_text(lines + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
