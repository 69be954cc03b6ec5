"""Let policies that turn a ball do so in simulation, and write what the balls did."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.turning_figures import TurningFigures
from tendon_newton.errors import InvalidParameter
from tendon_newton.workflows.options import ClimbOptions
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.scoring.policy_evaluation import RunnablePolicy
from tendon_train.policy.scoring.turning_score import as_trained, on_tensors, turning_worlds, watch

Row = tuple[str, str, TurningFigures]  # Policy, force model and figures


def compare_turning(
    options: ClimbOptions, policies: Sequence[RunnablePolicy], hand: str, out: Path
) -> tuple[str, tuple[Path, ...]]:
    """Watch each policy under each force model; return the table and the files that hold it.

    Args:
        hand: Their hand: an asset's name or a file.

    Raises:
        InvalidParameter: A policy does something else, or a bench is named.
    """
    if any(policy.card.task != "turn" for policy in policies):
        raise InvalidParameter("policies of one task can be compared; some turn a ball, others not")
    if options.port is not None or options.logs:
        raise InvalidParameter("a policy that turns a ball is compared in simulation only")
    rows = [
        (policy.name, Path(force).name, watched(options, policy, hand, force))
        for force in options.force
        for policy in policies
    ]
    text = to_markdown(options, rows)
    files = (out / "evaluation.json", out / "evaluation.md")
    write_json(files[0], to_table(options, policies, rows))
    write_text(files[1], text)
    return text, files


def watched(options: ClimbOptions, policy: RunnablePolicy, hand: str, force: str) -> TurningFigures:
    """Watch one policy turn balls."""
    config = EnvironmentConfig(
        task="turn", finger=hand, force=force, worlds=options.worlds, randomise=options.randomise
    )
    hands = turning_worlds(
        as_trained(policy.card, config),
        rate=options.rate,
        seconds=options.seconds,
        seed=options.seed,
        device=options.device,
    )
    return watch(hands, on_tensors(policy.run, hands.num_actions), options.seconds)


def to_markdown(options: ClimbOptions, rows: Sequence[Row]) -> str:
    """Return the table of the figures."""
    lines = [
        f"{options.worlds} hands, asked for {options.rate:g} rad/s for {options.seconds:g} s.",
        "",
        "| policy | force | turned [rad/min] | drops [1/min] | largest tension [N] |",
        "|---|---|---|---|---|",
    ]
    for name, force, figures in rows:
        lines.append(
            f"| {name} | {force} | {figures.turned_per_minute:.1f} "
            f"| {figures.drops_per_minute:.2f} | {figures.largest_tension:.1f} |"
        )
    return "\n".join(lines) + "\n"


def to_table(
    options: ClimbOptions, policies: Sequence[RunnablePolicy], rows: Sequence[Row]
) -> dict[str, Any]:
    """Return all numbers as JSON."""
    return {
        "rate_rad_s": options.rate,
        "policies": {each.name: json.loads(each.card.to_json()) for each in policies},
        "turns": [
            {"policy": name, "force": force, **{k: as_list(v) for k, v in asdict(figures).items()}}
            for name, force, figures in rows
        ],
    }


def as_list(value: Any) -> Any:
    """Return an array as a list, and any other value as it is."""
    return value.tolist() if isinstance(value, np.ndarray) else value
