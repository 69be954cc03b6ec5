"""Real SO-101 logs: every pair of training motions at fixed settings, ``... so101_pairs LOGS``.

Which two motions a joint's causes are found on is not chosen here: each pair in which the joint
moves is taken in turn, with the same catalogue and the same gates, and tested on all other motions.
Rows in which something solid holds the shaft tell of no servo and do not count. Every pair that is
finished stands in ``--out``; a run that was stopped goes on where it was. Beside each diagnosis
stands a model that chooses nothing: lag, delay, deadband and offset, four numbers fitted to the
same two motions. ``--pairs 3 --joint Rotation --joint Pitch ...`` draws that many pairs of each
joint by a fixed seed. ``--without-register`` starts from a servo of which nothing is stated, not
even the acceleration that LeRobot writes to it.
"""

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from lab.studies.so101 import MOVED, split
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.diagnose import Evidence, diagnose
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements

FIXED = ("actuator_lag", "command_delay", "deadband", "position_offset")
"""What anyone would fit who does not choose."""
TOLD = Model(actuator=NamedValues(name="ideal_position", values={}))
"""A servo that is where it was told to be."""
SEED = 0  # Seed of the draw of pairs
TARGETS = {"Rotation": 0.75, "Wrist_Roll": 0.70}
"""Share of the RMS error [1] that should go, by joint."""


@dataclass(frozen=True, kw_only=True)
class PairResult:
    """What one pair of training motions led to."""

    joint: str
    train: tuple[str, str]
    verdict: str
    free_before: float
    """RMS error on all other motions of a servo that is where it was told to be, without the rows
    in which something solid holds the shaft [rad]."""
    free_after: float  # Error of the diagnosed servo [rad]
    fixed_after: float  # Error of lag, delay, deadband and offset, fitted to the same motions [rad]
    fixed_stated_after: float  # Error of these four behind what the start states [rad]
    worse: tuple[str, ...]
    """Held-out motions that move in which the diagnosed servo is further off than the start."""
    causes: str  # Named causes with their numbers, in words

    @property
    def reduction(self) -> float:
        """Share of the RMS error that went where the shaft was free [1]."""
        return 1.0 - self.free_after / self.free_before


