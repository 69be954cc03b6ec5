"""From a model to a policy: what a finger's tip misses, by what its policy was trained on.

``python -m lab.studies.diagnosed_policies --out DIR`` compares a diagnosis with a data sheet.
The paper's experiment, with a Transformer beside, is

``python -m lab.studies.diagnosed_policies --out DIR --arms ideal ranges network diagnosed truth
--units 3201 3202 3203 3204 3205 3206 3207 3208 3209 3210``

Each unit of the virtual bench is recorded and diagnosed by the two commands that a newcomer types;
a network has the paper's 36 minutes of recordings. Policies of one recipe are trained on each of
`ARMS` with each seed, and climb the paper's stairs on their unit. Those of `SHARED` arms know no
unit and climb on all of them. Each policy of a network or a diagnosis also climbs on the next unit,
which it does not know. All GPUs are used, all arms of a seed before the next seed. ``table.json``
and ``table.md`` compare each arm with the first, paired by unit over the seeds that both have; they
are written anew after each job. What is in DIR is not done again, and after ``--minutes`` nothing
but climbs begins.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_rel

from lab.studies.climbs import climb, file_of
from lab.studies.job_graph import Job, Places, failures, run
from lab.studies.units import read, timed
from tendon_hardware.control.goals import DWELL
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.model_file import Model, NamedValues, load_model, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.search.fixed_set import as_stated, fit_set
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.identification.study import Study as Fitted
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.scheduler import THREADS_VARIABLE
from tendon_newton.workflows.climbing import stair_levels
from tendon_newton.workflows.options import policy_file
from tendon_train.actuator.training_config import TrainingConfig
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.policy.scoring.policy_evaluation import goal_points
from tendon_train.policy.worlds.force_model import IDEAL, moves_finger
from tendon_train.policy.worlds.goal_path import GoalPath

Array = NDArray[np.float64]
Units = Mapping[str, Mapping[int, float]]  # Unit -> seed -> tip error [mm]
Errors = dict[str, dict[str, dict[int, float]]]  # The same by arm
UNITS = tuple(str(unit) for unit in range(2001, 2011))
RANGES = ("joint_friction", "link_mass", "spool_radius", "joint_spring")
ARMS = ("diagnosed", "ranges", "truth", "nominal", "ideal", "network")
"""A diagnosis; a data sheet with the default ranges; the unit's own causes; a data sheet with
nothing drawn; the paper's ideal source with the default ranges, and its Transformer."""
SHARED = ("ideal", "nominal", "ranges")  # Arms that know no unit
LEARNED = ("network", "diagnosed")  # Arms that are tried on a unit they do not know
ELSEWHERE = " of the next unit"
OURS, PACKAGED = "finger-stairs", "packaged"
"""The policy that comes with the program, of another unit's diagnosis."""
NETWORK = TrainingConfig(network="transformer", purpose="simulation")
RECIPE = PolicyTrainingConfig(
    steps=32, batch=16_384, epochs=4, iterations=200, checkpoint_every=20,
    learning_rate=1.0e-3, learning_rate_end=1.0e-4, exploration_end=0.2,
    environment=EnvironmentConfig(worlds=4096, goal_change=0.03, max_step=1.0e-3),
)  # fmt: skip
"""26.2 million steps."""
LINKS = {
    "mass": "masses", "length": "lengths", "moment_arm": "moment_arms", "stiffness": "stiffness",
    "damping": "damping", "range": "limits",
}  # fmt: skip
"""Numbers of joints and links, and what a plant's file calls them."""
OF_LINKS = ("joint_stiffness_error", "joint_damping_error", "inertia_error")
"""Effects that are the mean of those numbers."""
HEAD = (
    "| trained on | climbs | failed | tip error [mm]: mean of units (range) | share of the first's "
    "| p | at the end of a stair [mm] |"
)


@dataclass(frozen=True, kw_only=True)
class Training:
    """One policy: what it is trained on, on which unit, and with which seed."""

    arm: str
    unit: str
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

    @property
    def reads(self) -> tuple[Path, ...]:
        """Files without which it cannot begin."""
        if self.arm == "ideal":
            return ()
        if self.arm in SHARED:
            return (recorded(self.unit, self.out),)
        if self.arm == "truth":
            return (self.out / f"truth_{self.unit}.toml",)
        if self.arm == "network":
            return (network_of(self.unit, self.out),)
        return (diagnosed(self.unit, self.out),)


