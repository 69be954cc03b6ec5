"""From a diagnosis to a policy: what a finger's tip misses, by what its policy was trained on.

``python -m lab.studies.diagnosed_policies --out DIR --devices cuda:0 cuda:1 --minutes 8``

Each unit of the virtual bench is recorded and diagnosed by the two commands that a newcomer types.
Policies of one recipe are trained on each of `ARMS` with each seed, and climb the paper's stairs
on their unit. Those of a data sheet know no unit and climb on all of them. Each job begins as soon
as what it reads is there: all arms of a seed before the next seed. ``table.json`` and ``table.md``
compare the posterior with each other arm, paired by unit over the seeds that both have; they are
written anew after each climb. ``jobs.jsonl`` has a line for each job. What is in DIR is not done
again, and after ``--minutes`` nothing but climbs begins.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_rel

from lab.studies.policy_transfer import climb, file_of
from lab.studies.units import timed
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.model_file import NamedValues, load_model, write_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.posterior import Posterior, read_posterior, write_posterior
from tendon_newton.scheduler import THREADS_VARIABLE, JobOptions, core_count, open_executor
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.policy.worlds.force_model import moves_finger
from tendon_train.refresh.drift import tune

Array = NDArray[np.float64]
Climb = tuple[Path, int, Path]  # Policy, unit, folder of the results
Units = Mapping[int, Mapping[int, float]]  # Unit -> seed -> tip error [mm]
Errors = dict[str, dict[int, dict[int, float]]]  # The same by arm
UNITS = tuple(range(2001, 2011))  # Units that no choice has seen
RANGES = ("joint_friction", "link_mass", "spool_radius", "joint_spring")
NEAR = ("gain_error", "spool_radius", "joint_spring")
ARMS = ("posterior", "diagnosed", "ranges", "truth", "near", "nominal", "intervals")
"""A diagnosis with its posterior, and with nothing drawn; a data sheet with the default ranges; the
unit's own causes, and drawn about them by a tenth; a data sheet with nothing drawn; a diagnosis
with the intervals of its causes each by itself."""
SHARED = ("nominal", "ranges")  # Arms that know no unit
KNOWN = ("truth", "near")  # Arms that need no diagnosis
RECIPE = PolicyTrainingConfig(
    steps=32, batch=16_384, epochs=4, iterations=100, checkpoint_every=10,
    learning_rate=1.0e-3, learning_rate_end=1.0e-4, exploration_end=0.2,
    environment=EnvironmentConfig(worlds=4096, goal_change=0.03, max_step=1.0e-3),
)  # fmt: skip
"""13.1 million steps."""
LINKS = {
    "mass": "masses", "length": "lengths", "moment_arm": "moment_arms", "stiffness": "stiffness",
    "damping": "damping", "range": "limits",
}  # fmt: skip
"""Numbers of joints and links, and what a plant's file calls them."""
OF_LINKS = ("joint_stiffness_error", "joint_damping_error", "inertia_error")
"""Effects that are the mean of those numbers."""
CLIMBS = "climbs"
HEAD = (
    "| trained on | climbs | tip error [mm]: mean of units (range) | posterior's share of it | p "
    "| p of the aim |"
)
AIMS = {"nominal": 0.5, "ranges": 0.5, "truth": 1.15, "near": 1.15}
"""Share of another arm's error that the posterior's shall stay below [1]."""


@dataclass(frozen=True, kw_only=True)
class Training:
    """One policy: what it is trained on, on which unit, and with which seed."""

    arm: str
    unit: int
    seed: int
    out: Path

    @property
    def folder(self) -> Path:
        """Where it stands; the name says what it is."""
        unit = "" if self.arm in SHARED else f"_{self.unit}"
        return self.out / "policies" / f"{self.arm}{unit}-{self.seed}"

    @property
    def policy(self) -> Path:
        """Its file."""
        return self.folder / "policy.onnx"


@dataclass(frozen=True, kw_only=True)
class Study:
    """Where everything stands, and on which units and with which seeds."""

    out: Path
    units: tuple[int, ...]
    seeds: tuple[int, ...]
    arms: tuple[str, ...]
    recipe: PolicyTrainingConfig

    @property
    def trainings(self) -> list[Training]:
        """All of them, those of the first seed first."""
        return [
            Training(arm=arm, unit=unit, seed=seed, out=self.out)
            for seed in self.seeds
            for arm in sorted(self.arms, key=(*SHARED, *ARMS).index)
            for unit in (self.units[:1] if arm in SHARED else self.units)
        ]

    def climbs(self, training: Training) -> list[Climb]:
        """Return the climbs of a policy."""
        units = self.units if training.arm in SHARED else (training.unit,)
        return [(training.policy, unit, self.out / CLIMBS) for unit in units]


