"""What drives a surgical instrument's cables, ``python -m lab.studies.cable_tool LOGS``.

The logs are MRDLab/mis-tool-characterization's (Open Database License); they are not part of this
repository. The spindle's path and the load on the jaw are given, the spindle's torque and the jaw's
angle are predicted on conditions that are left out whole. Beside the diagnosis stand two friction
laws fitted by the same program, and a network that learns from the same runs.
"""

import argparse
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lab.studies.board import interval
from lab.studies.cable_tool.figure import draw
from lab.studies.cable_tool.rivals import fitted_law, learned
from lab.studies.cable_tool.runs import TO_TORQUE, Run, read_runs, repeatability, write_bench
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.identification.study import Residual, replacements

START = Model(
    actuator=NamedValues(name="measured_path", values={"travel": 0.002, "twist": 0.5}),
    fit=("moment_arm", "travel", "twist"),
)
"""A path that was measured; the ratio of the cables, the reversal's travel and the twist of the
jaw's coupling are not known."""
CONSTANT = ("coulomb_friction",)
BY_LOAD = (*CONSTANT, "load_dependent_friction")
"""What is fitted by hand: half of the torque between both directions is a + b times the load."""
SEED = 0

Errors = Sequence[Residual]  # Residuals of the test runs' rows that count, the first of each array


@dataclass(frozen=True, kw_only=True)
class Split:
    """Runs to fit, and runs under conditions that no fit has seen."""

    name: str
    train: Callable[[Run], bool]
    test: Callable[[Run], bool]


def odd(run: Run) -> bool:
    """Tell whether a load is an odd number of tenths."""
    return round(10.0 * run.load) % 2 == 1


def in_setting(setting: str) -> Callable[[Run], bool]:
    """Return what tells whether a run is in a setting."""
    return lambda run: run.setting == setting


SPLITS = {
    "loads": Split(
        name="loads and frequencies that no fit has seen",
        train=lambda r: r.setting == "4" and not odd(r) and r.frequency in (0.1, 0.3, 0.5),
        test=lambda r: r.setting == "4" and odd(r) and r.frequency in (0.2, 0.4),
    ),
    **{
        setting: Split(
            name=f"the setting {setting}, of which no fit has seen a run",
            train=lambda r, own=setting: (
                r.setting != own
                and (r.setting != "4" or (not odd(r) and r.frequency in (0.3, 0.5)))
            ),
            test=in_setting(setting),
        )
        for setting in ("Pitch_1", "Pitch_3")
    },
}


def main() -> None:
    """Print repeatability, the answers of all programs by split, and halves."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path, help="folder of the tools' folders")
    parser.add_argument("--splits", nargs="+", choices=list(SPLITS), default=list(SPLITS))
    parser.add_argument("--halves", action="store_true", help="diagnose each half of a tool's runs")
    parser.add_argument("--pictures", type=Path, help="folder for pictures of two runs")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        write_bench(Path(folder))
        runs = read_runs(arguments.logs)
        torque, angle = repeatability(runs)
        print(
            f"cycles of a run differ by {torque.mean():.2f} mN m (median {np.median(torque):.2f}) "
            f"and {angle.mean():.1f} mrad RMS; {len(torque)} runs",
            flush=True,
        )
        for key in arguments.splits:
            report(runs, SPLITS[key], float(torque.mean()), arguments.pictures)
        if arguments.halves:
            report_halves([run for run in runs if run.setting == "4"])


def report(runs: Sequence[Run], split: Split, repeats: float, pictures: Path | None) -> None:
    """Print what each program leaves of a split's test runs."""
    train = [run for run in runs if split.train(run)]
    test = [run for run in runs if split.test(run) and not run.tells_zero]
    print(f"\n{split.name}: {len(train)} runs fitted, {len(test)} tested", flush=True)
    diagnosis, whole = diagnosed(train, test)
    rows = {
        "constant friction": fitted_law(CONSTANT, START, train, test),
        "and friction by load": fitted_law(BY_LOAD, START, train, test),
        "network of 64 and 32": learned(train, test, seed=SEED),
        "diagnosis": whole,
    }
    rows = {name: scored(test, errors) for name, errors in rows.items()}
    found = rows["diagnosis"]
    print(f"  {'':32s} {'spindle torque [mN m]':24s} jaw angle [mrad]")
    for name, errors in rows.items():
        print(f"  {name:32s} {with_interval(torques(errors)):24s} {with_interval(angles(errors))}")
    ratio = rms(torques(found)) / repeats
    print(f"  the diagnosis leaves {ratio:.1f} times the repeatability of the torque")
    print_causes(diagnosis)
    if pictures is not None:
        draw(pictures, split.name, test, whole)


