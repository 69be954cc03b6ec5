"""An evaluation as JSON, with every number, and as tables to read."""

from dataclasses import asdict
from typing import Any

from tendon_lab.force_scoring.compared_models import Compared
from tendon_lab.force_scoring.force_evaluation import Evaluation, FamilyResult
from tendon_train.actuator.training_config import SERVO_LIMIT

SCHEMA = 3


def to_table(evaluation: Evaluation) -> dict[str, Any]:
    """Return everything that was found, as JSON has it; forces in N."""
    return {
        "schema": SCHEMA,
        "noise_floor_n": evaluation.noise_floor,
        "share_of_n": SERVO_LIMIT,
        "better_ideal": evaluation.better_ideal,
        "models": [model_table(evaluation, model) for model in evaluation.models],
        "experiments": [
            {
                **asdict(experiment),
                "models": {
                    r.model: asdict(r.score)
                    for r in evaluation.results
                    if r.experiment == experiment
                },
                "families": {
                    family: asdict(evaluation.family_result(family, experiment))
                    for family in evaluation.families
                },
            }
            for experiment in evaluation.experiments
        ],
    }


def model_table(evaluation: Evaluation, model: Compared) -> dict[str, Any]:
    """Return what a model is and how it did over all."""
    table: dict[str, Any] = {
        "name": model.name,
        "family": model.family,
        "steps_rmse": evaluation.step_rmse(model.name),
        "pooled": asdict(evaluation.pooled[model.name]),
    }
    if model.network is not None:
        card = model.network.card
        table |= {
            "sha256": model.network.sha256,
            "file_bytes": model.network.path.stat().st_size,
            "parameter_count": card.parameter_count,
            "seed": card.training.seed,
            "window": card.window,
            "rate_hz": card.rate,
            "git_commit": card.training.git_commit,
        }
    return table | ({} if model.gain is None else {"gain_n_per_rad": model.gain})


def to_markdown(evaluation: Evaluation) -> str:
    """Return the tables that a reader wants."""
    return (
        "\n\n".join(
            [
                "# Force networks on held-out recordings",
                closing_words(evaluation),
                "## All models",
                overview(evaluation),
                "## Error by experiment: RMSE [N], ± standard deviation over seeds",
                experiment_rows(evaluation),
            ]
        )
        + "\n"
    )


def closing_words(evaluation: Evaluation) -> str:
    """Say in a sentence or two what the noise is and what has to be beaten."""
    better = evaluation.better_ideal
    noise = evaluation.noise_floor
    floor = "unknown" if noise is None else f"{noise:.3f} N"
    return (
        f"The load cell's noise is {floor}. The better of the ideal sources is "
        f"*{better}*, {evaluation.pooled[better].rmse:.3f} N over all rows: a network has to win "
        f"against that one. Shares are of {SERVO_LIMIT:g} N."
    )


def overview(evaluation: Evaluation) -> str:
    """Return a row per model."""
    better = evaluation.pooled[evaluation.better_ideal].rmse
    lines = [
        "| model | numbers | steps, mean RMSE [N] | share | all rows, RMSE [N] | of better ideal |",
        "|---|---|---|---|---|---|",
    ]
    for model in evaluation.models:
        steps = evaluation.step_rmse(model.name)
        share = "" if steps is None else f"{100.0 * steps / SERVO_LIMIT:.2f} %"
        pooled = evaluation.pooled[model.name].rmse
        numbers = f"P = {model.gain:.2f} N/rad" if model.gain is not None else ""
        if model.network is not None:
            numbers = f"{model.network.card.parameter_count:,}"
        lines.append(
            f"| {model.name} | {numbers} | {'' if steps is None else f'{steps:.3f}'} | {share} "
            f"| {pooled:.3f} | {100.0 * pooled / better:.0f} % |"
        )
    return "\n".join(lines)


def experiment_rows(evaluation: Evaluation) -> str:
    """Return the errors, a row per experiment and a column per family."""
    families = evaluation.families
    lines = [f"| experiment | {' | '.join(families)} |", f"|---{'|---' * len(families)}|"]
    steps = evaluation.step_experiments
    ordered = (*steps, *(e for e in evaluation.experiments if e not in steps))
    for experiment in ordered:
        cells = [error_cell(evaluation.family_result(family, experiment)) for family in families]
        lines.append(f"| {experiment.label} | {' | '.join(cells)} |")
    return "\n".join(lines)


def error_cell(result: FamilyResult) -> str:
    """Write an error."""
    spread = f" ± {result.rmse_spread:.3f}" if result.count > 1 else ""
    return f"{result.rmse:.3f}{spread}"
