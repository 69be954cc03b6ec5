"""A bench in the computer with chosen effects: what the tests of effects run on."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.recording import Recording
from tendon_newton.effects import EFFECTS
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.rollout import (
    TIME_STEP,
    Candidates,
    Rollout,
    Stepping,
    Trajectory,
)
from tests.made import recorded, stated_model

Array = NDArray[np.float64]
GAIN = 4.2  # [N/rad]
RADIUS = float(np.float32(0.0125))  # [m] as Newton keeps it
ROW = 1.0 / 80.0  # [s]

Chosen = Mapping[str, Mapping[str, float]]  # Effect -> parameter -> value


def commanded(
    command: Array, bench: str = "spring_weak", row: float = ROW, **numbers: float
) -> Recording:
    """Make a recording of commands alone, shape (T,); numbers override those of the bench."""
    time = row * np.arange(len(command))
    overrides = BenchOverrides(**{name: (value,) for name, value in numbers.items()})
    blank = np.zeros(len(time))
    return recorded(time, blank, bench=bench, command=command, bench_overrides=overrides)


def steps_and_waves(rows: int = 160) -> Array:
    """Steps up, down and far, then a sine [rad], shape (rows,)."""
    index = np.arange(rows)
    levels = np.array([0.8, 5.5, 1.0, 2.5])[np.minimum(index // 20, 3)]
    return np.where(index < 80, levels, 2.5 + 1.5 * np.sin((index - 80) * 0.12))


def simulate(
    recording: Recording,
    effects: Chosen | None = None,
    *,
    time_step: float = TIME_STEP,
    kernel: tuple[str, ...] = tuple(EFFECTS),
) -> Trajectory:
    """Run one recording in the kernel that holds the whole catalogue."""
    chosen = {} if effects is None else effects
    model = stated_model("ideal", {"gain": GAIN}, chosen)
    rollout = Rollout(
        load_mechanism(recording.bench),
        [recording],
        model,
        candidates=Candidates(effects=kernel),
        stepping=Stepping(time_step=time_step),
    )
    return rollout.run(rollout.base_vectors(model)[None])[0][0]


def run(
    command: Array, effects: Chosen | None = None, *, row: float = ROW, **numbers: float
) -> dict[str, Array]:
    """Simulate the weak spring; time, theta, rate, force, joint travel by name, each shape (T,)."""
    out = simulate(commanded(command, row=row, **numbers), effects)
    return {
        "time": out.time,
        "theta": out.motor_position[:, 0],
        "rate": out.motor_velocity[:, 0],
        "force": out.force[:, 0],
        "travel": out.joint_position[:, 0],
    }
