"""From a diagnosis to a policy: what a finger's tip misses, by what its policy was trained on.

``python -m lab.studies.diagnosed_policies --out DIR --jobs 8 --devices cuda:0 cuda:1``

Each unit of the virtual bench is recorded and diagnosed by the two commands that a newcomer types.
Policies of one recipe are trained on each of `ARMS` with each seed, and climb the paper's stairs
on their unit. Those of a data sheet know no unit and climb on all of them. ``table.json`` and
``table.md`` compare the posterior with each other arm, paired by unit. What is in DIR is not done
again. ``--stage`` does one part, and after ``--minutes`` no further job begins.
"""

import argparse
import contextlib
import io
import json
import sys
import time
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import ttest_rel

from lab.studies.policy_transfer import climb, file_of
from lab.studies.units import timed
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.model_file import NamedValues, load_model, write_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.posterior import Posterior, read_posterior, write_posterior
from tendon_newton.scheduler import JobOptions, completed
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.policy.worlds.force_model import moves_finger

UNITS = tuple(range(110, 120))  # Units that no choice has seen
RANGES = ("joint_friction", "link_mass", "spool_radius", "joint_spring")
ARMS = ("posterior", "truth", "nominal", "ranges", "intervals", "diagnosed")
"""A diagnosis with its posterior; the unit's own numbers; a data sheet, and with the default
ranges; a diagnosis with the intervals of its causes each by itself, and with nothing drawn."""
SHARED = ("nominal", "ranges")  # Arms that know no unit
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
AIMS = {"nominal": 0.5, "truth": 1.15}
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


def prepare(unit: int, out: Path) -> str:
    """Record and diagnose a unit, and write what its policies are trained on."""
    recordings, answer = out / f"recordings_{unit}", out / f"answer_{unit}"
    port = ("--port", f"virtual::{unit}:new", "--faster-than-real-time")
    for verb, made, words in (
        (
            "collect",
            recordings / "dataset.toml",
            ("--plan", "quick", *port, "--out", str(recordings)),
        ),
        ("diagnose", answer / "diagnosis.json", (str(recordings), "--out", str(answer))),
    ):
        if not made.exists():
            timed((verb, *words), out / f"{verb}_{unit}.log")
    write_truth(recordings, out / f"truth_{unit}.toml")
    path = answer / "intervals.json"
    path.write_text((answer / "diagnosis.json").read_text())
    write_posterior(path, by_themselves(read_posterior(answer / "diagnosis.json")))
    return f"unit {unit} is diagnosed"


def write_truth(recordings: Path, path: Path) -> None:
    """Write a unit's own numbers as a model, as far as the catalogue has them."""
    plant = tomllib.loads((recordings / "plant_finger.toml").read_text())
    model = load_model(recordings / "model.toml")
    servo = {name: plant["servo"][name] for name in ("torque_constant", "resistance")}
    own = {**model.actuator.values, **servo, "armature": plant["servo"]["inertia"],
           "supply_voltage": plant["servo"]["supply_voltage"]}  # fmt: skip
    links = {key: tuple(plant["mechanism"][name]) for key, name in LINKS.items()}
    effects = (
        NamedValues(name=row["name"], values=row["parameters"])
        for row in plant["effects"]
        if "parameters" in row and moves_finger(row["name"]) and row["name"] not in OF_LINKS
    )
    truth = replace(
        model, actuator=replace(model.actuator, values=own), effects=tuple(effects), fit=(),
        bench_overrides={"finger": BenchOverrides(**links)},
    )  # fmt: skip
    write_model(path, truth)


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


def config_of(training: Training) -> PolicyTrainingConfig:
    """Return the settings of a training."""
    unit, out = training.unit, training.out
    sheet, answer = out / f"recordings_{unit}" / "model.toml", out / f"answer_{unit}"
    force, randomise = {
        "posterior": (answer / "model.toml", (str(answer / "diagnosis.json"),)),
        "intervals": (answer / "model.toml", (str(answer / "intervals.json"),)),
        "diagnosed": (answer / "model.toml", ("none",)),
        "truth": (out / f"truth_{unit}.toml", ("none",)),
        "nominal": (sheet, ("none",)),
        "ranges": (sheet, RANGES),
    }[training.arm]
    environment = replace(RECIPE.environment, force=str(force), randomise=randomise)
    return replace(RECIPE, environment=environment, seed=training.seed)


def train(what: tuple[Training, str]) -> str:
    """Train a policy on a device and write it."""
    quiet_warp()
    (training, device), start = what, time.monotonic()
    config = replace(config_of(training), device=device)
    training.folder.mkdir(parents=True, exist_ok=True)
    with contextlib.redirect_stdout(io.StringIO()):
        trained = train_policy(config, training.folder, report=lambda _: None)
        export_policy(training.folder, trained, config)
    seconds = time.monotonic() - start
    return f"{training.folder.name}: {trained.points[-1].text}, {seconds:.0f} s"


