"""Compare force networks with each other and with the ideal source on a dataset's test recordings.

Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), sections IV-A, IV-B.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_lab.force_scoring.compared_models import IDEAL, REFITTED, Compared, compare
from tendon_lab.force_scoring.sample_protocol import Experiment, experiment_of
from tendon_lab.force_scoring.scores import Score, score
from tendon_newton.actuators.networks.artifact import NetworkFile
from tendon_newton.data.dataset import Dataset
from tendon_newton.errors import InvalidDataset
from tendon_newton.identification.noise_floor import force_noise
from tendon_train.actuator.samples.folds import usable


@dataclass(frozen=True, kw_only=True)
class Result:
    """Errors of one model on one experiment."""

    model: str
    family: str
    experiment: Experiment
    score: Score


@dataclass(frozen=True, kw_only=True)
class FamilyResult:
    """Networks that differ in the seed alone, on one experiment."""

    family: str
    rmse: float  # Mean over the seeds [N]
    rmse_spread: float  # Standard deviation over the seeds [N]; zero for one
    error_spread: float
    """Standard deviation of the absolute error over rows, mean over the seeds [N]."""
    count: int  # Number of seeds


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Everything that was found."""

    models: tuple[Compared, ...]
    results: tuple[Result, ...]  # Results of every model on every experiment
    pooled: dict[str, Score]  # Score of every model over all rows of all test recordings
    noise_floor: float | None
    """Standard deviation of the load cell's noise [N], estimated from the test recordings."""

    @property
    def families(self) -> tuple[str, ...]:
        """Families in the order in which they came."""
        return tuple(dict.fromkeys(model.family for model in self.models))

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """Experiments in the order in which they came."""
        return tuple(dict.fromkeys(result.experiment for result in self.results))

    @property
    def step_experiments(self) -> tuple[Experiment, ...]:
        """The paper's step trajectories, by bench and hold."""
        steps = [e for e in self.experiments if e.hold is not None]
        return tuple(sorted(steps, key=lambda e: (e.bench, e.hold)))

    @property
    def better_ideal(self) -> str:
        """The ideal source that a network has to win against."""
        known = [name for name in (IDEAL, REFITTED) if name in self.pooled]
        return min(known, key=lambda name: self.pooled[name].rmse)

    def family_result(self, family: str, experiment: Experiment) -> FamilyResult:
        """Return how the networks of a family did on an experiment."""
        own = [r for r in self.results if r.family == family and r.experiment == experiment]
        rmse = np.array([r.score.rmse for r in own])
        return FamilyResult(
            family=family,
            rmse=float(rmse.mean()),
            rmse_spread=float(rmse.std(ddof=1)) if rmse.size > 1 else 0.0,
            error_spread=float(np.mean([r.score.error_spread for r in own])),
            count=rmse.size,
        )

    def step_rmse(self, model: str) -> float | None:
        """Return a model's mean over the step experiments [N]: the paper's headline."""
        steps = set(self.step_experiments)
        own = [r.score.rmse for r in self.results if r.model == model and r.experiment in steps]
        return float(np.mean(own)) if own else None


def evaluate(networks: Sequence[NetworkFile], dataset: Dataset) -> Evaluation:
    """Measure networks and the ideal source on the test recordings.

    Raises:
        InvalidDataset: There is no test recording with command and force.
        InvalidNetworkFile: A network has been trained on a test recording.
    """
    recordings = usable(dataset.test)
    if not recordings:
        raise InvalidDataset(
            f"{dataset.path}: an evaluation needs test recordings with theta_d and force of a "
            f"bench with a tendon; none of {len(dataset.test)} test recordings is one"
        )
    models = compare(networks, dataset, recordings)
    return Evaluation(
        models=models,
        results=tuple(result for model in models for result in results_of(model)),
        pooled={model.name: score(model.predictions) for model in models},
        noise_floor=force_noise(recordings),
    )


def results_of(model: Compared) -> list[Result]:
    """Score a model on every experiment; recordings of one experiment are pooled."""
    results = []
    by_experiment: dict[Experiment, list] = {}
    for prediction in model.predictions:
        by_experiment.setdefault(experiment_of(prediction.recording), []).append(prediction)
    for experiment, predictions in by_experiment.items():
        results.append(
            Result(
                model=model.name,
                family=model.family,
                experiment=experiment,
                score=score(predictions),
            )
        )
    return results
