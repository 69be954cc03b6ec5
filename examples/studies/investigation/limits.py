"""Do optimised commands keep the limits of a bench?

Each command is simulated under models that are drawn anew from the intervals of an investigation's
sets, twice as wide, and is recorded on its virtual unit.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from examples.studies.so101_figure import AFTER, BEFORE, GREY, INK, dress
from tendon_hardware.benches.bench import open_bench
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.excitation_plan import DesignedRun
from tendon_hardware.errors import SafetyStop
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.excitations import DESIGNED, LARGEST_COMMAND
from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.files.picture import new_figure, save
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, Forecast, plan_of
from tendon_newton.diagnosis.next_experiment.investigation_log import InvestigationLog, read_log
from tendon_newton.diagnosis.next_experiment.run_design import design
from tendon_newton.diagnosis.next_experiment.worst_case import WorstCase
from tendon_newton.errors import InvalidOutput
from tendon_newton.workflows.collection import address_of, settings_of
from tendon_newton.workflows.investigating.investigation import LOG, open_sets
from tendon_newton.workflows.investigating.investigation_check import binding
from tendon_newton.workflows.investigating.investigation_choice import (
    FORCE_SHARE,
    RECORDINGS,
    task_of,
)
from tendon_newton.workflows.options import InvestigateOptions
from tests.hardware.silent_operator import SilentOperator

MODELS = 64  # Models under which each command is simulated; the search itself draws twice as many
TENSION = 30.0  # Limit of the tension [N]
PROMISE = "peaks of designed commands are a JSON file"


@dataclass(frozen=True, kw_only=True)
class Peak:
    """The largest tension of an optimised command."""

    seed: int  # Of its search
    rank: int
    """Place among the commands of its search; 0 is the one that an investigation would record."""
    moment: str  # Investigation, and how many runs it had recorded
    bench: str
    command: tuple[float, float]  # Its smallest and greatest angle [rad]
    designed: float  # Under the models of the search [N]
    drawn: float  # Under models that are drawn anew [N]
    recorded: float | None  # On the virtual unit [N]; None where the run was ended
    fault: str | None  # Why it was


def limits(folders: Sequence[Path], seeds: Sequence[int], out: Path, *, wall: float) -> None:
    """Design runs anew for each moment of investigations, and write how hard each pulls.

    A search that is in the file already is not made again.

    Args:
        folders: Investigations.
        seeds: One search each: of the first investigations, then of their next runs.
        out: File of the results.
        wall: Time after which no further search is begun [s].
    """
    start = time.monotonic()
    searched, peaks = read_peaks([out]) if out.exists() else ([], [])
    for seed in seeds:
        if seed in searched:
            continue
        if time.monotonic() - start > wall:
            break
        folder = folders[seed % len(folders)]
        peaks += search(folder, seed // len(folders), seed)
        searched.append(seed)
        write_json(out, {"searched": searched, "peaks": [asdict(peak) for peak in peaks]})
        print(f"  search {seed}: {len(peaks)} commands; {folder}", flush=True)


def search(folder: Path, moment: int, seed: int) -> list[Peak]:
    """Design runs as an investigation did, with other draws; return how hard each may pull.

    Args:
        folder: The investigation.
        moment: Which of its designed runs was next; beyond the last they are taken in turn.
        seed: Draws commands and models.
    """
    options, log = of_folder(folder)
    designed = [k for k, step in enumerate(log.steps) if step.expected is not None]
    before = replace(log, steps=log.steps[: designed[moment % len(designed)]])
    question = open_sets(before, options)
    assert question is not None  # a run was designed for it
    known = load_dataset(folder / RECORDINGS).train[: before.runs]
    forecast = Forecast(question, [plan_of(r) for r in known], task_of(options))
    runs = design(
        forecast,
        [Setting(bench=bench) for bench in options.benches],
        np.random.default_rng(seed),
        duration=options.run_length,
        force_limit=FORCE_SHARE * options.force_limit,
    ).runs
    plans = [e.plan for e in runs]
    worst = WorstCase(question, np.random.default_rng([1, seed]))
    drawn = worst.drawn(plans, MODELS).tolist() if plans else []
    return [
        Peak(
            seed=seed,
            rank=rank,
            moment=f"{folder.name}, {before.runs} runs",
            bench=plan.setting.bench,
            command=(float(plan.command.min()), float(plan.command.max())),
            designed=expected.peak_force or 0.0,
            drawn=peak,
            **recorded(expected, options),
        )
        for rank, (expected, plan, peak) in enumerate(zip(runs, plans, drawn, strict=True))
    ]


def of_folder(folder: Path) -> tuple[InvestigateOptions, InvestigationLog]:
    """Return the options and the log of an investigation of a virtual unit."""
    own = read_json(folder / LOG, InvalidOutput, "a log is a JSON file")["options"]
    options = InvestigateOptions(
        port=own["port"],
        out=folder,
        run_length=own["run-length"],
        force_limit=TENSION,
        faster_than_real_time=True,
    )
    return options, read_log(folder / LOG, binding(options))


def recorded(expected: Expected, options: InvestigateOptions) -> dict[str, Any]:
    """Record a command on the unit that the investigation is of."""
    plan = expected.plan
    run = DesignedRun(
        name="run",
        bench=plan.setting.bench,
        excitation=DESIGNED,
        duration=plan.duration,
        angles=tuple(plan.command.tolist()),
    )
    address = address_of(options, run.bench, port=options.port, load_cell_rate=20)
    greatest, fault = 0.0, None
    with (
        TemporaryDirectory() as folder,
        StopRequest() as stop,
        open_bench(address, lambda _: None) as bench,
    ):
        advance = bench.controls.advance  # pyright: ignore

        def watched(time: float) -> None:
            nonlocal greatest
            advance(time)
            greatest = max(greatest, bench.controls.state().tension)  # pyright: ignore

        bench.controls.advance = watched  # pyright: ignore
        path = Path(folder) / "run.mcap"
        try:
            settings = settings_of(options, seed=0)
            fault = record_run(bench, run, settings, path, SilentOperator(), stop).fault
        except SafetyStop as error:
            fault = error
    return {"recorded": greatest, "fault": None if fault is None else str(fault)}


def read_peaks(paths: Sequence[Path]) -> tuple[list[int], list[Peak]]:
    """Read what `limits` wrote: seeds of the searches, and the commands that they kept."""
    tables = [read_json(path, InvalidOutput, PROMISE) for path in paths]
    return [seed for table in tables for seed in table["searched"]], [
        Peak(**{**row, "command": tuple(row["command"])})
        for table in tables
        for row in table["peaks"]
    ]


def limits_table(searched: Sequence[int], peaks: Sequence[Peak]) -> str:
    """Return how many commands pass a limit, of all and of the best of each search."""
    best = [peak for peak in peaks if peak.rank == 0]
    angles = [a for peak in peaks for a in peak.command]
    outside = sum(not 0.0 <= a <= LARGEST_COMMAND for a in angles)
    lines = [
        f"{len(searched)} searches, {len(searched) - len(best)} of them kept no command",
        f"{outside} of {len(peaks)} commands leave 0 to {LARGEST_COMMAND:.3f} rad",
    ]
    for what, some in ((f"{len(peaks)} commands", peaks), (f"{len(best)} best ones", best)):
        for word in ("designed", "drawn", "recorded"):
            forces = [float(getattr(peak, word)) for peak in some]
            over = sum(force >= TENSION for force in forces)
            lines.append(
                f"{what}, {word}: median {np.median(forces):.2f} N, most {max(forces):.2f} N, "
                f"{over} beyond {TENSION:g} N"
            )
    lines.append(f"the bench ended {sum(peak.fault is not None for peak in peaks)} of the runs")
    return "\n".join(lines)


def draw_limits(peaks: Sequence[Peak], path: Path) -> None:
    """Draw how many commands stay below a tension, in the three ways of looking."""
    figure = new_figure(6.0, 3.2)
    axes = figure.subplots()
    ways = (
        ("designed", BEFORE, "worst model of the search"),
        ("drawn", INK, f"worst of {MODELS} models drawn anew"),
        ("recorded", AFTER, "the virtual unit"),
    )
    for word, colour, label in ways:
        forces = sorted(float(getattr(peak, word)) for peak in peaks)
        axes.step(forces, range(1, len(forces) + 1), where="post", color=colour, label=label)
    axes.axvline(TENSION, color=GREY, linestyle="--", label="limit")
    dress(axes, "largest tension [N]", "commands")
    path.parent.mkdir(parents=True, exist_ok=True)
    save(figure, path, dpi=120)
