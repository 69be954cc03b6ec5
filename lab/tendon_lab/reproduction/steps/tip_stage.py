"""The sim-to-real experiment: one sinusoid on the bench and in simulation, and the tips' distance.

The paper's sinusoid has an amplitude of pi/2 at 0.5 Hz; its centre is not said. About pi/2 no
command is negative, but by its data sheet the motor hardly follows at the paper's duty. About 0.2
rad the ideal source opens the finger fully, as in the paper.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tendon_lab.reproduction.closed_loop import SETTLED, replayed
from tendon_lab.reproduction.outcome import Figure, Outcome, Row, mean_text, reductions, row
from tendon_lab.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction
from tendon_newton.data.files.picture import GREY, INK, new_figure, save, tidy
from tendon_newton.data.recording import Recording

SINES = {"open_sine": "about 0.2 rad", "closing_sine": "about pi/2"}
"""Kind of the recording and its centre in words; the first is the one that is compared."""
PAPER_TIP = {"ideal": 14.58, "network": 8.61}  # [mm]
PAPER_REDUCTION = 41.0  # [%]
COLOURS = {
    "ideal": "#d1495b",
    "ideal_refitted": "#e8a0a8",
    "network": "#1764ab",
    "physical": "#2f8f5b",
}
SHOWN = 8.0  # Time that a figure shows [s]

Errors = dict[str, dict[str, list[float]]]  # Kind -> model -> tip error of each bench [mm]
Signals = list[list[float]]  # Height of the tip [mm], angle [rad] and tension [N] at every row


async def run(reproduction: Reproduction) -> Outcome:
    """Replay both sinusoids with every model on every bench."""
    items = [(place, model) for place in range(len(reproduction.units)) for model in MODELS]
    found = await reproduction.each(tip_errors, items)
    errors: Errors = {
        kind: {
            model: [own[kind] for (_, name), own in zip(items, found, strict=True) if name == model]
            for model in MODELS
        }
        for kind in SINES
    }
    draw({model: own["shown"] for model, own in zip(MODELS, found, strict=False)}, reproduction)
    return Outcome(
        rows=tuple(r for kind in SINES for r in rows_of(kind, errors[kind])),
        numbers={"tip_error_mm": errors, "benches": [unit.name for unit in reproduction.units]},
        figures=(
            Figure(
                file="tip_sine.png",
                caption=f"Tip during a sinusoid of pi/2 at 0.5 Hz about 0.2 rad, "
                f"{reproduction.units[0].name}. {reproduction.caption}",
            ),
        ),
        text=reduction_text(errors),
    )


def tip_errors(reproduction: Reproduction, item: tuple[int, str]) -> dict[str, Any]:
    """Replay the sinusoids of a bench with one of its models.

    Returns:
        Tip errors [mm] by kind of sinusoid and, of the first bench, what is drawn.
    """
    place, model = item
    unit = reproduction.units[place]
    reproduction.tell(f"  {unit.name}: {model}")
    runs = replayed(
        [unit.find("finger", kind) for kind in SINES],
        reproduction.model(unit, model),
        time_step=reproduction.settings.time_step,
    )
    errors = {kind: 1.0e3 * run.tip_error for kind, run in zip(SINES, runs, strict=True)}
    return errors | ({"shown": signals(runs[0].simulated)} if place == 0 else {})


def signals(recording: Recording) -> Signals:
    """Return what is drawn of a recording: height of the tip [mm], angle [rad], tension [N]."""
    assert recording.tip is not None
    assert recording.force is not None
    drawn = (1.0e3 * recording.tip[:, 1], recording.motor_position[:, 0], recording.force[:, 0])
    return [values.tolist() for values in drawn]


def rows_of(kind: str, errors: Mapping[str, list[float]]) -> list[Row]:
    """Return the rows of one sinusoid."""
    where = f"tip, sinusoid {SINES[kind]}"
    compared, less = kind == next(iter(SINES)), reductions(errors, IDEALS)
    rows = [
        row(
            where,
            f"{words}, RMSE",
            "mm",
            errors[model],
            paper=PAPER_TIP.get(model) if compared else None,
        )
        for model, words in MODELS.items()
    ]
    rows += [
        row(
            where,
            f"{MODELS[model]}: less than the better ideal source by",
            "%",
            less[model],
            paper=PAPER_REDUCTION if compared and model == "network" else None,
        )
        for model in BEST
    ]
    return rows


def reduction_text(errors: Errors) -> str:
    """Return the reductions with intervals over the benches."""
    lines = [
        "Tip error below that of the better ideal source of the same bench: mean over the benches "
        "and 95 % interval of that mean (Student's t).",
        "",
        f"| sinusoid | {' | '.join(MODELS[model] for model in BEST)} |",
        f"|---{'|---' * len(BEST)}|",
    ]
    for kind, words in SINES.items():
        less = reductions(errors[kind], IDEALS)
        lines.append(f"| {words} | {' | '.join(mean_text(less[model]) for model in BEST)} |")
    return "\n".join(lines)


def draw(shown: Mapping[str, Signals], reproduction: Reproduction) -> None:
    """Draw height of the tip, motor angle and tension of every model and of the bench."""
    figure: Any = new_figure(9.0, 8.0)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.4, 1, 1])
    tip, angle, force = panels
    bench = reproduction.units[0].find("finger", next(iter(SINES)))
    time = bench.time - bench.time[0]
    part = (time >= SETTLED) & (time < SETTLED + SHOWN)
    assert bench.command is not None
    angle.step(time[part], bench.command[part, 0], where="post", color=GREY, label="commanded")
    for name, drawn, colour in (
        ("bench", signals(bench), INK),
        *((MODELS[m], s, COLOURS[m]) for m, s in shown.items()),
    ):
        width = 2.4 if colour == INK else 1.1
        for axes, values in zip(panels, drawn, strict=True):
            label = name if axes is tip else None
            shown_part = np.array(values)[part]
            axes.plot(time[part], shown_part, label=label, color=colour, linewidth=width)
    for axes, label in ((tip, "tip z [mm]"), (angle, "angle [rad]"), (force, "tension [N]")):
        axes.set_ylabel(label)
        tidy(axes)
    tip.legend(frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    angle.legend(frameon=False, fontsize=8)
    force.set_xlabel("time [s]")
    save(figure, reproduction.folder("figures") / "tip_sine.png")
