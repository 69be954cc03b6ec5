"""How models do with less data, ``python -m lab.studies.less_data OUT --jobs 2``.

OUT is the folder of a `tendon-newton reproduce` on virtual benches, to which neither causes nor
policies were given. Network, diagnosed model and hybrid of the first bench learn anew from its
first minutes; from a bench without the strong spring, which then tests them; and from motion in
which nothing was in the way, tested in contact. Prints closed-loop errors, and draws them over the
minutes into OUT/figures/data_curve.png.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_lab.reproduction.closed_loop import OBSTACLES, replayed
from tendon_lab.reproduction.outcome import Outcome, row
from tendon_lab.reproduction.physical import refit
from tendon_lab.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction
from tendon_lab.reproduction.reproduction_report import rows_table
from tendon_lab.reproduction.settings import PolicyEffort, ReproductionSettings
from tendon_lab.reproduction.steps.hybrid_stage import hybrid_of
from tendon_lab.reproduction.steps.network_stage import Aim, train
from tendon_lab.reproduction.steps.stage_list import MODELS as MADE
from tendon_lab.reproduction.steps.stage_list import (
    REPRODUCTION_STAGES,
    ReproductionStage,
    run_stages,
)
from tendon_lab.reproduction.steps.tip_stage import COLOURS, SINES
from tendon_lab.reproduction.unit import (
    Unit,
    beginning,
    interleaved,
    is_blocked,
    of_benches,
    representative,
)
from tendon_lab.reproduction.virtual_benches import VirtualBenches
from tendon_lab.verbs.reproduce import say
from tendon_newton.cli.terminal import Terminal
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.data.recording import Recording
from tendon_newton.scheduler import JobOptions, open_executor

WITHOUT_STRONG, FREE, MINUTES = "without_strong", "free", "_minutes"
SEEN = ("finger", "spring_weak")  # Benches of those that have never seen the strong spring
UNSEEN = "spring_strong"
POINTS = (1.0, 5.0, 15.0, 36.0)  # Minutes of recordings
AIMS: tuple[Aim, ...] = ("simulation", "correction")
TIP, STEPS = "tip_mm", "steps_n"


@dataclass(frozen=True)
class Part(Unit):
    """A bench of whose train recordings only some are known, and whose test recordings are not."""

    known: Dataset

    @property
    def dataset(self) -> Dataset:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The known recordings."""
        return self.known


def main() -> None:
    """Train on every part of the data, replay, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--scheduler")
    words = parser.parse_args()
    with open_executor(JobOptions(jobs=words.jobs, scheduler=words.scheduler)) as executor:
        reproduction = Reproduction(
            settings=settings_of(words.out),
            out=words.out,
            bench=VirtualBenches(operator=Terminal()),
            tell=say,
            executor=executor,
        )
        found = run_stages(reproduction, tuple(LESS), REPRODUCTION_STAGES | LESS)
    print(rows_table([row for name in LESS for row in found[name].rows]))


def settings_of(out: Path) -> ReproductionSettings:
    """Return the settings of a reproduction that has been run."""
    text = (out / "reproduction.json").read_text(encoding="utf-8")
    table = without_lists(json.loads(text)["settings"])
    if (effort := table.pop("policies")) is not None:
        effort = PolicyEffort(**without_lists(effort))
    return ReproductionSettings(**table, policies=effort)


def without_lists(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table whose lists are tuples."""
    return {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}


async def train_parts(reproduction: Reproduction) -> Outcome:
    """Train the networks of every part."""
    items = [(name, aim) for name in part_names(reproduction) for aim in AIMS]
    await reproduction.each(trained, items)
    return Outcome()


def trained(reproduction: Reproduction, item: tuple[str, Aim]) -> dict[str, Any]:
    """Train one network on a part of the data and return its numbers."""
    name, aim = item
    kind = reproduction.settings.kinds[0]
    return train(reproduction, part_named(reproduction, name), kind, aim)