def record(unit: int, out: Path) -> str:
    """Record a unit, and write its own causes."""
    recordings = out / f"recordings_{unit}"
    port = ("--port", f"virtual::{unit}:new", "--faster-than-real-time")
    words = ("collect", "--plan", "quick", *port, "--out", str(recordings))
    if not (recordings / "dataset.toml").exists():
        timed(words, out / f"collect_{unit}.log")
    quiet_warp()
    write_truth(recordings, out / f"truth_{unit}.toml")
    return f"unit {unit} is recorded"


def diagnose(unit: int, out: Path, threads: int) -> str:
    """Diagnose a unit with some threads, and write what its policies are trained on."""
    os.environ[THREADS_VARIABLE] = str(threads)
    answer = out / f"answer_{unit}"
    words = ("diagnose", str(out / f"recordings_{unit}"), "--out", str(answer))
    timed(words, out / f"diagnose_{unit}.log")
    path = answer / "intervals.json"
    write_posterior(path, by_themselves(read_posterior(answer / "diagnosis.json")))
    path.write_text((answer / "diagnosis.json").read_text())  # the last file: all is there
    return f"unit {unit} is diagnosed"


def write_truth(recordings: Path, path: Path) -> None:
    """Write a unit's own causes as a model, their numbers tuned to all runs of its finger.

    Where a plant's law is not the catalogue's, its number alone holds the finger a tenth of a
    radian elsewhere, and a policy that trains on it is no bound.
    """
    plant = tomllib.loads((recordings / "plant_finger.toml").read_text())
    model = load_model(recordings / "model.toml")
    servo = {name: plant["servo"][name] for name in ("torque_constant", "resistance")}
    own = {**model.actuator.values, **servo, "armature": plant["servo"]["inertia"],
           "supply_voltage": plant["servo"]["supply_voltage"]}  # fmt: skip
    links = {key: tuple(plant["mechanism"][name]) for key, name in LINKS.items()}
    stated = {
        row["name"]: row["parameters"]
        for row in plant["effects"]
        if "parameters" in row and moves_finger(row["name"]) and row["name"] not in OF_LINKS
    }
    effects = tuple(NamedValues(name=n, values=v) for n, v in by_direction(stated, plant).items())
    truth = replace(
        model, actuator=replace(model.actuator, values=own), effects=effects,
        bench_overrides={"finger": BenchOverrides(**links)},
    )  # fmt: skip
    dataset = load_dataset(recordings)
    runs = [run for run in (*dataset.train, *dataset.test) if run.bench == "finger"]
    write_model(path, tune(runs, truth).model)


def by_direction(
    effects: Mapping[str, Mapping[str, float]], plant: Mapping[str, Any]
) -> dict[str, Mapping[str, float]]:
    """Return effects with the dry friction that a gear pressed by its motor has either way.

    A plant's file has the mean of both, which is what a diagnosis can find; see
    `tendon_newton.data.gear_friction`. The mean alone holds a finger a tenth of a radian too far
    closed after it was let go.
    """
    share, dry = plant["servo"]["motor_load_friction"], dict(effects["stribeck_friction"])
    less = share * dry["coulomb_force"]
    dry["coulomb_force"] -= less
    dry["static_force"] -= less
    asymmetry = {"winding": 2.0 * less, "unwinding": 0.0}
    return {**effects, "stribeck_friction": dry, "asymmetric_friction": asymmetry}


def by_themselves(posterior: Posterior) -> Posterior:
    """Return the causes of the answer alone, each number in its own interval."""
    first = posterior.sets[0]
    kept = [f for f, number in enumerate(first.numbers) if number.owner in first.causes]
    own = replace(
        first,
        numbers=tuple(first.numbers[f] for f in kept),
        covariance=np.diag(np.diag(first.covariance)[kept]),
    )
    return Posterior(sets=(own,))


def inputs(training: Training) -> Path:
    """Return the file without which a training cannot begin."""
    if training.arm in SHARED:
        return training.out / f"recordings_{training.unit}" / "dataset.toml"
    if training.arm in KNOWN:
        return training.out / f"truth_{training.unit}.toml"
    return training.out / f"answer_{training.unit}" / "intervals.json"


