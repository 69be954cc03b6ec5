"""The page beside an export: how to load it, how far it strays, what it leaves out."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.recording import Recording
from tendon_newton.exports.departure import (
    Departure,
    departure,
    has_numbers,
    replayed,
    with_and_without,
)
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.source import Source
from tendon_newton.simulation.hosts.rollout import Trajectory

PAGE, NUMBERS = "README.md", "replay.json"
COUNT, NOISE = 1.5e-3, 0.05  # One count of a servo's encoder [rad], and a load cell's noise [N]
ROUND_OFF = 1.0e-3  # What steps and solvers leave of a tension that is none [N]
NOT_RUN = "It was not run: the program that reads these files is not installed here."


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """How far an export strays from our own simulation."""

    runs: tuple[str, ...]  # Names of the recordings that were replayed
    replays: Mapping[str, Departure]  # Departure of each way of running it
    costs: Mapping[str, Mapping[str, Departure]]  # What each effect is worth that a way leaves out
    # Names of those with numbers of their own, replayed in files that were written with these
    stated: tuple[str, ...] = ()
    # Departure of each way on a sine, by the sine's frequency
    sines: Mapping[str, Mapping[str, Departure]] = field(
        default_factory=dict[str, Mapping[str, Departure]]
    )


def measure(
    target: ExportTarget,
    exported: Exported,
    source: Source,
    *,
    trust: bool = False,
    progress: Callable[[float], None],
) -> Fidelity:
    """Replay recordings, and sines of some frequencies, in the target and in our own simulation.

    `progress` is told of each replay how long it was [s].
    """

    def replay_by(way: str, asked: Sequence[Recording]) -> list[Trajectory]:
        out: list[Trajectory] = []
        for run in asked:
            out += replayed(target, exported, way, model, [run])
            progress(run.duration)
        return out

    mechanism, model, runs = source.mechanism, source.model, source.runs
    left_out = sorted({name for names in exported.left_out.values() for name in names})
    ours, without = with_and_without(model, runs, left_out, trust=trust)
    worth = {name: departure(mechanism, fewer, ours) for name, fewer in without.items()}
    waves = source.sines if exported.replays else {}
    swung, _ = with_and_without(model, [*waves.values()], (), trust=trust)
    return Fidelity(
        runs=tuple(run.name for run in runs),
        stated=tuple(run.name for run in runs if has_numbers(run)),
        replays={way: departure(mechanism, replay_by(way, runs), ours) for way in exported.replays},
        costs={
            way: {name: worth[name] for name in names}
            for way, names in exported.left_out.items()
            if names
        },
        sines={
            way: {
                name: departure(mechanism, replay_by(way, [wave]), [own])
                for (name, wave), own in zip(waves.items(), swung, strict=True)
            }
            for way in exported.replays
        },
    )


def write_page(folder: Path, title: str, exported: Exported, fidelity: Fidelity) -> None:
    """Write the page, and its numbers for programs.

    Raises:
        InvalidOutput: A file cannot be written.
    """
    files = ", ".join(f"`{path.name}`" for path in exported.files)
    lines = [f"# {title}", "", f"Files: {files}.", "", "## How to load it", "", exported.loading]
    lines += [*fidelity_part(fidelity), *costs_part(fidelity, exported)]

    def numbers_of(tables: Mapping[str, Mapping[str, Departure]]) -> dict[str, Any]:
        return {way: {k: asdict(d) for k, d in row.items()} for way, row in tables.items()}

    numbers: dict[str, Any] = {
        "runs": fidelity.runs,
        "stated": fidelity.stated,
        "replay": {way: asdict(d) for way, d in fidelity.replays.items()},
        "sines": numbers_of(fidelity.sines),
        "left_out": numbers_of(fidelity.costs),
    }
    write_text(folder / PAGE, "\n".join(lines) + "\n")
    write_text(folder / NUMBERS, json.dumps(numbers, indent=2) + "\n")


def fidelity_part(fidelity: Fidelity) -> list[str]:
    """Tell how far each way of running it strays."""
    if not fidelity.replays:
        return ["", "## How far it strays", "", NOT_RUN]
    names = ", ".join(fidelity.runs[:6])
    rows = [(way, f"{len(fidelity.runs)} runs ({names})", d) for way, d in fidelity.replays.items()]
    rows += [
        (way, f"sine of {k}", d) for way, own in fidelity.sines.items() for k, d in own.items()
    ]
    own = [
        f"{name} states numbers of its own, and was replayed in files with these: the files here "
        "have the model's and the asset's."
        for name in fidelity.stated
    ]
    return [
        "",
        "## How far it strays",
        "",
        "Root mean squares against our own simulation of the same commands:",
        "",
        "| run by | commands | motor angle | force | tip |",
        "|---|---|---|---|---|",
        *(f"| {way} | {what} | {d.text} |" for way, what, d in rows),
        *(line for told in (*own, *push_lines(fidelity)) for line in ("", f"**{told}**")),
    ]


def push_lines(fidelity: Fidelity) -> list[str]:
    """Say of each way in which a string pushes how hard, and on which commands."""
    out = []
    for way, own in fidelity.replays.items():
        every = {"the runs": own} | {
            f"the sine of {name}": d for name, d in fidelity.sines.get(way, {}).items()
        }
        most = max(every, key=lambda name: every[name].push)
        if every[most].push > ROUND_OFF:
            out.append(f"{way}: a string pushes with up to {every[most].push:.2g} N in {most}.")
    return out


def costs_part(fidelity: Fidelity, exported: Exported) -> list[str]:
    """Tell what each way leaves out or has in another form, and what that is worth."""
    out = ["", "## What it leaves out", ""]
    if fidelity.costs:
        out += [
            "How far our own simulation strays without the effect, on the same commands:",
            "",
            "| run by | effect | there | motor angle | force | tip |",
            "|---|---|---|---|---|---|",
        ]
    for way, costs in fidelity.costs.items():
        form = exported.nearly.get(way, ())
        out += [
            f"| {way} | {name} | {'in another form' if name in form else 'left out'} | {d.text} |"
            for name, d in costs.items()
        ]
    ways = [way for way in {**exported.replays, **exported.left_out} if way not in fidelity.costs]
    out += [""] * bool(fidelity.costs and ways)
    for way in ways:
        strays = way in fidelity.replays and beyond(fidelity, way)
        out.append(
            f"{way}: no effect of this model."
            + (" How its servo, its string and its steps differ is in the table above." * strays)
        )
    return out


def beyond(fidelity: Fidelity, way: str) -> bool:
    """Tell whether a way strays by more than an encoder's count or a load cell's noise."""
    every = [fidelity.replays[way], *fidelity.sines.get(way, {}).values()]
    return any(d.angle > COUNT or (d.force or 0.0) > NOISE for d in every)


def told_lines(fidelity: Fidelity, exported: Exported) -> list[str]:
    """Return what a terminal shows: how far each way strays, and what it does not have."""
    lines = [f"  {way:24s} {d.text}" for way, d in fidelity.replays.items()]
    for way, own in fidelity.sines.items():
        lines += [f"  {way:24s} {d.text}, sine of {name}" for name, d in own.items()]
    lines += [f"  {line}" for line in push_lines(fidelity)]
    lines += [] if fidelity.replays else [f"  {NOT_RUN}"]
    for way, costs in fidelity.costs.items():
        form = exported.nearly.get(way, ())
        left = [name for name in costs if name not in form]
        lines += [f"  {way} leaves out: {', '.join(left)}"] * bool(left)
        lines += [f"  {way} has in another form: {', '.join(form)}"] * bool(form)
    return lines