@dataclass(frozen=True, kw_only=True)
class Study:
    """Where everything stands, and on which units and with which seeds.

    A unit is a number, or 7_friction for number 7 whose gear has run dry.
    """

    out: Path
    units: tuple[str, ...]
    seeds: tuple[int, ...]
    arms: tuple[str, ...]
    recipe: PolicyTrainingConfig
    network: TrainingConfig = NETWORK

    @property
    def trainings(self) -> list[Training]:
        """All of them, those of the first seed first."""
        return [
            Training(arm=arm, unit=unit, seed=seed, out=self.out)
            for seed in self.seeds
            for arm in sorted(self.arms, key=(*SHARED, *ARMS).index)
            for unit in (self.units[:1] if arm in SHARED else self.units)
        ]

    def climbs(self, training: Training) -> list[tuple[str, str]]:
        """Return the climbs of a policy: in the name of which arm, and on which unit."""
        if training.arm in SHARED:
            return [(training.arm, unit) for unit in self.units]
        following = self.units[(self.units.index(training.unit) + 1) % len(self.units)]
        own = [(training.arm, training.unit)]
        if training.arm in LEARNED and following != training.unit:
            own.append((training.arm + ELSEWHERE, following))
        return own

    @property
    def all_climbs(self) -> list[tuple[str, int, tuple[Path, str, Path]]]:
        """Return arm and seed of each climb, and policy, unit and folder of the result."""
        folder = self.out / "climbs"
        packaged = policy_file(Path(OURS))
        return [
            (name, training.seed, (training.policy, unit, folder))
            for training in self.trainings
            for name, unit in self.climbs(training)
        ] + [(PACKAGED, 0, (packaged, unit, folder)) for unit in self.units]


def recorded(unit: str, out: Path, which: str = "recordings") -> Path:
    """Return a file that is there when a unit is recorded: a minute, or ``long``."""
    return out / f"{which}_{unit}" / "recorded"


def diagnosed(unit: str, out: Path) -> Path:
    """Return the file that is there when a unit is diagnosed."""
    return out / f"answer_{unit}" / "diagnosed"


def network_of(unit: str, out: Path) -> Path:
    """Return the file of a unit's force network."""
    return out / f"network_{unit}" / f"{NETWORK.name}.safetensors"


def jobs_of(study: Study, threads: int) -> list[Job]:
    """Return all jobs of a study, those of more worth first.

    Args:
        threads: Threads of each diagnosis.
    """
    out, jobs = study.out, list[Job]()
    for unit in study.units:
        ready = recorded(unit, out)
        jobs += [
            Job(makes=ready, work=record, what=(unit, out)),
            Job(makes=diagnosed(unit, out), needs=(ready,), work=diagnose,
                what=(unit, out, threads), threads=threads),
            Job(makes=recorded(unit, out, "long"), work=record, what=(unit, out, "long")),
            Job(makes=network_of(unit, out), needs=(recorded(unit, out, "long"),), work=learn,
                what=(unit, out, study.network), on_device=True),
            Job(makes=out / f"truth_{unit}.toml", needs=(ready,), work=find_truth,
                what=(unit, out)),
        ]  # fmt: skip
    for training in study.trainings:
        jobs.append(Job(makes=training.policy, needs=training.reads, work=train,
                        what=(training, study.recipe), on_device=True))  # fmt: skip
    for _, _, what in study.all_climbs:
        jobs.append(Job(makes=file_of(*what), needs=(what[0],), work=climb, what=(what,),
                        wanted=True, brief=True))  # fmt: skip
    return jobs


def record(unit: str, out: Path, which: str = "recordings") -> str:
    """Record a minute of a unit, or the paper's plan."""
    number, _, state = unit.partition("_")
    words = (
        "collect", "--plan", "paper" if which == "long" else "quick", "--out",
        str(out / f"{which}_{unit}"), "--port", f"virtual::{number}:{state or 'new'}",
        "--faster-than-real-time",
    )  # fmt: skip
    timed(words, out / f"collect_{which}_{unit}.log")
    recorded(unit, out, which).touch()
    return f"unit {unit}: {which} are there"


def find_truth(unit: str, out: Path) -> str:
    """Write a unit's own causes."""
    quiet_warp()
    write_truth(out / f"recordings_{unit}", out / f"truth_{unit}.toml")
    return f"unit {unit}: its own causes are tuned"


def diagnose(unit: str, out: Path, threads: int) -> str:
    """Diagnose a unit with some threads, and write what its policies are trained on."""
    os.environ[THREADS_VARIABLE] = str(threads)
    answer = out / f"answer_{unit}"
    words = ("diagnose", str(out / f"recordings_{unit}"), "--out", str(answer))
    timed(words, out / f"diagnose_{unit}.log")
    diagnosed(unit, out).touch()
    return f"unit {unit} is diagnosed"


