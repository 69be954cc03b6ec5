"""Recordings that a reproduction makes on a bench besides the paper's plan.

Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026): the sinusoid of the
sim-to-real experiment.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect_plan import collect
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.control.operator import Operator
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.stop_request import StopRequest
from tendon_lab.reproduction.unit import EXPERIMENTS, RECORDINGS
from tendon_newton.data.recording import Array

WIDE_LOOP = HostPositionLoop(position_range=(-1.5, 2.0 * pi))
"""Lets a sinusoid dip below zero; the usual loop cuts it there."""


@dataclass(frozen=True, kw_only=True)
class TipSine(PlannedRun):
    """The sinusoid of the sim-to-real experiment, amplitude pi/2 at 0.5 Hz, about any centre."""

    centre: float  # [rad]

    def command(self, seed: int, rate: float) -> Array:
        """Return the command [rad] at every row, shape (T,); nothing is drawn."""
        time = np.arange(round(self.duration * rate)) / rate
        return self.centre + pi / 2.0 * np.sin(pi * time)


FURTHER_RUNS: tuple[PlannedRun, ...] = (
    TipSine(
        name="finger_open_sine_0",
        bench="finger",
        excitation="sine",
        duration=12.0,
        split="test",
        centre=0.2,
    ),
)
"""About 0.2 rad the ideal source opens the finger fully, as on the paper's bench."""


def thinned(plan: Sequence[PlannedRun], most: int | None) -> tuple[PlannedRun, ...]:
    """Return the first runs of every kind; test runs stay."""
    if most is None:
        return tuple(plan)
    return tuple(
        run for run in plan if run.split == "test" or int(run.name.rsplit("_", 1)[1]) < most
    )


def record_unit(
    address: BenchAddress,
    plan: Sequence[PlannedRun],
    out: Path,
    operator: Operator,
    stop: StopRequest,
    *,
    seed: int,
) -> bool:
    """Record a plan and the further runs on one bench; go on where it was interrupted.

    Args:
        address: Ports and servos of the bench.
        plan: Recordings that models learn from and are tested on.
        out: Folder of the bench.
        operator: Receiver of questions and messages.
        stop: Request to end the run.
        seed: Seed of the plan's draws.

    Returns:
        Whether all is there.
    """
    settings = CollectSettings(seed=seed)
    parts = (
        (RECORDINGS, plan, settings),
        (EXPERIMENTS, FURTHER_RUNS, replace(settings, loop=WIDE_LOOP)),
    )
    for folder, runs, how in parts:
        at = replace(address, bench=runs[0].bench)
        done = collect(at, runs, how, out / folder, operator, stop, title=f"reproduction {folder}")
        for outcome in done.outcomes:
            if outcome.fault is not None:
                raise outcome.fault
        if done.left:
            return False
    return True
