"""Does an investigation keep the limits of a bench, and is it worth more than a fixed plan?

``python -m examples.studies.investigation limits DIAGNOSIS... --unit 40``

Commands are optimised for the diagnoses and the benches in turn until there are 100. Each is
simulated under models that are drawn anew from the intervals, twice as wide, and recorded on the
virtual unit itself. A picture is drawn beside the file of results.

``python -m examples.studies.investigation compare 40 41 42 --out DIR``

Each unit has three wrong things that its seed plants. ``investigate`` in half the time and the plan
``quick`` with one diagnosis look for them on the same unit. The same command goes on where it was
stopped.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from examples.studies.so101_figure import AFTER, BEFORE, GREY, INK, dress
from hardware.benches.bench import open_bench
from hardware.collection.collect import record_run
from hardware.collection.excitation_plan import DesignedRun
from hardware.control.operator import SilentOperator
from hardware.errors import SafetyStop
from hardware.stop_request import StopRequest
from hardware.virtual_bench.physics.planted import planted_causes
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.excitations import DESIGNED, LARGEST_COMMAND
from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.files.picture import new_figure, save
from tendon_newton.data.model_file import load_model
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.diagnosis_file import StatedDiagnosis, read_diagnosis
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, plan_of
from tendon_newton.diagnosis.next_experiment.run_design import design
from tendon_newton.diagnosis.next_experiment.worst_case import worst_forces
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.errors import InvalidOutput
from tendon_newton.exam.open_class_file import FILE, read_answer
from tendon_newton.workflows.collection import address_of, record, settings_of
from tendon_newton.workflows.diagnosing import diagnose_into
from tendon_newton.workflows.investigation import LOG, investigate
from tendon_newton.workflows.investigation_choice import FORCE_SHARE, RECORDINGS
from tendon_newton.workflows.options import CollectOptions, InvestigateOptions

BENCHES = ("finger", "spring_weak", "spring_strong")
COMMANDS = 100
MODELS = 64
"""Models under which each command is simulated; the search itself draws 64."""
TENSION = 30.0
"""Limit of the tension [N]."""
QUICK_SECONDS = 72.0
"""What the plan ``quick`` records: nine runs of 8 s [s]."""


@dataclass(frozen=True, kw_only=True)
class Peak:
    """The largest tension of an optimised command."""

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


def limits(folders: list[Path], unit: int, out: Path, count: int, length: float) -> None:
    """Optimise commands for diagnoses in turn, and say how far each goes."""
    peaks: list[Peak] = []
    seed = 0
    while len(peaks) < count:
        bench, folder = BENCHES[seed % len(BENCHES)], folders[seed % len(folders)]
        question = read_answer(folder)
        runs_diagnosed = int(folder.name.rpartition("_")[2])
        recordings = load_dataset(folder.parent / RECORDINGS).train[:runs_diagnosed]
        found = design(
            question,
            [plan_of(r) for r in recordings],
            [Setting(bench=bench)],
            np.random.default_rng(seed),
            duration=length,
            force_limit=FORCE_SHARE * TENSION,
        )
        runs = [e for e in found.runs if e.prediction.plan.excitation == DESIGNED]
        rng = np.random.default_rng([1, seed])
        plans = [e.prediction.plan for e in runs]
        drawn = worst_forces(question, plans, rng, MODELS) if plans else []
        peaks += [recorded(e, worst, unit) for e, worst in zip(runs, drawn, strict=True)]
        seed += 1
        print(
            f"  {len(peaks)} commands of {seed} searches; {folder.name}, {bench}: "
            f"{len(found.refused)} runs refused",
            flush=True,
        )
        write_json(out, [asdict(peak) for peak in peaks[:count]])
    tell_limits(peaks[:count])
    draw_limits(peaks[:count], out.with_suffix(".png"))


def recorded(expected: Expected, drawn: float, unit: int) -> Peak:
    """Record a command on the unit that the diagnosis is of."""
    plan = expected.prediction.plan
    options = InvestigateOptions(
        port=f"virtual::{unit}", out=Path(), force_limit=TENSION, faster_than_real_time=True
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
    return Peak(
        bench=run.bench,
        command=(float(plan.command.min()), float(plan.command.max())),
        designed=expected.peak_force or 0.0,
        drawn=drawn,
        recorded=greatest,
        fault=None if fault is None else str(fault),
    )


def tell_limits(peaks: list[Peak]) -> None:
    """Print how many commands pass a limit."""
    angles = [a for peak in peaks for a in peak.command]
    print(f"{len(peaks)} commands, {min(angles):.3f} to {max(angles):.3f} rad of 0 to ", end="")
    print(f"{LARGEST_COMMAND:.3f}; beyond: {sum(not 0.0 <= a <= LARGEST_COMMAND for a in angles)}")
    for word in ("designed", "drawn", "recorded"):
        forces = [float(getattr(peak, word)) for peak in peaks]
        over = sum(force >= TENSION for force in forces)
        most = f"largest tension {max(forces):.2f} N, median {np.median(forces):.2f} N"
        print(f"  {word:9s} {most}; {over} beyond {TENSION:g} N")
    print(f"  runs that the bench ended: {sum(peak.fault is not None for peak in peaks)}")


def draw_limits(peaks: list[Peak], path: Path) -> None:
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


def compare(units: list[int], out: Path, length: float, budget: float) -> None:
    """Look for the planted causes in both ways, and print what each found after which time."""
    for unit in units:
        planted = planted_causes(unit)
        words = ", ".join(f"{name} {size:.3g}" for name, size in planted.items())
        print(f"unit {unit}: planted {words}", flush=True)
        port = f"virtual::{unit}:planted"
        tell("quick", QUICK_SECONDS, fixed(port, out / f"quick_{unit}"), planted)
        folder = out / f"investigate_{unit}"
        options = InvestigateOptions(
            port=port, out=folder, run_length=length, faster_than_real_time=True
        )
        investigate(options, SilentOperator(), budget=budget)
        log = read_json(folder / LOG, InvalidOutput, "a log is a JSON file")
        seconds, number = 0.0, 0
        for step in log["steps"]:
            seconds += step["seconds"]
            if step["split"] == "train":
                number += 1
                stated = read_diagnosis(folder / f"diagnosis_{number}" / FILE)
                tell(f"{step['name']} {step['bench']}", seconds, stated, planted)
                tell_bits(step)
        print(f"  the end: {log['ended']}", flush=True)


def fixed(port: str, out: Path) -> StatedDiagnosis:
    """Record the plan ``quick`` and diagnose it once."""
    options = CollectOptions(port=port, out=out, plan="quick", faster_than_real_time=True)
    record(options, SilentOperator())
    answer = out / "diagnosis"
    if not (answer / FILE).exists():
        origin = Origin(dataset=out, command="tendon-newton diagnose")
        model = load_model(out / "model.toml")
        diagnose_into(answer, load_dataset(out), model, origin, progress=lambda _: None)
    return read_diagnosis(answer / FILE)


def tell(what: str, seconds: float, stated: StatedDiagnosis, planted: dict[str, float]) -> None:
    """Print which planted causes are named, which are in a class, and what else is named."""
    named = {cause.name for cause in stated.effects}
    classes = {other for cause in stated.effects for other in cause.indistinguishable_from}
    found, close = planted.keys() & named, (planted.keys() - named) & classes
    print(
        f"  {what:22s} {seconds:3.0f} s at the bench: {len(found)} of {len(planted)} named, "
        f"{len(close)} more in a class; {stated.verdict}; named {', '.join(sorted(named))}; "
        f"{sum(bool(c.indistinguishable_from) for c in stated.effects)} classes open; "
        f"diagnosed in {stated.wall_time_s:.0f} s",
        flush=True,
    )


def tell_bits(step: dict[str, dict[str, float]]) -> None:
    """Print what a run was expected to tell and what it told of the same numbers."""
    expected, brought = step["expected"], step["brought"]
    if expected and brought:
        both = sorted(expected.keys() & brought.keys())
        print(
            f"    expected {sum(expected.values()):.1f} bit; of {len(both)} numbers that both "
            f"diagnoses have {sum(expected[k] for k in both):.1f}, and "
            f"{sum(brought[k] for k in both):.1f} came: "
            + json.dumps({k: [round(expected[k], 2), round(brought[k], 2)] for k in both})
        )


def main() -> None:
    """Run the part that was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    part = parts.add_parser("limits")
    part.add_argument("diagnoses", type=Path, nargs="+", help="folders diagnosis_1, ...")
    part.add_argument("--unit", type=int, required=True, help="virtual unit that they are of")
    part.add_argument("--out", type=Path, default=Path("limits.json"))
    part.add_argument("--commands", type=int, default=COMMANDS)
    part.add_argument("--run-length", type=float, default=6.0)
    part = parts.add_parser("compare")
    part.add_argument("units", type=int, nargs="+")
    part.add_argument("--out", type=Path, required=True)
    part.add_argument("--run-length", type=float, default=9.0)
    part.add_argument("--budget", type=float, default=QUICK_SECONDS / 2.0, help="[s]")
    words = parser.parse_args()
    quiet_warp()
    if words.part == "limits":
        limits(words.diagnoses, words.unit, words.out, words.commands, words.run_length)
    else:
        compare(words.units, words.out, words.run_length, words.budget)


if __name__ == "__main__":
    main()