def learn(unit: str, out: Path, config: TrainingConfig, device: str) -> str:
    """Train a unit's Transformer on the paper's plan."""
    words = (
        "train-force", str(out / f"long_{unit}"), "--network", config.network, "--purpose",
        config.purpose, "--epochs", str(config.epochs), "--device", device, "--out",
        str(out / f"network_{unit}"),
    )  # fmt: skip
    timed(words, out / f"network_{unit}.log")
    return f"unit {unit}: its network is trained"


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
    write_model(path, tuned(runs, truth))


def tuned(recordings: Sequence[Recording], model: Model) -> Model:
    """Fit the numbers of a model's effects, and those that it declares unknown.

    A fit that ends no better than the model leaves it as it is.
    """
    names = tuple(effect.name for effect in model.effects)
    study = Fitted(recordings, model, names, time_step=SEARCH_STEP, in_segments=True)
    worlds = SearchWorlds(study)
    found = fit_set(worlds, model, names)
    if found.score >= as_stated(worlds, model, names).score:
        return model
    values, owners = values_of(worlds, found.columns, found.place), study.table.owners
    effects = tuple(
        NamedValues(name=n, values={owners[c][1].name: values[c] for c in study.table.columns(n)})
        for n in names
    )
    return replace(study.with_fitted(model, values), effects=effects)


def by_direction(
    effects: Mapping[str, Mapping[str, float]], plant: Mapping[str, Any]
) -> dict[str, Mapping[str, float]]:
    """Return effects with the dry friction that a gear pressed by its motor has either way.

    A plant's file has the mean of both, which is what a diagnosis can find; see
    `quasi_static_gear`. The mean alone holds a finger a tenth of a radian too far closed after it
    was let go.
    """
    share, dry = plant["servo"]["motor_load_friction"], dict(effects["stribeck_friction"])
    less = share * dry["coulomb_force"]
    dry["coulomb_force"] -= less
    dry["static_force"] -= less
    asymmetry = {"winding": 2.0 * less, "unwinding": 0.0}
    return {**effects, "stribeck_friction": dry, "asymmetric_friction": asymmetry}


def config_of(training: Training, recipe: PolicyTrainingConfig) -> PolicyTrainingConfig:
    """Return the settings of a training."""
    unit, out = training.unit, training.out
    sheet, answer = out / f"recordings_{unit}" / "model.toml", out / f"answer_{unit}"
    truth, network = out / f"truth_{unit}.toml", network_of(unit, out)
    force, randomise = {
        "diagnosed": (answer / "model.toml", ("none",)),
        "truth": (truth, ("none",)),
        "nominal": (sheet, ("none",)),
        "ranges": (sheet, RANGES),
        "ideal": (IDEAL, RANGES),
        "network": (network, ("none",)),
    }[training.arm]
    environment = replace(recipe.environment, force=str(force), randomise=randomise)
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


def errors_of(study: Study, figure: str) -> Errors:
    """Return a number of all climbs that there are [mm]."""
    errors: Errors = {}
    for arm, seed, what in study.all_climbs:
        if (path := file_of(*what)).exists():
            error = round(1e3 * float(read(path)[figure]), 3)
            errors.setdefault(arm, {}).setdefault(what[1], {})[seed] = error
    return errors


def still_error() -> float:
    """Return what a tip misses on the stairs that stands still where that is best [mm]."""
    finger = load_mechanism("finger")
    levels = stair_levels(RECIPE.environment.rate, DWELL)
    goals = goal_points(finger, levels)
    places = goal_points(finger, np.linspace(*GoalPath(finger).range, 500))
    gaps = np.linalg.norm(goals[:, None] - places[None], axis=-1)
    return float(1e3 * np.sqrt(np.mean(gaps**2, axis=0)).min())


