"""Time of a hand's diagnosis beside one finger's: ``python -m lab.exams.hand_alone OUT``.

OUT holds the sets that ``python -m lab.exams.hand OUT`` made. ``--sets N`` takes the first N of
them. The recordings of each set's faulty finger, else of the first one, are diagnosed as those of a
`finger_routed`, right after the hand's. Processor time of this process counts, since a machine may
have other work.
"""

import argparse
import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_lab.exam.run_exam import ANSWER, answer_one
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.servo_names import servo_of
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.identification.study import of_servo

FINGER = "finger_routed"


def main() -> None:
    """Diagnose sets and one finger of each, and print both times."""
    parser = argparse.ArgumentParser(description="Time of a hand's diagnosis beside a finger's.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--sets", type=int, default=8)
    chosen = parser.parse_args()
    folders = sorted(path.parent for path in chosen.out.glob("s*/dataset.toml"))[: chosen.sets]
    ratios = []
    for number, folder in enumerate(folders):
        finger = one_finger(folder, chosen.out / "alone" / folder.name)
        if number == 0:  # kernels are compiled, or loaded
            answer_one((finger, finger / "answer"))
        hand, alone = (spent(of, chosen.out / "alone" / "again") for of in (folder, finger))
        ratios.append(hand / alone)
        say(f"{folder.name}: hand {hand:.0f} s, finger {alone:.0f} s")
    say(f"hand over finger, median: {np.median(ratios):.2f}; longest: {max(ratios):.2f}")


def one_finger(folder: Path, out: Path) -> Path:
    """Write the recordings of one finger of a hand's set, with its starting model."""
    named = [servo_of(cause.name) for cause in read_diagnosis(folder / "answer" / ANSWER).effects]
    servo = next((own for own in named if own is not None), 0)
    data = load_dataset(folder)
    parts = (
        [replace(of_servo(r, servo), name=r.name, bench=FINGER) for r in part]
        for part in (data.train, data.test)
    )
    write_dataset(out, *parts)
    shutil.copy(folder / "model.toml", out)
    return out


def spent(folder: Path, answer: Path) -> float:
    """Return the processor time of a diagnosis [s]."""
    start = time.process_time()
    answer_one((folder, answer))
    return time.process_time() - start


def say(text: str) -> None:
    """Print a line as soon as it is known."""
    print(text, flush=True)  # noqa: T201 - what it is for


if __name__ == "__main__":
    main()
