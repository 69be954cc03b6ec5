"""Let policies turn the balls of virtual hands: what each makes of servos that it has not seen.

``python -m lab.studies.turning_hands nominal=a/policy.onnx diagnosed=b/policy.onnx`` deploys
each policy on ten virtual hands, half a minute each, and asks for 1 rad/s, or another ``--rate``.
Some two minutes a policy on one core. Rows of other policies stay in the file of results.

``python -m lab.studies.turning_hands sheet=a diagnosed=b --rate 1.5`` does so with the policies of
each seed that `turning_seeds` has written into two folders, and compares them, paired by seed and
by hand. What the file has already is not done again.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import tempfile
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_rel

from lab.benchmarks.timing import circumstances
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.turning_report import log_figures
from tendon_newton.cli import main as tendon_newton
from tendon_newton.data.cards.turning_task import TurningTask
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.turning_figures import TurningFigures

Array = NDArray[np.float64]
Results = dict[str, Any]  # Name of a policy -> how it was deployed, and a row of each hand
RESULTS = Path("lab/benchmarks/results/turning_hands.json")
LEVEL = 0.05  # Greatest p of a difference that counts


def main() -> None:
    """Deploy each policy on each hand, write the figures, and print what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policies", nargs="+", metavar="NAME=POLICY.onnx|FOLDER")
    parser.add_argument("--units", nargs="+", type=int, default=list(range(10)))
    parser.add_argument("--rate", type=float, default=1.0, help="asked for [rad/s]")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--results", type=Path, default=RESULTS)
    words = parser.parse_args()
    named = (word.partition("=") for word in words.policies)
    arms = {name: policies_of(Path(path)) for name, _, path in named}
    asked = {"rate_rad_per_s": words.rate, "seconds": words.seconds}
    for seed in sorted({seed for policies in arms.values() for seed in policies}):
        for arm, policies in arms.items():
            if seed in policies:
                deploy(arm + seed, policies[seed], words.units, asked, words.results)
    known = read(words.results)
    for arm, policies in arms.items():
        print(told([known[arm + seed] for seed in policies], arm, words.rate))
    for first, second in combinations(arms, 2):
        seeds = sorted(arms[first].keys() & arms[second].keys())
        if len(seeds) > 1 and len(words.units) > 1:
            pairs = [[misses(known[arm + seed]) for seed in seeds] for arm in (first, second)]
            print(f"{second} beside {first}: {compared(*map(np.array, pairs))}")


def policies_of(path: Path) -> dict[str, Path]:
    """Return the policies of a folder by what their seed adds to a name, or the one of a file."""
    if path.is_dir():
        return {file.stem.removeprefix("seed"): file for file in sorted(path.glob("seed_*.onnx"))}
    return {"": path}


def deploy(
    name: str, policy: Path, units: list[int], asked: dict[str, float], results: Path
) -> None:
    """Deploy a policy on virtual hands and write its rows, unless they are there."""
    same = {**asked, "policy": content_hash(policy.read_bytes())}
    before = read(results).get(name, {})
    if before.items() >= same.items() and [row["unit"] for row in before["hands"]] == units:
        return
    rows = []
    for unit in units:
        figures = turned_by(policy, unit, asked["rate_rad_per_s"], asked["seconds"])
        rows.append(row_of(unit, figures))
        print(f"{name} on hand {unit}: {figures.text}", flush=True)
    command = f"python -m lab.studies.turning_hands {name}={policy.name}"
    kept = {**read(results), name: {**circumstances(command), **same, "hands": rows}}
    lines = (f"{json.dumps(n)}: {json.dumps(each)}" for n, each in kept.items())
    results.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def read(results: Path) -> Results:
    """Return the rows that are known."""
    return json.loads(results.read_text(encoding="utf-8")) if results.exists() else {}


def turned_by(policy: Path, unit: int, rate: float, seconds: float) -> TurningFigures:
    """Deploy a policy on a virtual hand, and return what the ball did.

    After a stop it does nothing for the rest of the time.
    """
    task = load_policy(policy).card.turning
    assert isinstance(task, TurningTask)
    with tempfile.TemporaryDirectory() as folder:
        words = ["deploy", "--policy", str(policy), "--port", f"virtual:{task.asset}:{unit}"]
        words += ["--goals", str(rate), "--duration", str(seconds), "--faster-than-real-time"]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            code = tendon_newton([*words, "--out", folder])
        (log,) = Path(folder).glob("*.mcap")
        figures = log_figures(log, task)
        return replace(figures, seconds=seconds) if code else figures


def row_of(unit: int, figures: TurningFigures) -> dict[str, float]:
    """Return the figures of a hand as a row of the table."""
    return {
        "unit": unit,
        "turned_rad_per_min": round(figures.turned_per_minute, 1),
        "drops_per_min": round(figures.drops_per_minute, 2),
        "largest_tension_n": round(figures.largest_tension, 1),
    }


def told(found: list[Results], name: str, rate: float) -> str:
    """Return what policies come to, of one seed or of several: the range is that of hands."""
    rows = [each["hands"] for each in found]
    turned = np.array([[row["turned_rad_per_min"] for row in hands] for hands in rows])
    drops = np.mean([[row["drops_per_min"] for row in hands] for hands in rows])
    off, hands = np.mean(np.abs(turned - 60.0 * rate)), turned.mean(axis=0)
    return (
        f"{name}: {hands.mean():.1f} rad/min, {hands.min():.1f} to {hands.max():.1f}, off by "
        f"{off:.1f}; {drops:.2f} drops/min"
    )


def misses(found: Results) -> list[float]:
    """Return how far a policy is from the rate that it is asked for, hand by hand [rad/min]."""
    asked = 60.0 * found["rate_rad_per_s"]
    return [abs(row["turned_rad_per_min"] - asked) for row in found["hands"]]


def compared(first: Array, second: Array) -> str:
    """Return what policies miss beside others: a difference counts for new seeds and new hands.

    The rows of one seed are not independent, nor those of one hand. So each seed's mean over its
    hands is paired with the other's, and each hand's mean over the seeds; the greater p counts.

    Args:
        first: Misses of each seed on each hand [rad/min], shape (seeds, hands).
        second: Those of the same seeds on the same hands of what is compared.
    """
    ways = {"seeds": 1, "hands": 0}
    chances = {
        name: float(ttest_rel(second.mean(axis), first.mean(axis)).pvalue)
        for name, axis in ways.items()
    }
    by = ", ".join(f"{p:.2g} by {name}" for name, p in chances.items())
    verdict = "significant" if max(chances.values()) < LEVEL else "no difference that counts"
    return (
        f"misses {second.mean():.1f} of {first.mean():.1f} rad/min, "
        f"{second.mean() / first.mean():.2f} of it; p = {by}: {verdict}"
    )


if __name__ == "__main__":
    main()
