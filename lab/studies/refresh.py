"""Is wear noticed from the logs of a policy, is it named, and does a refresh make up for it?

Usage: ``.venv/bin/python -m lab.studies.refresh POLICY --out FOLDER [notice] [restore]``.

``POLICY`` is a policy file. ``notice``: on each unit of the virtual finger the policy follows goals
at random, and stairs; the model's numbers are fitted to both logs. Then it follows other goals on
the unit as it was, on one whose gear has run dry, and on one whose spool has slipped, and each log
is held against the model. ``restore``: a policy is trained on that model and climbs on the unit as
it was; the unit wears; `refresh` goes from the policy's logs to another that climbs there. What is
done is kept in FOLDER, and not done again.
"""

import argparse
import contextlib
import io
import json
import time
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from tendon_hardware.deployment.deploy_log import policy_span
from tendon_hardware.virtual_bench.physics.constants import BENCH_SEEDS
from tendon_newton.data.model_file import Model, NamedValues, load_model, write_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.workflows.deployment import drive
from tendon_newton.workflows.options import DeployOptions, RefreshOptions
from tendon_newton.workflows.refreshing import refresh
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.refresh.drift import find_drift, growth, model_error, tune
from tendon_train.refresh.refresh_logs import (
    fitted_parts,
    logs_as_dataset,
    read_logs,
    taut_parts,
    without_beginning,
)
from tendon_train.refresh.refresh_outcome import judge_drift
from tendon_train.refresh.slip import slip_since, taut_from
from tests.hardware.silent_operator import SilentOperator

STATES = ("new", "friction", "spool")
ANSWERS: dict[str, tuple[str, ...]] = {
    "new": (),
    "friction": (
        "coulomb_friction",
        "viscous_friction",
        "load_dependent_friction",
        "holding_friction",
    ),
    "spool": ("tendon_slack", "position_offset"),
}
"""Names that say what is the matter."""
DURATION = 30.0  # Length of a log of random goals [s]
STAIRS = 16.5  # Length of the paper's stairs [s]
GPU_SIZES = {"worlds": 8192, "batch": 32768, "iterations": 100, "discount": 0.95, "trace": 0.95}
"""A training of half a minute on a GPU."""
CPU_SIZES = {"worlds": 256, "batch": 1024, "iterations": 350, "discount": 0.8, "trace": 0.9}
"""One of some minutes on a core."""


def start_model() -> Model:
    """Return the data sheet's motor behind the host's loop, with what every gear has."""
    motor = NamedValues(
        name="pwm_servo",
        values={
            "duty_per_rad": 0.1,
            "max_duty": 0.9,
            "supply_voltage": 9.0,
            "torque_constant": 1.2,
            "resistance": 13.0,
            "armature": 0.0025,
            "spool_radius": 0.0125,
        },
    )
    effects = {
        "coulomb_friction": {"force": 3.5},
        "load_dependent_friction": {"coefficient": 0.2},
        "joint_stiffness_error": {"scale": 0.9},
        "tendon_slack": {"length": 5e-4},
        "routing_friction": {"exponent": 0.1},
        "viscoelastic_spring": {"stiffness_ratio": 0.4, "relaxation_time": 1.4},
    }
    return Model(
        actuator=motor,
        effects=tuple(NamedValues(name=name, values=own) for name, own in effects.items()),
        fit=("torque_constant", "resistance"),
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path)
    parser.add_argument("parts", nargs="*", default=["notice"])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, nargs="*", default=list(BENCH_SEEDS[:5]))
    parser.add_argument("--iterations", type=int, default=100, help="of the new policy")
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu", help="of trainings")
    arguments = parser.parse_args()
    quiet_warp()
    seeds = arguments.seeds
    if "notice" in arguments.parts:
        rows = [
            notice(arguments.policy, arguments.out / f"unit_{seed}", seed, state)
            for seed in seeds
            for state in STATES
        ]
        summarise(rows)
    if "restore" in arguments.parts:
        for seed in seeds:
            for state in STATES[1:]:
                restore(arguments, arguments.out / f"unit_{seed}", seed, state)


def fly(policy: Path, folder: Path, port: str, goals: str, duration: float) -> Path:
    """Deploy once, in lockstep, and return the log; a log that is there is taken."""
    logs = sorted(folder.glob("*.mcap"))
    if not logs:
        with contextlib.redirect_stdout(io.StringIO()):
            drive(
                DeployOptions(
                    policy=policy,
                    port=port,
                    goals=goals,
                    duration=duration,
                    out=folder,
                    faster_than_real_time=True,
                ),
                SilentOperator(),
            )
        logs = sorted(folder.glob("*.mcap"))
    return logs[0]


