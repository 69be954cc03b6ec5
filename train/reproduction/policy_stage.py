"""Policies on the bench's stairs: those that are given, or one for each of the compared models."""

from __future__ import annotations

from pathlib import Path

from train.policy.environment_config import EnvironmentConfig
from train.policy.export import export_policy
from train.policy.training import train_policy
from train.policy.training_config import PolicyTrainingConfig
from train.reproduction.outcome import Outcome, row
from train.reproduction.reproduction import MODELS, Reproduction

PAPER_STAIRS = {"ideal": 24.0, "network": 12.0}
"""[mm]"""
TRAINED_ON = ("ideal", "network", "physical", "hybrid")


def run(reproduction: Reproduction) -> Outcome:
    """Let every policy climb the stairs on every bench."""
    if reproduction.bench is None or not reproduction.is_virtual:
        return Outcome(text="Policies climb on a bench; here there are recordings alone.")
    policies = {path.resolve().parent.name: path for path in reproduction.policies}
    if not policies and reproduction.settings.policy_iterations:
        policies = {model: trained(reproduction, model) for model in TRAINED_ON}
    if not policies:
        return Outcome(text="None was given, and none is trained in a quick run; see `--policy`.")
    errors = {
        name: [
            1.0e3 * reproduction.bench.climb(
                number, path, reproduction.folder("climbs", unit.name, name)
            )
            for number, unit in zip(
                reproduction.settings.units, reproduction.units, strict=True
            )
        ]
        for name, path in policies.items()
    }  # fmt: skip
    return Outcome(
        rows=tuple(
            row("policy on the stairs", f"{MODELS.get(name, name)}, tip RMSE", "mm", found,
                paper=PAPER_STAIRS.get(name))
            for name, found in errors.items()
        ),
        numbers={"tip_error_mm": errors},
    )  # fmt: skip


def trained(reproduction: Reproduction, model: str) -> Path:
    """Train a policy against one of the first bench's models and return its file."""
    settings = reproduction.settings
    force = str(reproduction.model_file(reproduction.units[0], model))
    reproduction.tell(f"  a policy against {MODELS[model]}")
    config = PolicyTrainingConfig(
        environment=EnvironmentConfig(
            worlds=settings.policy_worlds, max_step=2.0e-3,
            force="ideal" if model == "ideal" else force,
        ),
        iterations=settings.policy_iterations, steps=32, epochs=4, learning_rate=1.0e-3,
        discount=0.8, trace=0.9, seed=settings.seed,
    )  # fmt: skip
    folder = reproduction.folder("policies", model)
    done = train_policy(config, folder, report=lambda progress: None)
    return export_policy(folder, done, config).onnx
