"""The paper's comparison of force networks: steps on three setups, contact ramps, held sine."""

from collections.abc import Mapping, Sequence
from typing import Any

from tendon_lab.force_scoring.evaluation_file import experiment_rows, to_table
from tendon_lab.force_scoring.force_evaluation import Evaluation, evaluate
from tendon_lab.force_scoring.sample_protocol import Experiment
from tendon_lab.reproduction.outcome import Outcome, Row, row
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_newton.actuators.networks.artifact import load_network
from tendon_train.actuator.training_config import SERVO_LIMIT

PAPER_STEPS = 0.61  # The paper's Transformer on the steps, mean of three setups [N]
PAPER_CONTACT = {
    "contact_ramp": 0.79,
    "contact_ramp_tape_roll": 1.45,
    "contact_ramp_hand": 1.38,
    "closing_sine_hand_perturbation": 2.08,
}
"""The paper's Transformer on its ramps, free, half and fully blocked, and perturbed sine [N]."""


def run(reproduction: Reproduction) -> Outcome:
    """Predict the test recordings of every bench; the first one with every kind."""
    kinds, units = reproduction.settings.kinds, reproduction.units
    found = reproduction.each(evaluated, range(len(units)))
    first = found[0]
    better = "the mean over three setups and holds of 1, 2 and 3 s"
    steps = [own["steps"][kinds[0]] for own in found]
    rows = [
        row("steps", f"{kinds[0]}, RMSE", "N", steps, paper=PAPER_STEPS, differs=better),
        row(
            "steps",
            "the same as a share of 21 N",
            "%",
            [100.0 * e / SERVO_LIMIT for e in steps],
            paper=2.9,
        ),
        row("steps", "better ideal source, RMSE", "N", [own["ideal"] for own in found]),
        *(
            row("steps", f"{kind}, RMSE", "N", [first["steps"][kind]], over="bench")
            for kind in kinds[1:]
        ),
        *contact_rows([own["contact"] for own in found]),
    ]
    return Outcome(
        rows=tuple(rows),
        numbers={unit.name: own["table"] for unit, own in zip(units, found, strict=True)},
        text=f"RMSE [N] on {units[0].name}, along the measured motion:\n\n{first['text']}",
    )


def evaluated(reproduction: Reproduction, place: int) -> dict[str, Any]:
    """Compare networks of a bench with each other and with the ideal source.

    Returns:
        Errors [N], the evaluation as JSON, and its table.
    """
    unit = reproduction.units[place]
    kinds = reproduction.settings.kinds[: None if place == 0 else 1]
    folder = reproduction.folder("networks", unit.name)
    names = [reproduction.settings.training(kind).name for kind in kinds]
    evaluation = evaluate([load_network(folder / f"{name}.pt") for name in names], unit.dataset)
    return {
        "table": to_table(evaluation),
        "steps": {kind: steps_of(evaluation, f"{kind} (paper)") for kind in kinds},
        "ideal": better_ideal(evaluation),
        "contact": contact_errors(evaluation, f"{kinds[0]} (paper)"),
        "text": experiment_rows(evaluation),
    }


def steps_of(evaluation: Evaluation, family: str) -> float:
    """Return a family's mean error over the step experiments [N]."""
    (model,) = [m for m in evaluation.models if m.family == family]
    error = evaluation.step_rmse(model.name)
    assert error is not None
    return error


def better_ideal(evaluation: Evaluation) -> float:
    """Return the lower of the ideal sources' errors on the steps [N]."""
    errors = [evaluation.step_rmse(m.name) for m in evaluation.models if m.gain is not None]
    return min(error for error in errors if error is not None)


def contact_errors(evaluation: Evaluation, family: str) -> dict[str, float]:
    """Return a family's error [N] in each of the paper's contact experiments that was recorded."""
    experiments = {kind: Experiment(bench="finger", kind=kind) for kind in PAPER_CONTACT}
    return {
        kind: evaluation.family_result(family, experiment).rmse
        for kind, experiment in experiments.items()
        if experiment in evaluation.experiments
    }


def contact_rows(found: Sequence[Mapping[str, float]]) -> list[Row]:
    """Return a row for each of the paper's contact experiments that was recorded."""
    rows = []
    for kind, paper in PAPER_CONTACT.items():
        errors = [own[kind] for own in found if kind in own]
        if errors:
            words = kind.replace("_", " ")
            rows.append(row(words, "transformer, RMSE", "N", errors, paper=paper))
    return rows
