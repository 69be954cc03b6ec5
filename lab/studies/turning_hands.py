"""Let policies turn the balls of virtual hands: what each makes of servos that it has not seen.

``python -m lab.studies.turning_hands nominal=a/policy.onnx diagnosed=b/policy.onnx`` deploys
each policy on ten virtual hands, half a minute each, and asks for 1 rad/s, or another ``--rate``.
Some two minutes a policy on one core. Rows of other policies stay in the file of results.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from lab.benchmarks.timing import circumstances
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.turning_report import log_figures
from tendon_newton.cli import main as tendon_newton
from tendon_newton.data.cards.turning_task import TurningTask
from tendon_newton.data.turning_figures import TurningFigures

RESULTS = Path("lab/benchmarks/results/turning_hands.json")


def main() -> None:
    """Deploy each policy on each hand, print the figures and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policies", nargs="+", metavar="NAME=POLICY.onnx")
    parser.add_argument("--units", nargs="+", type=int, default=list(range(10)))
    parser.add_argument("--rate", type=float, default=1.0, help="asked for [rad/s]")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--results", type=Path, default=RESULTS)
    words = parser.parse_args()
    for word in words.policies:
        name, _, policy = word.partition("=")
        rows = []
        for unit in words.units:
            figures = turned_by(Path(policy), unit, words.rate, words.seconds)
            rows.append(row_of(unit, figures))
            print(f"{name} on hand {unit}: {figures.text}", flush=True)
        command = f"python -m lab.studies.turning_hands {word}"
        asked = {"rate_rad_per_s": words.rate, "seconds": words.seconds}
        add(words.results, name, {**circumstances(command), **asked, "hands": rows})


def turned_by(policy: Path, unit: int, rate: float, seconds: float) -> TurningFigures:
    """Deploy a policy on a virtual hand, and return what the ball did."""
    task = load_policy(policy).card.turning
    assert isinstance(task, TurningTask)
    with tempfile.TemporaryDirectory() as folder:
        words = ["deploy", "--policy", str(policy), "--port", f"virtual:hand_ball:{unit}"]
        words += ["--goals", str(rate), "--duration", str(seconds), "--faster-than-real-time"]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            code = tendon_newton([*words, "--out", folder])
        (log,) = Path(folder).glob("*.mcap")
        if code:
            raise SystemExit(f"{policy} must drive hand {unit} to the end; deploy gave {code}")
        return log_figures(log, task)


def row_of(unit: int, figures: TurningFigures) -> dict[str, float]:
    """Return the figures of a hand as a row of the table."""
    return {
        "unit": unit,
        "turned_rad_per_min": round(figures.turned_per_minute, 1),
        "drops_per_min": round(figures.drops_per_minute, 2),
        "largest_tension_n": round(figures.largest_tension, 1),
    }


def add(path: Path, name: str, found: dict[str, Any]) -> None:
    """Write the rows of a policy beside those of others, and say what they come to."""
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    lines = (f"{json.dumps(n)}: {json.dumps(each)}" for n, each in {**known, name: found}.items())
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    turned = np.array([row["turned_rad_per_min"] for row in found["hands"]])
    drops = np.mean([row["drops_per_min"] for row in found["hands"]])
    off = np.mean(np.abs(turned - 60.0 * found["rate_rad_per_s"]))
    print(
        f"{name}: {turned.mean():.1f} rad/min, {turned.min():.1f} to {turned.max():.1f}, off by "
        f"{off:.1f}; {drops:.2f} drops/min",
        flush=True,
    )


if __name__ == "__main__":
    main()
