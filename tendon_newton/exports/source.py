"""What is exported: a model or a diagnosis, a bench, and the commands to replay."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

from tendon_newton.actuators import find_actuator
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnosed_bench import bench_for, open_model
from tendon_newton.errors import InvalidModelFile, InvalidParameter
from tendon_newton.exports.departure import sines, standard_runs
from tendon_newton.identification.cutting import first_part
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of

FINGER = "finger"  # Bench where no user, dataset or diagnosis names one


@dataclass(frozen=True, kw_only=True)
class Source:
    """A model on its bench, with commands."""

    model: Model
    mechanism: Mechanism  # With the model's own numbers
    runs: Sequence[Recording]  # Recordings with commands
    sines: Mapping[str, Recording]  # Commands of some frequencies, by name


def read_source(
    model: Path, bench: str | None, dataset: Path | None, seconds: float = inf
) -> Source:
    """Read what a user names.

    Args:
        model: Model file, a diagnosis (its folder or its diagnosis.json), or a known servo.
        bench: Name of the bench, None where dataset or diagnosis say it.
        dataset: Recordings with the commands to replay, None for the standard ones.
        seconds: Time of the dataset's commands that is taken [s].

    Raises:
        InvalidParameter: The dataset or the diagnosis has several benches, the one has no commands,
            or the two are of different benches.
        InvalidModelFile: The model takes its angle as given.
        TendonNewtonError: A file is damaged or missing.
    """
    if not seconds > 0.0:
        raise InvalidParameter(f"--seconds must be above 0; it is {seconds:g}")
    recordings: list[Recording] = []
    if dataset is not None:
        found = load_dataset(dataset, require_train=False, require_test=False)
        recordings = [run for run in (*found.train, *found.test) if run.command is not None]
    benches = sorted({run.bench for run in recordings})
    if bench is None and len(benches) > 1:
        raise InvalidParameter(
            f"--bench must name one of the dataset's benches: {', '.join(benches)}"
        )
    name = bench_for(model, bench or next(iter(benches), None), FINGER)
    read = open_model(model, [load_mechanism(name)])
    if find_actuator(read.actuator.name).leads:
        raise InvalidModelFile(
            f"{model}: {read.actuator.name!r} takes the angle as given, and there is no servo to "
            "carry: put its frictions into the model of one that follows commands"
        )
    mechanism = bench_of(name, read)
    runs = [run for run in recordings if run.bench == name]
    if dataset is not None and not runs:
        raise InvalidParameter(f"{dataset} must hold commands of the bench {name}; it has none")
    radius = spool_radius_of(read)
    return Source(
        model=read.on_bench(name),
        mechanism=mechanism,
        runs=first_part(runs, seconds) or standard_runs(mechanism, radius),
        sines=sines(mechanism, radius),
    )
