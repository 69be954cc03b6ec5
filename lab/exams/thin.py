"""An exam once more with less data: ``python -m lab.exams.thin EXAM OUT --share 0.5``.

Keeps a share of the training recordings of every dataset, at least one of every bench, and all
test recordings.
"""

import argparse
import shutil
from collections.abc import Sequence
from pathlib import Path

from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.recording import Recording


def thin(recordings: Sequence[Recording], share: float) -> list[Recording]:
    """Return the first recordings of each bench, a share of them."""
    kept = []
    for bench in dict.fromkeys(recording.bench for recording in recordings):
        own = [recording for recording in recordings if recording.bench == bench]
        kept += own[: max(1, round(share * len(own)))]
    return kept


def main() -> None:
    """Thin an exam from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("exam", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--share", type=float, required=True, help="of the recordings kept [1]")
    parser.add_argument("--only", nargs="+", default=None, help="names of datasets")
    arguments = parser.parse_args()
    for folder in sorted(path.parent for path in arguments.exam.glob("*/dataset.toml")):
        if arguments.only and folder.name not in arguments.only:
            continue
        dataset = load_dataset(folder)
        out = arguments.out / folder.name
        write_dataset(out, thin(dataset.train, arguments.share), dataset.test)
        shutil.copy(folder / "model.toml", out)
        (arguments.out / "truth").mkdir(exist_ok=True)
        truth = Path("truth") / f"{folder.name}.json"
        shutil.copy(arguments.exam / truth, arguments.out / truth)


if __name__ == "__main__":
    main()