def write_table(trainings: Sequence[Training], units: Sequence[int], out: Path) -> None:
    """Write the errors of all climbs [mm], and how the posterior does beside each other arm."""
    errors: dict[str, dict[int, list[float]]] = {}
    for training in trainings:
        for unit in units if training.arm in SHARED else (training.unit,):
            path = file_of(training.policy, unit, out / CLIMBS)
            if path.exists():
                rmse = 1e3 * float(json.loads(path.read_text())["rmse"])
                errors.setdefault(training.arm, {}).setdefault(unit, []).append(rmse)
    means = {arm: {u: float(np.mean(e)) for u, e in own.items()} for arm, own in errors.items()}
    rows = {arm: row_of(arm, means) for arm in means}
    lines = [HEAD, "|---|---|---|---|---|---|"]
    lines += [
        f"| {arm} | {sum(map(len, errors[arm].values()))} | {row['mean_mm']:.2f} "
        f"({row['least_mm']:.1f} to {row['greatest_mm']:.1f}) | {row.get('share', np.nan):.2f} | "
        f"{row.get('p', np.nan):.2g} | {row.get('p_aim', np.nan):.2g} |"
        for arm, row in rows.items()
    ]
    origin = {"command": " ".join(["python -m lab.studies.diagnosed_policies", *sys.argv[1:]]),
              "commit": git_commit(), "units": list(units)}  # fmt: skip
    write_json(out / "table.json", {**origin, "arms": rows, "errors_mm": errors})
    (out / "table.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


def row_of(arm: str, means: Mapping[str, Mapping[int, float]]) -> dict[str, float]:
    """Return an arm's errors [mm], and beside it those of the posterior, paired by unit."""
    own, mine = means[arm], means.get(ARMS[0], {})
    both = [unit for unit in own if unit in mine]
    first, other = np.array([mine[u] for u in both]), np.array([own[u] for u in both])
    out: dict[str, float] = {}
    if len(both) > 1 and arm != ARMS[0]:
        out["share"], out["p"] = (
            float(first.sum() / other.sum()),
            float(ttest_rel(first, other).pvalue),
        )
        if arm in AIMS:
            aimed = ttest_rel(first, AIMS[arm] * other, alternative="less")
            out["p_aim"] = float(aimed.pvalue)
    values = list(own.values())
    return {
        "mean_mm": float(np.mean(values)),
        "least_mm": min(values),
        "greatest_mm": max(values),
    } | out


def unless_late(until: float, work: Callable[[Any], str], *what: Any) -> str | None:
    """Do a job, if the time is not over [s of the monotonic clock]."""
    return None if time.monotonic() > until else work(*what)


def main() -> None:
    """Do what is missing, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--units", type=int, nargs="+", default=list(UNITS))
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(5)))
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=list(ARMS))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--devices", nargs="+", default=["cpu"])
    parser.add_argument("--stage", choices=("prepare", "train", "climb", "table"))
    parser.add_argument("--minutes", type=float, default=1.0e6)
    words = parser.parse_args()
    until = time.monotonic() + 60.0 * words.minutes
    (words.out / CLIMBS).mkdir(parents=True, exist_ok=True)

    def do(stage: str, work: Callable[[Any], str], items: Sequence[Any]) -> None:
        if words.stage in (None, stage):
            job = partial(unless_late, until, work)
            for _, said in completed(job, items, JobOptions(jobs=words.jobs)):
                print(said or "no time was left for a job", flush=True)

    ready = [u for u in words.units if (words.out / f"answer_{u}" / "intervals.json").exists()]
    do("prepare", partial(prepare, out=words.out), [u for u in words.units if u not in ready])
    trainings = [
        Training(arm=arm, unit=unit, seed=seed, out=words.out)
        for seed in words.seeds
        for arm in words.arms
        for unit in (words.units[:1] if arm in SHARED else words.units)
    ]
    missing = [t for t in trainings if not t.policy.exists()]
    devices = [words.devices[k % len(words.devices)] for k in range(len(missing))]
    do("train", train, [*zip(missing, devices, strict=True)])
    climbs = [(t.policy, unit, words.out / CLIMBS) for t in trainings if t.policy.exists()
              for unit in (words.units if t.arm in SHARED else (t.unit,))]  # fmt: skip
    do("climb", climb, [each for each in climbs if not file_of(*each).exists()])
    write_table(trainings, words.units, words.out)


if __name__ == "__main__":
    main()
