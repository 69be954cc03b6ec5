"""The paper's comparison of force networks: steps on three setups, contact ramps, held sine."""

from __future__ import annotations

from tendon_newton.actuators.networks.artifact import NetworkFile, load_network
from tendon_newton.dataset import Dataset
from train.actuator.evaluation import Evaluation, evaluate
from train.actuator.evaluation_file import error_cell, experiment_rows, to_table
from train.actuator.figures import draw
from train.actuator.ideal import SERVO_LIMIT
from train.actuator.protocol import Experiment
from train.actuator.training_config import Kind
from train.reproduction.outcome import Figure, Outcome, Row, row
from train.reproduction.reproduction import Reproduction
from train.reproduction.unit import Unit

PAPER_STEPS = 0.61
"""The paper's Transformer on the steps, mean of three setups [N]."""
PAPER_CONTACT = {
    "contact_ramp": 0.79,
    "contact_ramp_tape_roll": 1.45,
    "contact_ramp_hand": 1.38,
    "closing_sine_hand_perturbation": 2.08,
}
"""The paper's Transformer on its ramps, free, half and fully blocked, and perturbed sine [N]."""
WORDS = {
    "steps.png": "Steps held for 2 s on three setups",
    "rmse_bars.png": "Errors by setup and hold; bars: standard deviation of the absolute error",
    "contact_ramps.png": "Ramps onto nothing, a roll of tape, and a hand",
    "perturbed_sine.png": "A sinusoid while a hand holds the finger now and then",
}


def run(reproduction: Reproduction) -> Outcome:
    """Predict the test recordings of every bench; the first one with every kind."""
    kinds = reproduction.settings.kinds
    evaluations = [
        evaluated(reproduction, unit, kinds[: None if place == 0 else 1])
        for place, unit in enumerate(reproduction.units)
    ]
    first = evaluations[0]
    files = draw(first, reproduction.folder("figures"))
    better = "the mean over three setups and holds of 1, 2 and 3 s"
    rows = [
        row("steps", f"{kinds[0]}, RMSE", "N", steps_of(evaluations, f"{kinds[0]} (paper)"),
            paper=PAPER_STEPS, differs=better),
        row("steps", "the same as a share of 21 N", "%",
            [100.0 * e / SERVO_LIMIT for e in steps_of(evaluations, f"{kinds[0]} (paper)")],
            paper=2.9),
        row("steps", "better ideal source, RMSE", "N",
            [better_ideal(evaluation) for evaluation in evaluations]),
        *(row("steps", f"{kind}, RMSE", "N", steps_of([first], f"{kind} (paper)"), over="bench")
          for kind in kinds[1:]),
        *contact_rows(evaluations, f"{kinds[0]} (paper)"),
    ]  # fmt: skip
    return Outcome(
        rows=tuple(rows),
        numbers={
            unit.name: to_table(evaluation)
            for unit, evaluation in zip(reproduction.units, evaluations, strict=True)
        },
        figures=tuple(
            Figure(
                file=file.name,
                caption=f"{WORDS[file.name]}, {reproduction.units[0].name}. {reproduction.caption}",
            )
            for file in files
        ),
        text=f"RMSE [N] on {reproduction.units[0].name}, along the measured motion:\n\n"
        + experiment_rows(first, error_cell),
    )


def evaluated(reproduction: Reproduction, unit: Unit, kinds: tuple[Kind, ...]) -> Evaluation:
    """Compare networks of a bench with each other and with the ideal source."""
    folder = reproduction.folder("networks", unit.name)
    networks: list[NetworkFile] = [
        load_network(folder / f"{reproduction.settings.training(kind).name}.pt") for kind in kinds
    ]
    dataset: Dataset = unit.dataset
    return evaluate(networks, dataset)


def steps_of(evaluations: list[Evaluation], family: str) -> list[float]:
    """Return a family's mean error over the step experiments of each bench [N]."""
    out = []
    for evaluation in evaluations:
        (model,) = [m for m in evaluation.models if m.family == family]
        error = evaluation.step_rmse(model.name)
        assert error is not None
        out.append(error)
    return out


def better_ideal(evaluation: Evaluation) -> float:
    """Return the lower of the ideal sources' errors on the steps [N]."""
    errors = [evaluation.step_rmse(m.name) for m in evaluation.models if m.gain is not None]
    return min(error for error in errors if error is not None)


def contact_rows(evaluations: list[Evaluation], family: str) -> list[Row]:
    """Return a row for each of the paper's contact experiments that was recorded."""
    rows = []
    for kind, paper in PAPER_CONTACT.items():
        experiment = Experiment(bench="finger", kind=kind)
        errors = [
            evaluation.family_result(family, experiment).rmse
            for evaluation in evaluations
            if experiment in evaluation.experiments
        ]
        if errors:
            words = kind.replace("_", " ")
            rows.append(row(words, "transformer, RMSE", "N", errors, paper=paper))
    return rows