async def curve(reproduction: Reproduction) -> Outcome:
    """Measure tip and steps after so many minutes."""
    found = await reproduction.each(errors_after, POINTS)
    draw(found, reproduction)
    rows = [
        row(f"{point:g} min of data", f"{MODELS[model]}, {what}", unit, [own[model][key]])
        for point, own in zip(POINTS, found, strict=True)
        for model in BEST
        for what, key, unit in (("tip RMSE", TIP, "mm"), ("steps, force RMSE", STEPS, "N"))
    ]
    return Outcome(rows=tuple(rows))


def errors_after(reproduction: Reproduction, point: float) -> dict[str, dict[str, float]]:
    """Return the errors by model and measure after some minutes of recordings."""
    unit, part = reproduction.units[0], f"{point:g}{MINUTES}"
    if part in part_names(reproduction):
        models = learned_from(reproduction, part)
    else:
        models = {name: reproduction.model(unit, name) for name in BEST}
    recordings = [unit.find("finger", next(iter(SINES))), *unit.steps()]
    errors = {}
    for name, model in models.items():
        tip, *steps = replayed(recordings, model, time_step=reproduction.settings.time_step)
        mean = float(np.mean([each.force_error for each in steps]))
        errors[name] = {TIP: 1.0e3 * tip.tip_error, STEPS: mean}
    return errors


async def spring(reproduction: Reproduction) -> Outcome:
    """Replay the strong spring's steps with models that have never seen it, and that have."""
    return await unseen(reproduction, WITHOUT_STRONG, "strong spring, steps")


async def contact(reproduction: Reproduction) -> Outcome:
    """Replay ramps onto obstacles with models that have never touched any, and that have."""
    return await unseen(reproduction, FREE, "ramps onto tape roll and hand")


async def unseen(reproduction: Reproduction, part: str, where: str) -> Outcome:
    """Compare models of a part of the data with those of all of it, where the part says nothing."""
    known = (*IDEALS, *BEST)
    seen = await reproduction.each(seen_errors, [(part, model) for model in known])
    (without,) = await reproduction.each(blind_errors, [part])
    rows = [
        *(
            row(where, f"{MODELS[model]}, all data: force RMSE", "N", own, over="runs")
            for model, own in zip(known, seen, strict=True)
        ),
        *(
            row(where, f"{MODELS[model]}, never seen: force RMSE", "N", without[model], over="runs")
            for model in BEST
        ),
    ]
    return Outcome(rows=tuple(rows))


def seen_errors(reproduction: Reproduction, item: tuple[str, str]) -> list[float]:
    """Return the errors [N] of a model of all data."""
    part, model = item
    return force_errors(reproduction, part, reproduction.model(reproduction.units[0], model))


def blind_errors(reproduction: Reproduction, part: str) -> dict[str, list[float]]:
    """Return the errors [N] of models of a part."""
    models = learned_from(reproduction, part)
    return {name: force_errors(reproduction, part, model) for name, model in models.items()}


def force_errors(reproduction: Reproduction, part: str, model: Model) -> list[float]:
    """Return the errors of the tension where a part of the data says nothing, RMS [N]."""
    unit = reproduction.units[0]
    recordings: Sequence[Recording] = (
        unit.steps(UNSEEN)
        if part == WITHOUT_STRONG
        else [unit.find("finger", f"contact_ramp_{name}") for name in OBSTACLES]
    )
    runs = replayed(recordings, model, time_step=reproduction.settings.time_step)
    return [run.force_error for run in runs]


def part_names(reproduction: Reproduction) -> tuple[str, ...]:
    """Return the names of all parts: so many minutes, two of three benches, free motion."""
    whole = reproduction.units[0].dataset
    points = [f"{point:g}{MINUTES}" for point in POINTS]
    less = [name for name in points if part_named(reproduction, name).known.train != whole.train]
    return (*less, WITHOUT_STRONG, FREE)


def part_named(reproduction: Reproduction, name: str) -> Part:
    """Return a part of the first bench's recordings."""
    unit = reproduction.units[0]
    whole = unit.dataset
    if name.endswith(MINUTES):
        known = shortened(whole, float(name.removesuffix(MINUTES)) * train_share(whole))
    else:
        known = of_benches(whole, SEEN) if name == WITHOUT_STRONG else free_only(whole)
    return Part(name=f"{unit.name}_{name}", folder=unit.folder, known=replace(known, test=()))