def write_table(study: Study) -> None:
    """Write the errors of all climbs [mm], and how each arm does beside the first."""
    errors, settled, still = (
        errors_of(study, "rmse"),
        errors_of(study, "settled_error"),
        still_error(),
    )
    rows = {arm: row_of(arm, errors, study.arms[0], still) for arm in errors}
    lines = [HEAD, "|---|---|---|---|---|---|---|"]
    for arm, row in rows.items():
        ends = [mean(own.values()) for own in settled[arm].values()]
        lines.append(
            f"| {arm} | {row['climbs']} | {row['failed']} | {row['mean_mm']:.2f} "
            f"({row['least_mm']:.1f} to {row['greatest_mm']:.1f}) | {row.get('share', np.nan):.2f} "
            f"| {row.get('p', np.nan):.2g} | {mean(ends):.2f} |"
        )
    lines += [f"| a finger that stands still | | | {still:.1f} | | | |", ""]
    failed = failures(study.out)
    kept = {
        "command": command_of(study.out),
        "commit": git_commit(), "units": list(study.units), "still_mm": still, "failed": failed,
        "steps": study.recipe.iterations * study.recipe.steps * study.recipe.environment.worlds,
        "arms": rows, "tip_error_mm": errors, "settled_error_mm": settled,
    }  # fmt: skip
    write_json(study.out / "table.json", kept)
    (study.out / "table.md").write_text("\n".join([*lines, *failed]) + "\n")


def command_of(out: Path) -> str:
    """Return the command that runs, with DIR for its folder."""
    words = ["python -m lab.studies.diagnosed_policies", *sys.argv[1:]]
    return " ".join(words).replace(str(out), "DIR")


def row_of(arm: str, errors: Errors, first: str, still: float) -> dict[str, float]:
    """Return an arm's errors [mm], and beside them those of the first arm, paired by unit.

    Args:
        still: Error of a finger that stands still [mm]; a policy that misses as much has failed.
    """
    values = [mean(own.values()) for own in errors[arm].values()]
    every = [error for own in errors[arm].values() for error in own.values()]
    out: dict[str, float] = {
        "mean_mm": mean(values), "least_mm": min(values), "greatest_mm": max(values),
        "climbs": len(every), "failed": sum(error >= still for error in every),
    }  # fmt: skip
    own, other = paired(errors[arm], errors.get(first, {}), arm == PACKAGED)
    if len(own) < 2 or arm == first:
        return out
    out |= {"pairs": len(own), "share": float(own.sum() / other.sum())}
    return out | {"p": float(ttest_rel(own, other).pvalue)}


def paired(one: Units, other: Units, any_seed: bool = False) -> tuple[Array, Array]:
    """Return the errors of two arms on the units of both, means over the seeds of both [mm].

    Args:
        any_seed: Whether all seeds of both count, as one of them has a single policy.
    """
    pairs: list[tuple[float, float]] = []
    for unit in sorted(one.keys() & other.keys()):
        seeds = one[unit].keys() & other[unit].keys()
        first, second = (
            [arm[unit][seed] for seed in (arm[unit] if any_seed else seeds)] for arm in (one, other)
        )
        if first and second:
            pairs.append((mean(first), mean(second)))
    first_arm, second_arm = np.array(pairs).reshape(-1, 2).T
    return first_arm, second_arm


def reader(about: str | None) -> argparse.ArgumentParser:
    """Return a parser of the words of this study."""
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of all results")
    parser.add_argument("--units", nargs="+", default=list(UNITS))
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(5)))
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=list(ARMS[:4]))
    parser.add_argument("--devices", nargs="+", default=[], help="by default all GPUs")
    parser.add_argument("--each", type=int, default=6, help="trainings at once on each device")
    parser.add_argument("--cores", type=int, help="for all but trainings; by default all")
    parser.add_argument("--threads", type=int, default=2, help="of each diagnosis")
    parser.add_argument("--minutes", type=float, default=1.0e6, help="then climbs alone begin")
    parser.add_argument("--worlds", type=int, default=RECIPE.environment.worlds)
    parser.add_argument("--iterations", type=int, default=RECIPE.iterations)
    parser.add_argument("--epochs", type=int, default=NETWORK.epochs, help="of each network")
    return parser


def study_of(words: argparse.Namespace) -> Study:
    """Return the study that some words ask for; its folder is made."""
    (words.out / "climbs").mkdir(parents=True, exist_ok=True)
    environment = replace(RECIPE.environment, worlds=words.worlds)
    return Study(
        out=words.out, units=tuple(words.units), seeds=tuple(words.seeds), arms=tuple(words.arms),
        recipe=replace(RECIPE, environment=environment, iterations=words.iterations),
        network=replace(NETWORK, epochs=words.epochs),
    )  # fmt: skip


def main() -> None:
    """Do what is missing, and write the table."""
    words = reader(__doc__).parse_args()
    study = study_of(words)
    places = Places.of(words.devices, words.each, words.cores, words.minutes)
    run(jobs_of(study, words.threads), places, words.out, lambda: write_table(study))
    write_table(study)
    print((words.out / "table.md").read_text())


if __name__ == "__main__":
    main()