def diagnosed(train: Sequence[Run], test: Sequence[Run]) -> tuple[Diagnosis, Errors]:
    """Diagnose runs, and return the residuals of others by what was found."""
    dataset = Dataset(
        path=Path(),
        train=tuple(run.recording for run in train),
        test=tuple(run.recording for run in test),
    )
    diagnosis, evidence = diagnose(dataset, START)
    return diagnosis, evidence.test.residuals(*replacements([evidence.extended]))


def scored(test: Sequence[Run], errors: Errors) -> Errors:
    """Return the residuals of the rows that count."""
    return [
        Residual(
            signals={name: own[..., run.scored] for name, own in error.signals.items()},
            trusted=error.trusted[run.scored],
        )
        for run, error in zip(test, errors, strict=True)
    ]


def torques(errors: Errors) -> Array:
    """Return the RMS error of the spindle's torque in each run [mN m], shape (N,)."""
    return np.array([TO_TORQUE * rms(e.force[0]) for e in errors if e.force is not None])


def angles(errors: Errors) -> Array:
    """Return the RMS error of the jaw's angle in each run [mrad], shape (N,)."""
    return np.array([1.0e3 * rms(e.theta[0]) for e in errors])


def with_interval(sizes: Array) -> str:
    """Return the RMS over runs with its 95 % interval, by drawing runs, and the worst run."""
    low, high = interval(sizes)
    return f"{rms(sizes):5.2f} [{low:.2f}, {high:.2f}], worst {sizes.max():.1f}"


def print_causes(diagnosis: Diagnosis) -> None:
    """Print the named causes and fitted numbers with their intervals."""
    print(f"  {diagnosis.verdict}, in {diagnosis.wall_time_s:.0f} s:")
    for effect in diagnosis.effects:
        others = ", ".join(effect.indistinguishable_from)
        print(
            f"    {effect.name}: "
            + ", ".join(number(name, e.value, e.ci95) for name, e in effect.parameters.items())
            + (f" (or {others})" if others else "")
        )
    fitted = [number(name, e.value, e.ci95) for name, e in diagnosis.fitted.items()]
    print(f"    fitted besides: {', '.join(fitted)}", flush=True)


def number(name: str, value: float, interval: tuple[float, float]) -> str:
    """Return a number with its interval."""
    return f"{name} {value:.4g} [{interval[0]:.4g}, {interval[1]:.4g}]"


def report_halves(runs: Sequence[Run]) -> None:
    """Print what is found on each half of a tool's runs, tested on the other."""
    halves = [
        [run for k, run in enumerate(runs) if (k // 10 + k) % 2 == half and k % 10 != 7]
        for half in (0, 1)
    ]
    for own, other in (halves, halves[::-1]):
        print(f"\na half of {len(own)} runs, tested on the other", flush=True)
        diagnosis, whole = diagnosed(own, other)
        errors = scored(other, whole)
        print(f"  {with_interval(torques(errors))} mN m, {with_interval(angles(errors))} mrad")
        print_causes(diagnosis)


if __name__ == "__main__":
    main()