def train_share(dataset: Dataset) -> float:
    """Return which share of the minutes of a bench's recordings is there to learn from [1]."""
    train, test = (sum(r.duration for r in part) for part in (dataset.train, dataset.test))
    return train / (train + test)


def shortened(dataset: Dataset, minutes: float) -> Dataset:
    """Return a dataset with so many minutes of train recordings, every bench in proportion.

    Each bench keeps a recording for every half minute, at least two, all cut to one length.
    """
    total = sum(r.duration for r in dataset.train)
    share = min(1.0, 60.0 * minutes / total)
    if share == 1.0:
        return dataset
    kept: list[Recording] = []
    for bench in dict.fromkeys(r.bench for r in dataset.train):
        own = interleaved(r for r in dataset.train if r.bench == bench)
        kept += cut_to(own, share * sum(r.duration for r in own))
    return replace(dataset, train=tuple(kept))


def cut_to(recordings: Sequence[Recording], seconds: float) -> list[Recording]:
    """Return the first of some recordings, cut so that they last so long together."""
    count = max(2, round(seconds / 30.0))
    while sum(r.duration for r in recordings[:count]) < seconds and count < len(recordings):
        count += 1
    shortest_first = sorted(recordings[:count], key=lambda r: r.duration)
    kept = []
    for place, recording in enumerate(shortest_first):
        kept.append(beginning(recording, seconds / (len(shortest_first) - place)))
        seconds -= kept[-1].duration
    return kept


def free_only(dataset: Dataset) -> Dataset:
    """Return a dataset whose train recordings have nothing in the mechanism's way."""
    return replace(dataset, train=tuple(r for r in dataset.train if not is_blocked(r)))


def learned_from(reproduction: Reproduction, name: str) -> dict[str, Model]:
    """Return the network, the physical model and the hybrid that a part of the data gives.

    The causes of the physical model are those that were named on the first bench; their numbers
    are fitted to the part.
    """
    unit, settings = reproduction.units[0], reproduction.settings
    part = part_named(reproduction, name)
    reproduction.tell(f"  {part.name}: physics, and replays")
    known = replace(part, known=replace(part.known, test=unit.dataset.test))
    physical = refit(
        representative(known, settings.refit_seconds, settings.refit_kinds),
        reproduction.model(unit, "physical"),
    )
    network, servo = (load_model(reproduction.model_file(part, m)) for m in ("network", "servo"))
    hybrid = hybrid_of(servo, physical, known.dataset)
    return {"network": network, "physical": physical, "hybrid": hybrid}


def draw(found: Sequence[dict[str, dict[str, float]]], reproduction: Reproduction) -> None:
    """Draw both errors over the minutes."""
    figure: Any = new_figure(9.0, 3.6)
    panels = figure.subplots(1, 2)
    labels = {TIP: "tip error, RMS [mm]", STEPS: "force on the steps, RMS [N]"}
    for axes, (what, label) in zip(panels, labels.items(), strict=True):
        for model in BEST:
            values = [own[model][what] for own in found]
            axes.plot(POINTS, values, "o-", color=COLOURS[model], label=MODELS[model])
        axes.set_xscale("log")
        axes.set_xticks(POINTS, [f"{point:g}" for point in POINTS])
        axes.minorticks_off()
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("recordings [min]")
        axes.set_ylabel(label)
        tidy(axes)
    panels[0].legend(frameon=False, fontsize=8)
    save(figure, reproduction.folder("figures") / "data_curve.png")


LESS: dict[str, ReproductionStage] = {
    "parts": ReproductionStage(title="Networks on parts of the data", run=train_parts),
    "curve": ReproductionStage(title="How much data", run=curve, needs=("parts", *MADE)),
    "spring": ReproductionStage(title="A spring never seen", run=spring, needs=("parts", *MADE)),
    "contact": ReproductionStage(title="Contact never seen", run=contact, needs=("parts", *MADE)),
}

if __name__ == "__main__":
    main()
