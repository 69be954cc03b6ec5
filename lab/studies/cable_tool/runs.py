"""Runs of the instruments: what is read, which conditions they have, how well they repeat."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tendon_newton.data.importers.mapped import read_mapped
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.identification.cutting import rows_of
from tendon_newton.mechanisms.asset_library import FOLDERS_VARIABLE
from tendon_newton.mechanisms.authoring.asset_plan import plan_asset, write_asset

MAPPING = Path(__file__).parent / "mapping.toml"
SPOOL = 0.010  # Radius that stands for the spindle's, which nobody states [m]: only ratios show
TO_TORQUE = 1.0e3 * SPOOL  # Torque of the spindle per force at its spool [mN m/N]
BEGIN = 0.5
"""Time in which the loading motor takes hold [s]: the jaw rings, and rows are not scored."""
JERK = {"Tool_4_Maryland_L_4_07.csv": 17.0}
"""Run -> instant from which its motor jerks by 1.5 rad within 0.2 s [s]."""
ZERO_LOAD, ZERO_FREQUENCY = 0.6, 0.3
"""Load [A] and frequency [Hz] of the run that tells the jaw encoder's zero of its setting."""
SLOPE = 0.93  # Turn of the jaw per turn of the spindle by which those zeros are read [1]


@dataclass(frozen=True, kw_only=True)
class Run:
    """One run of 20 s with its conditions."""

    recording: Recording
    setting: str  # Folder of the run: tool and pitch of its wrist
    stop: int  # Stop of the jaw: 0 or 1
    frequency: float  # [Hz]
    load: float  # Current of the motor that loads the jaw [A]

    @property
    def scored(self) -> Mask:
        """Rows that count, shape (T,)."""
        return self.recording.time > BEGIN

    @property
    def tells_zero(self) -> bool:
        """Whether the zero of its setting is read from it, so that it is not scored."""
        return (self.load, self.frequency) == (ZERO_LOAD, ZERO_FREQUENCY)


def write_bench(folder: Path) -> None:
    """Write the bench, as ``asset new`` does, where benches are looked for."""
    plan = plan_asset(
        "cable_tool",
        ("jaw",),
        length=(0.02,),
        mass=(0.005,),
        moment_arm=(0.0107,),
        stiffness=(0.02,),
        range=(1.3,),
        damping=(1.0e-4,),
        spool_radius=SPOOL,
        force_limit=30.0,
    )
    write_asset(folder, plan)
    os.environ[FOLDERS_VARIABLE] = str(folder)


def read_runs(logs: Path) -> list[Run]:
    """Read all runs; the jaw's zero is that of one run in each setting and at each stop."""
    runs = [
        run_of(log.recording, log.source)
        for log in read_mapped(logs, MAPPING, lambda _: SPOOL).logs
    ]
    zeros = {(r.setting, r.stop): zero_of(r.recording) for r in runs if r.tells_zero}
    return [shifted(run, zeros[run.setting, run.stop]) for run in runs]


def run_of(recording: Recording, source: Path) -> Run:
    """Return a run with what its file's name says, without its jerk.

    Its spindle is counted from where it starts, at the unwound end: the stops are half a radian
    apart.
    """
    digits = [int(digit) for digit in source.stem]
    end = JERK.get(recording.name, np.inf)
    count = int(np.searchsorted(recording.time, end))
    pitched = len(digits) == 3
    unwound = recording.motor_position[0]
    counted = replace(recording, motor_position=recording.motor_position - unwound)
    return Run(
        recording=rows_of(counted, slice(0, count), recording.name),
        setting=source.parent.name.removeprefix("Tool_4_Maryland_L_"),
        stop=digits[0] if pitched else 0,
        frequency=(0.3, 0.5)[digits[1]] if pitched else round(0.1 * (digits[0] + 1), 1),
        load=round(0.2 * (digits[2] + 1) if pitched else 0.1 * (digits[1] + 1), 1),
    )


def zero_of(recording: Recording) -> float:
    """Return the jaw's angle [rad] at a spindle's angle of zero, on the mean of a run."""
    return float(np.mean(recording.compared_angle - SLOPE * recording.motor_position[:, 0]))


def shifted(run: Run, zero: float) -> Run:
    """Return a run whose jaw is counted from a zero [rad]."""
    moved = replace(run.recording, joint_position=run.recording.compared_angle - zero)
    return replace(run, recording=moved)


def spindle_torque(recording: Recording) -> Array:
    """Return the torque measured at the spindle [mN m], shape (T,)."""
    assert recording.force is not None
    return TO_TORQUE * recording.force[:, 0]


def repeatability(runs: Sequence[Run]) -> Array:
    """Return by how much cycles of a run differ from their mean [mN m, mrad], shape (2, N).

    Only runs with three whole cycles count, less the first.
    """
    out = []
    for run in runs:
        rate = 1.0 / float(np.median(np.diff(run.recording.time)))
        length = round(rate / run.frequency)
        count = run.recording.sample_count // length
        if count < 3:
            continue
        signals = (spindle_torque(run.recording), 1.0e3 * run.recording.compared_angle)
        cycles = [x[length : count * length].reshape(count - 1, length) for x in signals]
        free = np.sqrt((count - 1) / (count - 2))
        out.append([free * rms(x - x.mean(axis=0)) for x in cycles])
    return np.array(out).T
