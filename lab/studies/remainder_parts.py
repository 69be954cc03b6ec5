"""Would a learned part gain where conditions are left out whole? Answers held against their rest.

``python -m lab.studies.remainder_parts answer DATASET ANSWER``
``python -m lab.studies.remainder_parts so101 LOGS --only elbow``
``python -m lab.studies.remainder_parts sts3215 LOGS --only gains``

What a model leaves of its training recordings is learned, on each side of the load cell: by a ridge
regression on cosines, and by a formula of a few terms. A part is kept where it predicts each
training fold from the others. The row says which share of the rest's squared size it predicts
there, and of the test recordings, whose conditions no training recording has. Nothing answers to
what is predicted: in a simulation a part does less.
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from lab.studies.so101 import joints, split, training_motions
from lab.studies.sts3215 import LOADED, SPLITS, fitted, model_of, study_of
from tendon_lab.foreign_logs.bam import read_bam
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.data.recording import Array, Mask
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.diagnose import diagnose, extended_model
from tendon_newton.diagnosis.unexplained.equation import library, pursue, solve, table_of
from tendon_newton.diagnosis.unexplained.learner import RIDGES, Basis, fit_ridges
from tendon_newton.diagnosis.unexplained.remainder import find_remainders
from tendon_newton.diagnosis.unexplained.remainder_structure import SEED, make_folds, thinned
from tendon_newton.identification.study import Study

TIME_STEP = 5.0e-4  # Step of the simulations [s], as a diagnosis has it
PACES = ("force_change", "theta_d_change", "time_since_reversal")
"""Signals that a formula may hold beside tension, speed and direction."""
Case = tuple[str, Dataset, Model]
Signals = Mapping[str, Array]


@dataclass(frozen=True, kw_only=True)
class Part:
    """A learned part of one side, and which share of the rest it predicts."""

    name: str
    side: str
    learner: str
    size: float  # Root mean square of the rest of the test recordings [N or rad]
    kept: bool  # Whether it predicts each training fold from the others
    trained: float
    """Share of the squared rest of training recordings that were left out in turn [1]."""
    tested: float  # Share of the squared rest of the test recordings [1]


def parts_of(name: str, data: Dataset, model: Model) -> Iterator[Part]:
    """Learn the rest of the training recordings on each side, and predict that of the others."""
    effects = [effect.cause for effect in model.effects]
    seen, unseen = (
        find_remainders(Study(recordings, model, effects, time_step=TIME_STEP), {})
        for recordings in (data.train, data.test)
    )
    for own, other in zip(map(thinned, seen), unseen, strict=True):
        names = (own.signals.keys() & other.signals.keys()) - {"t"}
        signals = {name: own.signals[name] for name in sorted(names)}
        others = {name: other.signals[name] for name in sorted(names)}
        folds = make_folds(own.recording)
        for learner, learn in LEARNERS.items():
            left_out: list[Array] = []
            for fold in np.unique(folds):
                out = folds == fold
                told = learn(rows(signals, ~out), own.residual[~out], rows(signals, out))
                left_out.append(squares(own.residual[out], told))
            before, *left = np.sum(left_out, axis=0)
            taken = 1.0 - np.array(left) / before
            best = int(np.argmax(taken))
            after = squares(other.residual, learn(signals, own.residual, others))
            yield Part(
                name=name,
                side=own.side,
                learner=learner,
                size=other.size,
                kept=all(each[1 + best] < each[0] for each in left_out),
                trained=float(taken[best]),
                tested=1.0 - float(after[1 + best] / after[0]),
            )


def rows(signals: Signals, there: Mask) -> Signals:
    """Return some rows of all signals."""
    return {name: x[there] for name, x in signals.items()}


def flexible(signals: Signals, rest: Array, others: Signals) -> list[Array]:
    """Return what ridge regressions on cosines of some signals say of other rows."""
    basis = Basis(signals, np.random.default_rng(SEED))
    fits = fit_ridges(basis.features(signals), rest[:, None], RIDGES)
    features = basis.features(others)
    limit = np.abs(rest).max()
    return [np.clip(features @ w + offset, -limit, limit)[:, 0] for w, offset in fits]


def sparse(signals: Signals, rest: Array, others: Signals) -> list[Array]:
    """Return what a formula of a few terms says of other rows."""
    atoms, there = (library(each, PACES) for each in (signals, others))
    chosen = pursue(atoms, rest)
    weights = solve([atoms[k] for k in chosen], rest)
    told = table_of([there[k] for k in chosen], len(next(iter(others.values())))) @ weights
    limit = np.abs(rest).max()
    return [np.clip(told, -limit, limit)]


LEARNERS: dict[str, Callable[[Signals, Array, Signals], list[Array]]] = {
    "cosines": flexible,
    "formula": sparse,
}


def squares(rest: Array, told: Sequence[Array]) -> Array:
    """Return a rest's squared size, and that of what each prediction leaves, shape (1 + N,)."""
    return np.array([np.sum((rest - each) ** 2) for each in (np.zeros_like(rest), *told)])


def answers(folders: Sequence[Path]) -> Iterator[Case]:
    """Return a dataset with the model of its answer."""
    data, answer = folders
    yield str(data), load_dataset(data), load_model(answer / "model.toml")


def arm_joints(logs: Path, only: str | None) -> Iterator[Case]:
    """Return each joint of an SO-101 with its diagnosis: trained on two motions."""
    imported = read_so101(logs)
    for joint in [only] if only else joints(imported):
        own = [log for log in imported.logs if log.conditions["joint"] == joint]
        with tempfile.TemporaryDirectory() as folder:
            data = split(Path(folder), own, training_motions(own))
            yield joint, data, diagnose(data, imported.start_model(own))[0].model


def pendulums(logs: Path, only: str | None) -> Iterator[Case]:
    """Return each split of an STS3215's logs with its model: friction by load, and a delay."""
    imported = read_bam(logs)
    first = [log for log in imported.logs if log.source.stem[-1] == "1"]
    for name in [only] if only else SPLITS:
        train = [log for log in first if SPLITS[name].train(log)]
        test = [log for log in first if not SPLITS[name].train(log)]
        model = model_of(imported.start_model(train), LOADED)
        values = fitted(train, model, LOADED)
        data = Dataset(
            path=logs,
            train=tuple(log.recording for log in train),
            test=tuple(log.recording for log in test),
        )
        yield name, data, extended_model(study_of(train, model), model, values, LOADED)


def main() -> None:
    """Print a row for each side of each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("answer", "so101", "sts3215"))
    parser.add_argument("paths", type=Path, nargs="+")
    parser.add_argument("--only")
    a = parser.parse_args()
    quiet_warp()
    if a.kind == "answer":
        cases = answers(a.paths)
    else:
        cases = {"so101": arm_joints, "sts3215": pendulums}[a.kind](a.paths[0], a.only)
    for case in cases:
        for part in parts_of(*case):
            print(json.dumps(asdict(part)), flush=True)


if __name__ == "__main__":
    main()
