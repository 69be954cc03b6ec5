"""Real SO-101 logs: every pair of training motions at fixed settings, ``... so101_pairs LOGS``.

Which two motions a joint's causes are found on is not chosen here: each pair in which the joint
moves is taken in turn, with the same catalogue and the same gates, and tested on all other motions.
Rows in which something solid holds the shaft tell of no servo: the errors are given with and
without them. Every pair that is finished stands in ``--out``; a run that was stopped goes on where
it was.
"""

import argparse
import json
import tempfile
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from examples.studies.so101 import MOVED, split
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.importers.so101 import read_so101
from tendon_newton.diagnosis.diagnose import Evidence, diagnose
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.identification.study import replacements

TARGETS = {"Rotation": 0.75, "Wrist_Roll": 0.70}
"""Share of the RMS error [1] that should go, by joint."""


@dataclass(frozen=True, kw_only=True)
class PairResult:
    """What one pair of training motions led to."""

    joint: str
    train: tuple[str, str]
    verdict: str
    before: float
    """RMS error on all other motions of a servo that is where it was told to be [rad]."""
    after: float
    """The same of the diagnosed servo [rad]."""
    free_before: float
    """As `before`, without the rows in which something solid holds the shaft [rad]."""
    free_after: float
    """The same of the diagnosed servo [rad]."""
    causes: str
    """Named causes with their numbers, in words."""

    @property
    def reduction(self) -> float:
        """Share of the RMS error that went where the shaft was free [1]."""
        return 1.0 - self.free_after / self.free_before


def main() -> None:
    """Diagnose on each pair that is not done yet, then print all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("--joint", action="append", help="joints: those with a target by default")
    parser.add_argument("--out", type=Path, default=Path("so101_pairs.jsonl"))
    arguments = parser.parse_args()
    imported = read_so101(arguments.logs)
    joints = arguments.joint or list(TARGETS)
    done = read_results(arguments.out)
    for joint in joints:
        logs = [log for log in imported.logs if log.conditions["joint"] == joint]
        for pair in combinations(moving(logs), 2):
            if (joint, pair) not in done:
                result = one_pair(imported, joint, logs, pair)
                done[joint, pair] = result
                with arguments.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(result)) + "\n")
    for joint in joints:
        report(joint, [result for (name, _), result in done.items() if name == joint])


def moving(logs: list[ImportedLog]) -> list[str]:
    """Return the motions in which a joint is told to move."""
    commands = {str(log.conditions["motion"]): log.recording.command for log in logs}
    return [
        motion
        for motion, command in commands.items()
        if command is not None and np.ptp(command) > MOVED
    ]


def one_pair(
    imported: Imported, joint: str, logs: list[ImportedLog], pair: tuple[str, str]
) -> PairResult:
    """Diagnose a joint on two of its motions."""
    with tempfile.TemporaryDirectory() as folder:
        diagnosis, evidence = diagnose(split(Path(folder), logs, pair), imported.model)
    free_before, free_after = free_errors(evidence)
    return PairResult(
        joint=joint,
        train=pair,
        verdict=diagnosis.verdict,
        before=diagnosis.baseline.theta_rmse,
        after=diagnosis.extended.theta_rmse,
        free_before=free_before,
        free_after=free_after,
        causes=causes(diagnosis),
    )


def free_errors(evidence: Evidence) -> tuple[float, float]:
    """Return both models' RMS errors [rad] over the held-out rows in which the shaft is free."""
    models = replacements([evidence.baseline, evidence.extended])
    residuals = evidence.test.residuals(*models)
    squares = np.concatenate([r.theta[:, r.trusted] ** 2 for r in residuals], axis=1)
    before, after = np.sqrt(squares.mean(axis=1))
    return float(before), float(after)


def causes(diagnosis: Diagnosis) -> str:
    """Return the named causes in words."""
    return ", ".join(
        " ".join([effect.name, *(f"{e.value:.3g} {e.unit}" for e in effect.parameters.values())])
        for effect in diagnosis.effects
    )


def read_results(path: Path) -> dict[tuple[str, tuple[str, str]], PairResult]:
    """Read the pairs that an earlier run finished."""
    if not path.exists():
        return {}
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    results = [PairResult(**{**row, "train": tuple(row["train"])}) for row in rows]
    return {(result.joint, result.train): result for result in results}


def report(joint: str, results: list[PairResult]) -> None:
    """Print the pairs of one joint, best first."""
    shares = np.array([result.reduction for result in results])
    target = TARGETS.get(joint)
    reached = "" if target is None else f"; {np.mean(shares >= target):.0%} reach {target:.0%}"
    print(f"\n{joint}: {len(shares)} pairs, median {np.median(shares):.0%} less RMS{reached}")
    for result in sorted(results, key=lambda result: -result.reduction):
        free, whole = (
            f"{1e3 * before:5.1f} -> {1e3 * after:4.1f}"
            for before, after in (
                (result.free_before, result.free_after),
                (result.before, result.after),
            )
        )
        print(
            f"  {result.reduction:4.0%}  {free} mrad ({whole} over all rows)  "
            f"{' + '.join(result.train):45s} {result.causes}"
        )


if __name__ == "__main__":
    main()
