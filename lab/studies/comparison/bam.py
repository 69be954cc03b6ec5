"""Rhoban/bam's models in an environment of its own, on the logs of a split.

The environment has `better-actuator-models`, `cmaes` and `matplotlib`. Simulation and models are
theirs; `bam_search` looks for their numbers until two searches agree, since `bam.fit` knows no end.
The logs are those that were published, less the rows that our import leaves out as failed reads,
and with the supply that was measured in place of a header that says something else.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.comparison.splits import Split
from tendon_newton.data.importers.imported import ImportedLog

CONTAINS: Mapping[str, tuple[str, ...]] = {
    "m1": (),
    "m2": ("m1",),
    "m3": ("m1",),
    "m4": ("m2", "m3"),
    "m5": ("m4",),
    "m6": ("m5",),
}
"""Their models, each with those that it contains: it fits its training logs no worse than they."""
STEP = "0.005"  # Step of their simulation [s]
ROUNDING = 0.05
"""What logs' last rows move the error by: a search goes as far as the shortest log [mrad]."""
SEARCH = Path(__file__).with_name("bam_search.py")


def fit(
    split: Split, model: str, python: Path, seconds: float, contained: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Fit one of their models to a split's training logs and test it.

    Args:
        split: Logs.
        model: A key of ``CONTAINS``.
        python: Interpreter of their environment.
        seconds: Time after which a search ends that has not converged.
        contained: Rows of the models that it contains, as this function returned them.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for part, logs in (("train", split.train), ("test", split.test)):
            write_logs(logs, place / f"raw_{part}")
            (place / part).mkdir()
            words = ("bam.process", "--raw", place / f"raw_{part}", "--logdir", place / part)
            run(python, "-m", *words, "--dt", STEP)
        starts = [place / f"start_{k}.json" for k in range(len(contained))]
        for path, row in zip(starts, contained, strict=True):
            path.write_text(json.dumps(row["found"]))
        params, out = place / "params", place / "found.json"
        params.mkdir()
        begun = time.monotonic()
        run(
            python, "-P", SEARCH, "--logdir", place / "train", "--actuator", split.servo,
            "--model", model, "--out", out, "--seconds", seconds, "--known", *starts,
        )  # fmt: skip
        took, search = time.monotonic() - begun, json.loads(out.read_text())
        described = {"model": model, "actuator": split.servo, **search["found"]}
        (params / f"{model}.json").write_text(json.dumps(described))
        trained = tested(python, params, place / "train", model)
        least = min((row["trained"] for row in contained), default=trained)
        assert trained <= least + ROUNDING, f"{model} contains a model that fits better"
        return {
            "held_out": tested(python, params, place / "test", model),
            "trained": trained,
            "numbers": len(search["found"]),
            "seconds": took,
            "says": f"{search['trials']} trials in {search['searches']} searches"
            + ("" if search["converged"] else ", not converged"),
            "found": search["found"],
        }


def tested(python: Path, params: Path, logs: Path, model: str) -> float:
    """Return what a fitted model leaves on some logs, by their program [mrad]."""
    out = logs / ".." / "found.json"
    run(python, "-m", "bam.mae", "--params", params, "--logdir", logs, "--json", out)
    return 1e3 * float(json.loads(out.read_text())[model]["mean"])


def run(python: Path, *words: object) -> None:
    """Run something in their environment."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    environment.pop("PYTHONPATH", None)
    done = subprocess.run(
        [str(python), *map(str, words)], env=environment, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"{words[1]} failed:\n{done.stderr[-2000:]}")


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
