"""CPU time of one substep in the kernel of a search, the whole catalogue in it.

    python -m lab.benchmarks.substep DATASET [EFFECT.NUMBER=VALUE,... ...]

The recordings are those on which a search chooses. Each word is a candidate: numbers that differ
from the model's own. The first line is of the model as it is.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.search.search_spans import beginnings
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.diagnosis.time_left import nearly_alike
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements

WORLDS, ROUNDS = 16, 3
"""Candidates that are nearly alike and simulated at once, and how often: the fastest counts."""


def nanoseconds(study: Study, numbers: dict[int, float]) -> float:
    """Return the CPU time of all cores that a substep of a candidate takes [ns]."""
    candidates = replacements(nearly_alike(study, numbers, WORLDS))
    study.residuals(*candidates)  # loads the kernels
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        study.residuals(*candidates)
        times.append(time.process_time() - start)
    substeps = WORLDS * sum(r.duration for r in study.recordings) / SEARCH_STEP
    return 1.0e9 * min(times) / substeps


def main() -> None:
    """Print a line for each candidate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("candidates", nargs="*", metavar="EFFECT.NUMBER=VALUE,...")
    chosen = parser.parse_args()
    quiet_warp()
    folder: Path = chosen.dataset
    recordings = beginnings(load_dataset(folder).train)
    model = load_model(folder / "model.toml")
    study = Study(recordings, model, tuple(EFFECTS), time_step=SEARCH_STEP, in_segments=True)
    columns = {f"{owner}.{number.name}": c for c, (owner, number) in enumerate(study.table.owners)}
    for word in ["", *chosen.candidates]:
        pairs = [pair.split("=") for pair in word.split(",") if pair]
        taken = nanoseconds(study, {columns[name]: float(value) for name, value in pairs})
        sys.stdout.write(f"{taken:6.0f} ns  {word or 'the model as it is'}\n")


if __name__ == "__main__":
    main()
