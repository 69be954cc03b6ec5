"""Rhoban/bam's own program, in an environment of its own, on the logs of a split.

The environment has `better-actuator-models`, `optuna<4.4`, `cmaes`, `matplotlib` and `wandb`.
Later versions of `optuna` ignore the restarts that their program asks for. The program takes the
logs as they were published, less the rows that our import leaves out as failed reads, and with the
supply that was measured in place of a header that says something else.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from examples.studies.comparison.splits import Split
from tendon_newton.data.importers.imported import ImportedLog

MODELS = ("m1", "m2", "m3", "m4", "m5", "m6")
STEP = "0.005"
"""Step of their simulation [s]."""
WITHOUT_NUMBERS = ("model", "actuator")


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """One of their models, fitted and tested."""

    held_out: float
    """Mean absolute error on the test logs [mrad]."""
    trained: float
    """Mean absolute error on the training logs [mrad]."""
    numbers: int
    seconds: float


def fit(split: Split, model: str, python: Path, trials: int) -> Fitted:
    """Fit one of their models to a split's training logs and test it."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for part, logs in (("train", split.train), ("test", split.test)):
            write_logs(logs, place / f"raw_{part}")
            (place / part).mkdir()
            words = ("bam.process", "--raw", place / f"raw_{part}", "--logdir", place / part)
            run(python, *words, "--dt", STEP)
        params = place / "params"
        params.mkdir()
        begun = time.monotonic()
        run(
            python, "bam.fit", "--logdir", place / "train", "--output", params / f"{model}.json",
            "--actuator", split.servo, "--model", model, "--trials", trials,
        )  # fmt: skip
        seconds = time.monotonic() - begun
        found = json.loads((params / f"{model}.json").read_text())
        return Fitted(
            held_out=tested(python, params, place / "test", model),
            trained=tested(python, params, place / "train", model),
            numbers=len(set(found) - set(WITHOUT_NUMBERS)),
            seconds=seconds,
        )


def tested(python: Path, params: Path, logs: Path, model: str) -> float:
    """Return what a fitted model leaves on some logs, by their program [mrad]."""
    out = logs / ".." / "found.json"
    run(python, "bam.mae", "--params", params, "--logdir", logs, "--json", out)
    return 1e3 * float(json.loads(out.read_text())[model]["mean"])


def run(python: Path, *words: object) -> None:
    """Run one of their modules."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    environment.pop("PYTHONPATH", None)
    done = subprocess.run(
        [str(python), "-m", *map(str, words)], env=environment, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"{words[0]} failed:\n{done.stderr[-2000:]}")


def write_logs(logs: Sequence[ImportedLog], folder: Path) -> None:
    """Write logs in their format."""
    folder.mkdir()
    for log in logs:
        table = json.loads(log.source.read_text())
        kept = {round(t, 9) for t in map(float, log.recording.time)}
        table["entries"] = [e for e in table["entries"] if round(e["timestamp"], 9) in kept]
        if log.recording.voltage is not None:
            table["vin"] = float(np.median(log.recording.voltage))
        (folder / log.source.name).write_text(json.dumps(table))
