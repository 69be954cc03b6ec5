"""Policies on the bench's stairs: those that are given, or some for each of the compared models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import warp as wp

from tendon_lab.reproduction.outcome import Outcome, Row, mean_text, reductions, row
from tendon_lab.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction
from tendon_lab.reproduction.settings import POLICIES, POLICY_STEPS, PolicyEffort
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy

PAPER_STAIRS = {"ideal": 24.0, "network": 12.0}  # [mm]
PAPER_REDUCTION = 50.0  # [%]
TRAINED_ON = (*IDEALS, *BEST)
NOMINAL = ("none",)  # Nothing differs between worlds: a model of the servo as it is learns best so

Errors = Mapping[str, Sequence[float]]
"""Name of a policy or its model -> tip error on each bench [mm]."""


async def run(reproduction: Reproduction) -> Outcome:
    """Let every policy climb the stairs on every bench."""
    if reproduction.bench is None or not reproduction.is_virtual:
        return Outcome(text="Policies climb on a bench; here there are recordings alone.")
    effort = reproduction.settings.policies
    if reproduction.policies:
        policies = {path.resolve().parent.name: (str(path),) for path in reproduction.policies}
    elif effort is not None:
        items = [
            (place * len(effort.seeds) + number, model, seed)
            for place, model in enumerate(TRAINED_ON)
            for number, seed in enumerate(effort.seeds)
        ]
        files = await reproduction.each(trained, items)
        policies = {
            model: tuple(f for f, item in zip(files, items, strict=True) if item[1] == model)
            for model in TRAINED_ON
        }
    else:
        return Outcome(text="None was given, and none is trained in a quick run; see `--policy`.")
    errors = await climbed(reproduction, policies)
    return Outcome(
        rows=(*rows_of(errors, differs_in(reproduction)), *reduction_rows(errors)),
        numbers={"tip_error_mm": errors},
        text=reduction_text(errors),
    )


async def climbed(
    reproduction: Reproduction, policies: Mapping[str, Sequence[str]]
) -> dict[str, list[float]]:
    """Return the tip error on each bench [mm], the mean of all policies of one name."""
    places = range(len(reproduction.units))
    items = [
        (name, file, place) for name in policies for file in policies[name] for place in places
    ]
    found = zip(items, await reproduction.each(climb, items), strict=True)
    by_name: dict[str, list[list[float]]] = {name: [[] for _ in places] for name in policies}
    for (name, _, place), error in found:
        by_name[name][place].append(error)
    return {name: [float(np.mean(own)) for own in benches] for name, benches in by_name.items()}


def climb(reproduction: Reproduction, item: tuple[str, str, int]) -> float:
    """Let a policy climb on one bench and return its tip error [mm]."""
    name, file, place = item
    assert reproduction.bench is not None
    unit = reproduction.units[place]
    out = reproduction.folder("climbs", unit.name, name, Path(file).resolve().parent.name)
    number = reproduction.settings.units[place]
    return 1.0e3 * reproduction.bench.climb(number, Path(file), out)


def trained(reproduction: Reproduction, item: tuple[int, str, int]) -> str:
    """Train a policy against one of the first bench's models and return its file.

    Args:
        reproduction: Run with the model.
        item: Number of the policy, which chooses among several GPUs; its model; its seed.
    """
    number, model, seed = item
    effort = reproduction.settings.policies
    assert effort is not None
    force = str(reproduction.model_file(reproduction.units[0], model))
    reproduction.model(reproduction.units[0], model)
    reproduction.tell(f"  a policy against {MODELS[model]}, seed {seed}")
    config = training_of(effort, model, force, seed, own_device(effort.device, number))
    folder = reproduction.folder("policies", model, f"seed_{seed}")
    with wp.ScopedDevice(config.device):
        done = train_policy(config, folder, report=lambda progress: None)
        return str(export_policy(folder, done, config).onnx)


def training_of(
    effort: PolicyEffort, model: str, force: str, seed: int, device: str
) -> PolicyTrainingConfig:
    """Return how a policy is trained: the recipe of docs/lab/policies.md.

    An ideal source is wrong by so much that its policies are better where the finger differs
    between worlds, as in the paper.
    """
    environment = EnvironmentConfig(
        worlds=effort.worlds, max_step=effort.max_step, force=force, goal_change=0.03
    )
    return PolicyTrainingConfig(
        environment=environment if model in IDEALS else replace(environment, randomise=NOMINAL),
        iterations=effort.iterations,
        steps=POLICY_STEPS,
        batch=effort.batch,
        epochs=4,
        learning_rate=1.0e-3,
        learning_rate_end=1.0e-4,
        exploration_end=0.2,
        discount=effort.discount,
        trace=effort.trace,
        seed=seed,
        device=device,
    )


def own_device(device: str, number: int) -> str:
    """Return the device of the policy with a number: several GPUs take turns."""
    if device == "cpu":
        return device
    import torch

    return f"cuda:{number % max(1, torch.cuda.device_count())}"


def differs_in(reproduction: Reproduction) -> str:
    """Say how the training differs from the paper's 105 million steps."""
    effort = reproduction.settings.policies
    if reproduction.policies or effort is None:
        return ""
    shortened = effort.samples < POLICIES["cuda"].samples
    seeds = f"seed{'s' if len(effort.seeds) > 1 else ''} {', '.join(map(str, effort.seeds))}"
    words = f"{1.0e-6 * effort.samples:.0f} million steps, {seeds}"
    return f"{words}, shortened" if shortened else words


def rows_of(errors: Errors, differs: str) -> list[Row]:
    """Return a row for each policy."""
    return [
        row(
            "policy on the stairs",
            f"{MODELS.get(name, name)}, tip RMSE",
            "mm",
            found,
            paper=PAPER_STAIRS.get(name),
            differs=differs,
        )
        for name, found in errors.items()
    ]


def reduction_rows(errors: Errors) -> list[Row]:
    """Return the rows of the reductions."""
    return [
        row(
            "policy on the stairs",
            f"{MODELS.get(name, name)}: less than the better ideal source's by",
            "%",
            found,
            paper=PAPER_REDUCTION if name == "network" else None,
        )
        for name, found in reductions(errors, IDEALS).items()
    ]


def reduction_text(errors: Errors) -> str:
    """Return the reductions with intervals over the benches."""
    lines = [
        "Tip error on the stairs below that of the better ideal source's policy on the same bench: "
        "mean over the benches and 95 % interval of that mean (Student's t).",
        "",
        "| trained on | less by |",
        "|---|---|",
    ]
    for name, found in reductions(errors, IDEALS).items():
        lines.append(f"| {MODELS.get(name, name)} | {mean_text(found)} |")
    return "\n".join(lines) if len(lines) > 4 else ""
