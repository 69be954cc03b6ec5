"""Figures of an evaluation, after those of the paper."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tendon_lab.force_scoring.compared_models import Compared
from tendon_lab.force_scoring.force_evaluation import Evaluation
from tendon_lab.force_scoring.sample_protocol import HOLDS, Experiment, experiment_of
from tendon_newton.data.files.picture import COLOURS, GREY, INK, new_figure, save, tidy
from tendon_newton.data.root_mean_square import rms
from tendon_train.actuator.prediction import ForcePrediction

SHOWN_HOLD = 2.0  # Hold of the steps whose forces are drawn [s], as in the paper
HEADROOM = 1.3  # Height of a panel of forces over what is drawn in it [1]: room for the legend


def draw(evaluation: Evaluation, out: Path) -> list[Path]:
    """Draw every figure for which there are recordings and return the files."""
    files = []
    for name, experiments, figure_of in (
        ("steps.png", shown_steps(evaluation), draw_forces),
        ("rmse_bars.png", list(evaluation.step_experiments), draw_bars),
        ("contact_ramps.png", picked(evaluation, "is_contact_ramp"), draw_forces),
        ("perturbed_sine.png", picked(evaluation, "is_perturbed_sine"), draw_forces),
    ):
        if experiments:
            files.append(out / name)
            save(figure_of(evaluation, experiments), files[-1])
    return files


def shown_steps(evaluation: Evaluation) -> list[Experiment]:
    """Return the step experiments with the hold that is shown, or the longest one there is."""
    holds = [e.hold for e in evaluation.step_experiments]
    wanted = SHOWN_HOLD if SHOWN_HOLD in holds else next(reversed(holds), None)
    return [e for e in evaluation.step_experiments if e.hold == wanted]


def picked(evaluation: Evaluation, what: str) -> list[Experiment]:
    """Return the experiments that are of a kind."""
    return [e for e in evaluation.experiments if getattr(e, what)]


def draw_forces(evaluation: Evaluation, experiments: Sequence[Experiment]) -> Any:
    """Draw measured and predicted force over command and angle, a column per experiment."""
    figure = new_figure(max(11.0, 6.5 * len(experiments)), 6.0)
    panels = figure.subplots(2, len(experiments), sharex="col", squeeze=False, height_ratios=[2, 1])
    models = [evaluation.middle_model(family) for family in evaluation.families]
    for column, experiment in zip(panels.T, experiments, strict=True):
        draw_experiment(column, models, experiment)
        column[0].set_title(experiment.label, loc="left", fontsize=10)
        column[1].set_xlabel("time [s]")
    panels[0, 0].set_ylabel("tension [N]")
    panels[1, 0].set_ylabel("angle [rad]")
    panels[1, 0].legend(frameon=False, fontsize=8, ncols=2)
    return figure


def draw_experiment(panels: Any, models: Sequence[Compared], experiment: Experiment) -> None:
    """Draw one experiment's first recording."""
    measured = first_prediction(models[0], experiment)
    recording = measured.recording
    panels[0].plot(
        measured.time, measured.measured, color=INK, linewidth=2.6, alpha=0.45, label="measured"
    )
    for place, model in enumerate(models):
        prediction = first_prediction(model, experiment)
        gain = "" if model.gain is None else f", P = {model.gain:.2f}"
        error = rms(prediction.error)
        style = "--" if model.network is None else "-"
        label = f"{model.family}{gain}: {error:.2f} N"
        panels[0].plot(
            prediction.time,
            prediction.predicted,
            style,
            linewidth=1.1,
            color=colour(place, model),
            label=label,
        )
    panels[0].set_ylim(top=HEADROOM * panels[0].get_ylim()[1])
    panels[0].legend(frameon=False, fontsize=7, loc="upper right", ncols=2)
    assert recording.command is not None
    panels[1].step(
        recording.time,
        recording.command[:, 0],
        where="post",
        color=GREY,
        linewidth=1.0,
        label="commanded",
    )
    panels[1].plot(
        recording.time, recording.motor_position[:, 0], color=INK, linewidth=1.2, label="measured"
    )
    for axes in panels:
        tidy(axes)
        axes.margins(x=0.0)


def draw_bars(evaluation: Evaluation, experiments: Sequence[Experiment]) -> Any:
    """Draw the error of every family by bench and hold, with the spread of the absolute error."""
    benches = list(dict.fromkeys(e.bench for e in experiments))
    figure = new_figure(5.0 * len(benches), 4.2)
    panels = figure.subplots(1, len(benches), sharey=True, squeeze=False)[0]
    families = evaluation.families
    width = 0.8 / len(families)
    for axes, bench in zip(panels, benches, strict=True):
        for place, family in enumerate(families):
            model = evaluation.middle_model(family)
            own = [e for e in experiments if e.bench == bench]
            found = [evaluation.family_result(family, e) for e in own]
            places = np.array([HOLDS.index(e.hold or 0.0) for e in own]) + width * place
            axes.bar(
                places,
                [f.rmse for f in found],
                width,
                color=colour(place, model),
                hatch="//" if model.network is None else "",
                edgecolor="white",
                yerr=[f.error_spread for f in found],
                capsize=2,
                label=family,
                error_kw={"elinewidth": 0.8, "ecolor": INK},
            )
        axes.set_title(bench, loc="left", fontsize=10)
        axes.set_xticks(np.arange(len(HOLDS)) + 0.4 - width / 2, [f"{h:g}" for h in HOLDS])
        axes.set_xlabel("hold [s]")
        tidy(axes)
    panels[0].set_ylim(bottom=0.0)  # once all is drawn: the panels share it
    panels[0].set_ylabel("force error, RMS [N]")
    panels[0].legend(frameon=False, fontsize=7)
    return figure


def first_prediction(model: Compared, experiment: Experiment) -> ForcePrediction:
    """Return a model's prediction on the first recording of an experiment."""
    return next(p for p in model.predictions if experiment_of(p.recording) == experiment)


def colour(place: int, model: Compared) -> str:
    """Return the colour of a family; ideal sources are grey."""
    if model.network is None:
        return GREY if model.name == "ideal" else INK
    return COLOURS[place % len(COLOURS)]