def random_goals(path: Path, seed: int) -> str:
    """Write goals that are held for one to two and a half seconds, and return the file's name."""
    rng = np.random.default_rng(seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    instants = np.cumsum(np.r_[0.0, rng.uniform(1.0, 2.5, 40)])
    values = rng.uniform(0.0, 0.5 * pi, 41)
    lines = [f"{t:.3f} {a:.4f}" for t, a in zip(instants, values, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def fitted_model(policy: Path, folder: Path, seed: int) -> Path:
    """Fit the model to two logs of the unit as it was, and return its file."""
    path = folder / "model.toml"
    if not path.exists():
        goals = random_goals(folder / "goals_before.txt", 2 * seed)
        port = f"virtual:finger:{seed}"
        logs = [
            fly(policy, folder / "before", port, goals, DURATION),
            fly(policy, folder / "stairs_new", port, "stairs", STAIRS),
        ]
        recordings = [without_beginning(log) for log in read_logs(logs, policy_span)]
        write_model(path, tune(taut_parts(recordings), start_model()).model)
    return path


def notice(policy: Path, folder: Path, seed: int, state: str) -> dict[str, Any]:
    """Hold a later log of a unit against its model."""
    kept = folder / f"notice_{state}.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    model = load_model(fitted_model(policy, folder, seed))
    goals = random_goals(folder / "goals_later.txt", 2 * seed + 1)
    log = fly(policy, folder / f"later_{state}", f"virtual:finger:{seed}:{state}", goals, DURATION)
    begin = time.monotonic()
    logs = read_logs([log], policy_span)
    later = fitted_parts(logs)
    dataset = logs_as_dataset(log.parent, logs, taut_from(later, model))
    diagnosis, _ = find_drift(dataset, model)
    before = next((folder / "before").glob("*.mcap"))
    new = read_logs([before], policy_span)
    earlier = logs_as_dataset(before.parent, new)
    reference = model_error(earlier.test, model)
    drift = judge_drift(
        diagnosis,
        reference,
        grown=growth(dataset, earlier, model),
        slip=slip_since(fitted_parts(new), later),
    )
    row = {
        "seed": seed,
        "state": state,
        "named": [(cause.name, *cause.rivals) for cause in drift.causes],
        "numbers": [cause.numbers for cause in drift.causes],
        "candidate": [
            (effect.name, *effect.indistinguishable_from) for effect in diagnosis.effects
        ],
        "theta_mrad": [1e3 * reference, 1e3 * drift.theta_rmse, 1e3 * drift.corrected_theta_rmse],
        "seconds": time.monotonic() - begin,
    }
    kept.write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
    print(described(row), flush=True)
    return row


def described(row: dict[str, Any]) -> str:
    """Return a row in words."""
    named = "; ".join(" or ".join(names) for names in row["named"]) or "nothing"
    earlier, before, after = row["theta_mrad"]
    return (
        f"unit {row['seed']} {row['state']:9s} named {named:42s} "
        f"error before {earlier:5.1f}, now {before:5.1f}, with it {after:5.1f} mrad   "
        f"{row['seconds']:.0f} s"
    )


def summarise(rows: list[dict[str, Any]]) -> None:
    """Say how often wear was noticed and named."""
    for state in STATES:
        own = [row for row in rows if row["state"] == state]
        noticed = sum(bool(row["named"]) for row in own)
        right = sum(
            bool(row["named"]) and bool(set(row["named"][0]) & set(ANSWERS[state])) for row in own
        )
        print(f"{state:9s} of {len(own)}: something named {noticed}, the right thing first {right}")


def restore(arguments: argparse.Namespace, folder: Path, seed: int, state: str) -> None:
    """Refresh a policy for a worn unit, from a log of stairs and one of random goals."""
    model = fitted_model(arguments.policy, folder, seed)
    policy = trained_policy(model, folder / "policy", arguments.device)
    own = folder / "own"
    before = fly(policy, own / "stairs_new", f"virtual:finger:{seed}", "stairs", STAIRS)
    port = f"virtual:finger:{seed}:{state}"
    later = fly(policy, own / f"stairs_{state}", port, "stairs", STAIRS)
    goals = random_goals(folder / "goals_later.txt", 2 * seed + 1)
    longer = fly(policy, own / f"later_{state}", port, goals, DURATION)
    begin = time.monotonic()
    out = folder / f"refresh_{state}"
    refresh(
        RefreshOptions(
            logs=(later, longer),
            reference=(before,),
            model=model,
            policy=policy,
            out=out,
            iterations=arguments.iterations,
            device=arguments.device,
            port=port,
            faster_than_real_time=True,
        ),
        SilentOperator(),
    )
    seconds = time.monotonic() - begin
    row = {"seed": seed, "state": state, "seconds": seconds, "tip_mm": stairs_errors(out)}
    (folder / f"restore_{state}.json").write_text(json.dumps(row, indent=1) + "\n")
    tips = ", ".join(f"{name} {error:.1f} mm" for name, error in row["tip_mm"].items())
    print(
        f"unit {seed} {state:9s} tip on the stairs, RMS: {tips or 'wear not noticed'}; "
        f"{seconds:.0f} s",
        flush=True,
    )


def trained_policy(model: Path, out: Path, device: str) -> Path:
    """Train a policy on a model, 26 M steps on a GPU or 3 M on a core, and return its file."""
    path = out / "policy.onnx"
    if not path.exists():
        sizes = GPU_SIZES if device == "cuda" else CPU_SIZES
        environment = EnvironmentConfig(
            worlds=sizes["worlds"],
            force=str(model),
            max_step=2.0e-3,
            randomise=("none",),
            goal_change=0.03,
        )
        config = PolicyTrainingConfig(
            environment=environment,
            steps=32,
            batch=sizes["batch"],
            epochs=4,
            learning_rate=1.0e-3,
            learning_rate_end=1.0e-4,
            exploration_end=0.2,
            iterations=sizes["iterations"],
            device=device,
            discount=sizes["discount"],
            trace=sizes["trace"],
        )
        trained = train_policy(config, out, report=lambda progress: None)
        export_policy(out, trained, config)
    return path


def stairs_errors(out: Path) -> dict[str, float]:
    """Return the tip's errors [mm] on the bench's stairs that a refresh compared, if it did."""
    table = json.loads((out / "refresh.json").read_text(encoding="utf-8"))
    figures = table["stages"].get("figures", [])
    climbs = [f for f in figures if not f["where"].startswith("simulation")]
    if not climbs:
        return {}
    chosen = {"new": climbs[0], "worn": climbs[1], "refreshed": climbs[-1]}
    return {name: 1.0e3 * figure["rmse"] for name, figure in chosen.items()}


if __name__ == "__main__":
    main()