def config_of(training: Training, recipe: PolicyTrainingConfig) -> PolicyTrainingConfig:
    """Return the settings of a training."""
    unit, out = training.unit, training.out
    sheet, answer = out / f"recordings_{unit}" / "model.toml", out / f"answer_{unit}"
    truth = out / f"truth_{unit}.toml"
    force, randomise, spread = {
        "posterior": (answer / "model.toml", (str(answer / "diagnosis.json"),), 0.3),
        "intervals": (answer / "model.toml", (str(answer / "intervals.json"),), 0.3),
        "diagnosed": (answer / "model.toml", ("none",), 0.3),
        "truth": (truth, ("none",), 0.3),
        "near": (truth, NEAR, 0.1),
        "nominal": (sheet, ("none",), 0.3),
        "ranges": (sheet, RANGES, 0.3),
    }[training.arm]
    environment = replace(recipe.environment, force=str(force), randomise=randomise, spread=spread)
    return replace(recipe, environment=environment, seed=training.seed)


def train(training: Training, recipe: PolicyTrainingConfig, device: str) -> str:
    """Train a policy on a device and write it."""
    quiet_warp()
    config = replace(config_of(training, recipe), device=device)
    training.folder.mkdir(parents=True, exist_ok=True)
    with contextlib.redirect_stdout(io.StringIO()):
        trained = train_policy(config, training.folder, report=lambda _: None)
        export_policy(training.folder, trained, config)
    return f"{training.folder.name}: {trained.points[-1].text}"


def told(work: Callable[..., str], *what: Any) -> dict[str, Any]:
    """Do a job and say how it went: one that fails ends no other."""
    start = time.monotonic()
    try:
        said, failed = work(*what), False
    except Exception as error:  # whatever it is, the other jobs go on
        said, failed = f"{work.__name__} {what[0]}: {error!r}", True
    return {"said": said, "failed": failed, "seconds": round(time.monotonic() - start, 1)}


