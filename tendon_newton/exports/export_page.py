"""The page beside an export: how to load it, how far it strays, what it leaves out."""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tendon_newton.data.files.text_file import write_text
from tendon_newton.exports.departure import Departure, departure, replayed, with_and_without
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.source import Source
from tendon_newton.simulation.hosts.rollout import Trajectory

PAGE, NUMBERS = "README.md", "replay.json"


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """How far an export strays from our own simulation."""

    runs: tuple[str, ...]  # Names of the recordings that were replayed
    replays: Mapping[str, Departure]  # Departure of each way of running it
    costs: Mapping[str, Mapping[str, Departure]]  # What each effect is worth that a way leaves out


def measure(
    target: ExportTarget,
    exported: Exported,
    source: Source,
    *,
    trust: bool = False,
    progress: Callable[[float], None],
) -> Fidelity:
    """Replay recordings in the target and in our own simulation.

    `progress` is told of each replay how long it was [s].
    """

    def replay_by(way: str) -> list[Trajectory]:
        out: list[Trajectory] = []
        for run in runs:
            out += replayed(target, exported, way, model, [run])
            progress(run.duration)
        return out

    mechanism, model, runs = source.mechanism, source.model, source.runs
    left_out = sorted({name for names in exported.left_out.values() for name in names})
    ours, without = with_and_without(model, runs, left_out, trust=trust)
    worth = {name: departure(mechanism, fewer, ours) for name, fewer in without.items()}
    return Fidelity(
        runs=tuple(run.name for run in runs),
        replays={way: departure(mechanism, replay_by(way), ours) for way in exported.replays},
        costs={
            way: {name: worth[name] for name in names}
            for way, names in exported.left_out.items()
            if names
        },
    )


def write_page(folder: Path, title: str, exported: Exported, fidelity: Fidelity) -> None:
    """Write the page, and its numbers for programs.

    Raises:
        InvalidOutput: A file cannot be written.
    """
    files = ", ".join(f"`{path.name}`" for path in exported.files)
    lines = [f"# {title}", "", f"Files: {files}.", "", "## How to load it", "", exported.loading]
    page = "\n".join([*lines, *fidelity_part(fidelity, exported.checked), *costs_part(fidelity)])
    numbers: dict[str, Any] = {
        "runs": fidelity.runs,
        "replay": {way: asdict(d) for way, d in fidelity.replays.items()},
        "left_out": {
            way: {name: asdict(d) for name, d in costs.items()}
            for way, costs in fidelity.costs.items()
        },
    }
    write_text(folder / PAGE, page + "\n")
    write_text(folder / NUMBERS, json.dumps(numbers, indent=2) + "\n")


def fidelity_part(fidelity: Fidelity, checked: str) -> list[str]:
    """Tell how far each way of running it strays, or what was checked instead."""
    if not fidelity.replays:
        return ["", "## How far it strays", "", checked]
    rows = [f"| {way} | {d.text} |" for way, d in fidelity.replays.items()]
    return [
        "",
        "## How far it strays",
        "",
        f"Root mean squares against our own simulation of the same commands, over "
        f"{len(fidelity.runs)} runs ({', '.join(fidelity.runs[:6])}):",
        "",
        "| run by | motor angle | force | tip |",
        "|---|---|---|---|",
        *rows,
    ]


def costs_part(fidelity: Fidelity) -> list[str]:
    """Tell what each way leaves out, and what that is worth."""
    out = ["", "## What it leaves out", ""]
    if not fidelity.costs:
        return [*out, "Nothing of this model."]
    out += [
        "How far our own simulation strays without the effect, on the same commands. Effects that",
        "are only nearly the same stand here as well.",
        "",
        "| run by | effect | motor angle | force | tip |",
        "|---|---|---|---|---|",
    ]
    return out + [
        f"| {way} | {name} | {d.text} |"
        for way, costs in fidelity.costs.items()
        for name, d in costs.items()
    ]