def main() -> None:
    """Diagnose on each pair that is not done yet, then print all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("--joint", action="append", help="joints: those with a target by default")
    parser.add_argument("--pairs", type=int, help="pairs of each joint, drawn: all by default")
    parser.add_argument("--without-register", action="store_true", help="state no acceleration")
    parser.add_argument("--out", type=Path, default=Path("so101_pairs.jsonl"))
    arguments = parser.parse_args()
    imported = read_so101(arguments.logs)
    joints = arguments.joint or list(TARGETS)
    done = read_results(arguments.out)
    for joint in joints:
        logs = [log for log in imported.logs if log.conditions["joint"] == joint]
        for pair in drawn(list(combinations(moving(logs), 2)), arguments.pairs):
            if (joint, pair) not in done:
                start = TOLD if arguments.without_register else imported.start_model(logs)
                result = one_pair(start, joint, logs, pair)
                done[joint, pair] = result
                with arguments.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(result)) + "\n")
    for joint in joints:
        report(joint, [result for (name, _), result in done.items() if name == joint])
    pooled([result for (name, _), result in done.items() if name in joints])


def drawn(pairs: list[tuple[str, str]], count: int | None) -> list[tuple[str, str]]:
    """Return some of the pairs, drawn by a fixed seed, or all."""
    if count is None or count >= len(pairs):
        return pairs
    chosen = np.random.default_rng(SEED).choice(len(pairs), count, replace=False)
    return [pairs[i] for i in sorted(chosen)]


def moving(logs: list[ImportedLog]) -> list[str]:
    """Return the motions in which a joint is told to move."""
    commands = {str(log.conditions["motion"]): log.recording.command for log in logs}
    return [
        motion
        for motion, command in commands.items()
        if command is not None and np.ptp(command) > MOVED
    ]


def one_pair(
    start: Model, joint: str, logs: list[ImportedLog], pair: tuple[str, str]
) -> PairResult:
    """Diagnose a joint on two of its motions."""
    with tempfile.TemporaryDirectory() as folder:
        dataset = split(Path(folder), logs, pair)
        diagnosis, evidence = diagnose(dataset, start)
    train, test = (Study(part, TOLD, tuple(EFFECTS)) for part in (dataset.train, dataset.test))
    after, stated = squares(evidence.test, [evidence.extended, fixed_fit(start, evidence.train)])
    before, fixed = squares(test, [{}, fixed_fit(TOLD, train)])
    return PairResult(
        joint=joint,
        train=pair,
        verdict=diagnosis.verdict,
        free_before=pooled_rms(before),
        free_after=pooled_rms(after),
        fixed_after=pooled_rms(fixed),
        fixed_stated_after=pooled_rms(stated),
        worse=worse_motions(evidence, before, after),
        causes=causes(diagnosis),
    )


def fixed_fit(model: Model, train: Study) -> dict[int, float]:
    """Fit the model that chooses nothing to the training motions (column -> value)."""
    worlds = SearchWorlds(train)
    found = fit_set_anew(worlds, model, FIXED)
    return values_of(worlds, found.columns, found.place)


def squares(test: Study, models: Sequence[dict[int, float]]) -> list[list[Array]]:
    """Return squared errors [rad^2] by model and held-out motion, where the shaft is free."""
    residuals = test.residuals(*replacements(models))
    return [[r.theta[m, r.trusted] ** 2 for r in residuals] for m in range(len(models))]


def pooled_rms(squares: list[Array]) -> float:
    """Return the RMS error over all rows of all motions [rad]."""
    return float(np.sqrt(np.concatenate(squares).mean()))


def worse_motions(evidence: Evidence, before: list[Array], after: list[Array]) -> tuple[str, ...]:
    """Return the held-out motions that move in which one model is further off than another."""
    return tuple(
        recording.name
        for recording, old, new in zip(evidence.test.recordings, before, after, strict=True)
        if recording.command is not None
        and np.ptp(recording.command) > MOVED
        and new.mean() > old.mean()
    )


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
    results = [
        PairResult(**{**row, "train": tuple(row["train"]), "worse": tuple(row["worse"])})
        for row in rows
    ]
    return {(result.joint, result.train): result for result in results}


def report(joint: str, results: list[PairResult]) -> None:
    """Print the pairs of one joint, best first."""
    shares = np.array([result.reduction for result in results])
    target = TARGETS.get(joint)
    reached = "" if target is None else f"; {np.mean(shares >= target):.0%} reach {target:.0%}"
    print(f"\n{joint}: {len(shares)} pairs, median {np.median(shares):.0%} less RMS{reached}")
    for result in sorted(results, key=lambda result: -result.reduction):
        print(
            f"  {result.reduction:4.0%}  {1e3 * result.free_before:5.1f} -> "
            f"{1e3 * result.free_after:4.1f} mrad  "
            f"{' + '.join(result.train):45s} {result.causes}; four fixed numbers "
            f"{1e3 * result.fixed_after:.1f}"
            + (f"; worse than the start: {', '.join(result.worse)}" if result.worse else "")
        )


def pooled(results: list[PairResult]) -> None:
    """Print which share of the squared error is left, over all pairs of all joints."""
    start = np.array([result.free_before for result in results]) ** 2
    for name in ("free_after", "fixed_after", "fixed_stated_after"):
        left = np.array([getattr(result, name) for result in results]) ** 2
        print(
            f"{name}: {left.sum() / start.sum():.3f} of the squared error is left over "
            f"{len(results)} pairs, {np.mean(left / start):.3f} where each pair counts alike"
        )


if __name__ == "__main__":
    main()
