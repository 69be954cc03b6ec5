"""Do optimised commands keep the limits of a bench?

Each command is simulated under models that are drawn anew from the intervals of a diagnosis, twice
as wide, and is recorded on the virtual unit that the diagnosis is of.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from examples.studies.so101_figure import AFTER, BEFORE, GREY, INK, dress
from tendon_hardware.benches.bench import open_bench
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.excitation_plan import BENCHES, DesignedRun
from tendon_hardware.control.operator import SilentOperator
from tendon_hardware.errors import SafetyStop
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.excitations import DESIGNED, LARGEST_COMMAND
from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.files.picture import new_figure, save
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.diagnosis_file import diagnosis_table
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, Forecast, plan_of
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets, likeliest
from tendon_newton.diagnosis.next_experiment.open_sets_file import FILE, read_noise, read_scale
from tendon_newton.diagnosis.next_experiment.run_design import design, usual_task
from tendon_newton.diagnosis.next_experiment.worst_case import WorstCase
from tendon_newton.diagnosis.posterior import read_posterior
from tendon_newton.errors import InvalidOutput
from tendon_newton.workflows.collection import address_of, settings_of
from tendon_newton.workflows.investigation import LOG
from tendon_newton.workflows.investigation_choice import FORCE_SHARE, RECORDINGS
from tendon_newton.workflows.options import InvestigateOptions

MODELS = 64
"""Models under which each command is simulated; the search itself draws twice as many."""
TENSION = 30.0
"""Limit of the tension [N]."""
PROMISE = "peaks of designed commands are a JSON file"


@dataclass(frozen=True, kw_only=True)
class Peak:
    """The largest tension of an optimised command."""

    seed: int
    """Of its search."""
    rank: int
    """Place among the commands of its search; 0 is the one that an investigation would record."""
    diagnosis: str
    bench: str
    command: tuple[float, float]
    """Its smallest and greatest angle [rad]."""
    designed: float
    """Under the models of the search [N]."""
    drawn: float
    """Under models that are drawn anew [N]."""
    recorded: float | None
    """On the virtual unit [N]; None where the run was ended."""
    fault: str | None
    """Why it was."""


def limits(
    folders: Sequence[Path], seeds: Sequence[int], out: Path, *, length: float, wall: float
) -> None:
    """Optimise commands for diagnoses and benches in turn, and write how far each goes.

    A search that is in the file already is not made again.

    Args:
        folders: Diagnoses of investigations: ``DIR/diagnosis_2``.
        seeds: One search each.
        out: File of the results.
        length: Length of a run [s].
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
        bench = BENCHES[seed // len(folders) % len(BENCHES)]
        peaks += search(folder, bench, seed, length)
        searched.append(seed)
        write_json(out, {"searched": searched, "peaks": [asdict(peak) for peak in peaks]})
        print(f"  search {seed}: {len(peaks)} commands; {folder}, {bench}", flush=True)


def search(folder: Path, bench: str, seed: int, length: float) -> list[Peak]:
    """Optimise commands on a bench, and return how hard each that is not refused may pull."""
    recordings = load_dataset(folder.parent / RECORDINGS).train
    known = recordings[: int(folder.name.rpartition("_")[2])]
    table, model = diagnosis_table(folder / FILE), folder.parent / RECORDINGS / "model.toml"
    question = OpenSets(
        posterior=likeliest(read_posterior(folder / FILE)),
        model=load_model(model),
        noise=read_noise(table),
        scale=read_scale(table),
    )
    setting = Setting(bench=bench)
    forecast = Forecast(question, [plan_of(r) for r in known], usual_task(setting, length))
    found = design(
        forecast,
        [setting],
        np.random.default_rng(seed),
        duration=length,
        force_limit=FORCE_SHARE * TENSION,
    )
    runs = [e for e in found.runs if e.plan.excitation == DESIGNED]
    plans = [e.plan for e in runs]
    worst = WorstCase(question, np.random.default_rng([1, seed]))
    drawn = worst.drawn(plans, MODELS).tolist() if plans else []
    log = read_json(folder.parent / LOG, InvalidOutput, "a log is a JSON file")
    port = log["options"]["port"]
    return [
        Peak(
            seed=seed,
            rank=rank,
            diagnosis=str(folder),
            bench=bench,
            command=(float(plan.command.min()), float(plan.command.max())),
            designed=expected.peak_force or 0.0,
            drawn=peak,
            **recorded(expected, port),
        )
        for rank, (expected, plan, peak) in enumerate(zip(runs, plans, drawn, strict=True))
    ]


def recorded(expected: Expected, port: str) -> dict[str, Any]:
    """Record a command on the unit that the diagnosis is of."""
    plan = expected.plan
    options = InvestigateOptions(
        port=port, out=Path(), force_limit=TENSION, faster_than_real_time=True
    )
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
