"""Policies trained in MuJoCo on an exported model, beside policies trained on the model itself.

``python -m lab.studies.policy_export --out DIR`` records a minute on virtual bench 0, fits the
servo's data sheet and its gear's dry friction to it, exports that model to MuJoCo, and trains
policies with the same seeds, goals and steps in our simulator and in plain MuJoCo, which has the
export's `model.xml` alone. All policies then climb the stairs on the same virtual benches. What is
finished is not done again. ``policy_export.json`` and ``policy_export.png`` have the figures, and
``climbs/transfer.md`` the table. ``--ways program`` trains on the export's program, for some hours.

The friction is the one cause that MJCF has a number for. A diagnosis of so short a recording names
no cause.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.exported_worlds import ExportedWorlds
from lab.studies.policy_transfer import climb, file_of, write_tables
from tendon_lab.reproduction.physical import refit
from tendon_newton.cli import main as run_verb
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.picture import COLOURS, new_figure, save, tidy
from tendon_newton.data.model_file import NamedValues, load_model, write_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.effects import find_effect
from tendon_newton.exports.source import read_source
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.curve import read_curve
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy

STEPS = {"ours": 2.0e-3, "program": 5.0e-4, "file": 1.0e-3}  # Step of each simulator [s]
RECORD = "collect --plan quick --port virtual --seed 0 --faster-than-real-time"
MODEL, EXPORT = "model.toml", "export"
CAUSES = ("coulomb_friction",)


def main() -> None:
    """Prepare, train, climb, and write the figures."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--ways", nargs="+", choices=STEPS, default=["ours", "file"])
    words.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    words.add_argument("--units", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    words.add_argument("--iterations", type=int, default=200)
    words.add_argument("--jobs", type=int, default=1)
    told = words.parse_args()
    quiet_warp()
    told.out.mkdir(parents=True, exist_ok=True)
    prepare(told.out)
    climbs = told.out / "climbs"
    climbs.mkdir(exist_ok=True)
    for seed in told.seeds:
        for way in told.ways:
            folder = told.out / "policies" / f"{way}-{seed}"
            if not (folder / "policy.json").exists():
                train(told.out, way, training(told.out, way, seed, told.iterations), told.jobs)
            for unit in told.units:
                if not file_of(folder / "policy.onnx", unit, climbs).exists():
                    print(climb((folder / "policy.onnx", unit, climbs)), flush=True)
    write_tables(climbs, told.units)
    write_figures(told.out, told.ways, told.seeds)


def prepare(out: Path) -> None:
    """Record, fit and export, as far as that is not done."""
    model = out / MODEL
    if not model.exists():
        recordings = out / "recordings"
        code = run_verb([*RECORD.split(), "--out", str(recordings)])
        if code:
            raise SystemExit(f"tendon-newton {RECORD} ended with {code}")
        start = load_model(recordings / MODEL)
        causes = tuple(
            NamedValues(name=name, values={p.name: p.nominal for p in find_effect(name).parameters})
            for name in CAUSES
        )
        dataset = load_dataset(recordings)
        write_model(model, refit(dataset, replace(start, effects=causes)))
    if not (out / EXPORT / "README.md").exists():
        words = ["export", str(model), "--to", "mujoco", "--bench", "finger"]
        code = run_verb([*words, "--out", str(out / EXPORT)])
        if code:
            raise SystemExit(f"tendon-newton {' '.join(words)} ended with {code}")


def training(out: Path, way: str, seed: int, iterations: int) -> PolicyTrainingConfig:
    """Return the training that all simulators share."""
    return PolicyTrainingConfig(
        environment=EnvironmentConfig(
            worlds=128,
            force=str(out / MODEL),
            randomise=("none",),
            goal_change=0.03,
            max_step=STEPS[way],
        ),
        iterations=iterations,
        steps=24,
        batch=768,
        epochs=4,
        learning_rate=1.0e-3,
        learning_rate_end=1.0e-4,
        discount=0.9,
        trace=0.9,
        exploration_end=0.2,
        seed=seed,
        checkpoint_every=25,
        device="cpu",
    )


def train(out: Path, way: str, config: PolicyTrainingConfig, jobs: int) -> None:
    """Train one policy, and write its files."""
    folder = out / "policies" / f"{way}-{config.seed}"
    folder.mkdir(parents=True, exist_ok=True)
    own, worlds = config.environment, None
    if way != "ours":
        source = read_source(out / MODEL, "finger", None)
        worlds = ExportedWorlds(
            out / EXPORT,
            source.mechanism,
            way,
            own.worlds,
            rate=own.rate,
            step=own.max_step,
            jobs=jobs,
        )
    trained = train_policy(
        config,
        folder,
        report=lambda progress: print(folder.name, progress.text, flush=True),
        simulator=worlds,
    )
    export_policy(folder, trained, config)
    if worlds is not None:
        worlds.close()


def write_figures(out: Path, ways: list[str], seeds: list[int]) -> None:
    """Write errors by simulator, seed and bench, and draw them beside the learning curves."""
    table: dict[str, Any] = {}
    figure = new_figure(10.0, 4.2)
    curves, errors = figure.subplots(1, 2)
    for place, way in enumerate(ways):
        for seed in seeds:
            name = f"{way}-{seed}"
            policy = json.loads((out / "policies" / name / "policy.json").read_text())
            points = read_curve(policy["curve"])
            found = [json.loads(p.read_text()) for p in sorted(out.glob(f"climbs/{name}.unit_*"))]
            rmse = {each["unit"]: round(1e3 * each["rmse"], 2) for each in found}
            table[name] = {"tip_error_mm": rmse, "steps": points[-1].samples}
            label = way if seed == seeds[0] else None
            style: dict[str, Any] = {"color": COLOURS[place], "label": label}
            steps, missed = zip(*((p.samples, 1e3 * p.tip_error) for p in points), strict=True)
            curves.plot(steps, missed, **style)
            shift = place + 0.15 * (seed - np.mean(seeds))
            errors.plot(np.full(len(rmse), shift), list(rmse.values()), ".", **style)
    curves.set_xlabel("policy steps")
    curves.set_ylabel("tip error while it explores [mm]")
    curves.legend(frameon=False)
    errors.set_xticks(range(len(ways)), ways)
    errors.set_ylabel("tip error on virtual benches, RMS [mm]")
    errors.set_ylim(bottom=0.0)
    for axes in (curves, errors):
        tidy(axes)
    save(figure, out / "policy_export.png")
    (out / "policy_export.json").write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