class Running:
    """The jobs of a study, each begun as soon as what it reads is there."""

    def __init__(self, study: Study, cores: Executor, trainers: Executor, until: float) -> None:
        self._study, self._cores, self._trainers, self._until = study, cores, trainers, until
        self._begun: set[Any] = set()
        self._now: dict[Future[dict[str, Any]], str] = {}  # with the device that each has

    def begin(self, key: Any, executor: Executor, place: str, work: Callable[..., str],
              *what: Any) -> None:  # fmt: skip
        """Begin a job, unless it was begun."""
        if key not in self._begun:
            self._begun.add(key)
            self._now[executor.submit(told, work, *what)] = place

    def begin_ready(self, devices: Sequence[str], each: int) -> None:
        """Begin what can be done now: at most so many trainings on each device."""
        study = self._study
        for training in study.trainings:
            for what in study.climbs(training) if training.policy.exists() else ():
                if not file_of(*what).exists():
                    self.begin(what, self._cores, "core", climb, what)
        if time.monotonic() > self._until:
            return
        threads = max(1, core_count() // len(study.units))
        known = {*study.arms} <= {*SHARED, *KNOWN}
        for unit in study.units:
            if not (study.out / f"truth_{unit}.toml").exists():
                self.begin(("record", unit), self._cores, "core", record, unit, study.out)
            elif not (known or (study.out / f"answer_{unit}" / "intervals.json").exists()):
                what = unit, study.out, threads
                self.begin(("diagnose", unit), self._cores, "core", diagnose, *what)
        for training in study.trainings:
            count = Counter(self._now.values())
            device = min(devices, key=count.__getitem__)
            if count[device] >= each:
                return
            climbed = all(file_of(*what).exists() for what in study.climbs(training))
            if inputs(training).exists() and not (climbed or training.policy.exists()):
                work = training, study.recipe, device
                self.begin(training, self._trainers, device, train, *work)

    def next_ended(self) -> dict[str, Any] | None:
        """Wait for the next job that ends, and return how it went; none runs any more."""
        if not self._now:
            return None
        future = next(iter(wait(self._now, return_when=FIRST_COMPLETED).done))
        place = self._now.pop(future)
        return {"place": place, **future.result()}


def run(study: Study, devices: Sequence[str], each: int, until: float) -> None:
    """Do what is missing of a study, and write its table after each climb."""
    trainers = JobOptions(jobs=max(2, each * len(devices)))
    cores = JobOptions(jobs=max(2, core_count()))
    start = time.monotonic()
    with open_executor(cores) as on_cores, open_executor(trainers) as on_devices:
        running = Running(study, on_cores, on_devices, until)
        running.begin_ready(devices, each)
        while (ended := running.next_ended()) is not None:
            line = json.dumps({"at": round(time.monotonic() - start, 1), **ended})
            print(line, flush=True)
            with (study.out / "jobs.jsonl").open("a", encoding="utf-8") as lines:
                lines.write(line + "\n")
            running.begin_ready(devices, each)
            write_table(study)
    write_table(study)


def errors_of(study: Study, figure: str) -> Errors:
    """Return a number of all climbs that there are [mm]."""
    errors: Errors = {}
    for training in study.trainings:
        for what in study.climbs(training):
            if (path := file_of(*what)).exists():
                error = 1e3 * float(json.loads(path.read_text())[figure])
                own = errors.setdefault(training.arm, {}).setdefault(what[1], {})
                own[training.seed] = round(error, 3)
    return errors


def write_table(study: Study) -> None:
    """Write the errors of all climbs [mm], and how the posterior does beside each other arm."""
    errors = errors_of(study, "rmse")
    rows = {arm: row_of(arm, errors) for arm in errors}
    lines = [HEAD, "|---|---|---|---|---|---|"]
    lines += [
        f"| {arm} | {sum(map(len, errors[arm].values()))} | {row['mean_mm']:.2f} "
        f"({row['least_mm']:.1f} to {row['greatest_mm']:.1f}) | {row.get('share', np.nan):.2f} | "
        f"{row.get('p', np.nan):.2g} | {row.get('p_aim', np.nan):.2g} |"
        for arm, row in rows.items()
    ]
    origin = {"command": " ".join(["python -m lab.studies.diagnosed_policies", *sys.argv[1:]]),
              "commit": git_commit(), "units": list(study.units)}  # fmt: skip
    kept = {"tip_error_mm": errors, "settled_error_mm": errors_of(study, "settled_error")}
    write_json(study.out / "table.json", {**origin, "arms": rows, **kept})
    (study.out / "table.md").write_text("\n".join(lines) + "\n")


def row_of(arm: str, errors: Errors) -> dict[str, float]:
    """Return an arm's errors [mm], and beside it those of the posterior, paired by unit."""
    values = [mean(own.values()) for own in errors[arm].values()]
    out = {"mean_mm": mean(values), "least_mm": min(values), "greatest_mm": max(values)}
    first, other = paired(errors.get(ARMS[0], {}), errors[arm])
    if len(first) < 2 or arm == ARMS[0]:
        return out
    out |= {"pairs": len(first), "share": float(first.sum() / other.sum())}
    out["p"] = float(ttest_rel(first, other).pvalue)
    if arm in AIMS:
        aimed = ttest_rel(first, AIMS[arm] * other, alternative="less")
        out["p_aim"] = float(aimed.pvalue)
    return out


def paired(one: Units, other: Units) -> tuple[Array, Array]:
    """Return the errors of two arms on the units of both, means over the seeds of both [mm]."""
    seeds = {unit: one[unit].keys() & other[unit].keys() for unit in one.keys() & other.keys()}
    pairs = [
        [mean(arm[unit][seed] for seed in both) for arm in (one, other)]
        for unit, both in sorted(seeds.items()) if both
    ]  # fmt: skip
    first, second = np.array(pairs).reshape(-1, 2).T
    return first, second


def main() -> None:
    """Do what is missing, and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of all results")
    parser.add_argument("--units", type=int, nargs="+", default=list(UNITS))
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(5)))
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=list(ARMS[:-1]))
    parser.add_argument("--devices", nargs="+", default=["cpu"])
    parser.add_argument("--each", type=int, default=8, help="trainings at once on each device")
    parser.add_argument("--minutes", type=float, default=1.0e6, help="then nothing new begins")
    parser.add_argument("--worlds", type=int, default=RECIPE.environment.worlds)
    parser.add_argument("--iterations", type=int, default=RECIPE.iterations)
    words = parser.parse_args()
    (words.out / CLIMBS).mkdir(parents=True, exist_ok=True)
    environment = replace(RECIPE.environment, worlds=words.worlds)
    study = Study(
        out=words.out, units=tuple(words.units), seeds=tuple(words.seeds), arms=tuple(words.arms),
        recipe=replace(RECIPE, environment=environment, iterations=words.iterations),
    )  # fmt: skip
    run(study, words.devices, words.each, time.monotonic() + 60.0 * words.minutes)
    print((words.out / "table.md").read_text())


if __name__ == "__main__":
    main()
