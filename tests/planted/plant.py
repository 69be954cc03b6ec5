"""The plant: benches in closed loop with a servo, with or without a hidden cause.

It shares no physics with ``tendon_newton``: the equations are typed in by hand, friction is a
field of bristles and not Coulomb's law, and delays fall between samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from tests.planted.bench import FORCE_LIMIT, GAIN, GRAVITY, SPOOL_RADIUS, Bench, Causes, Knock
from tests.planted.equilibrium import equilibrium
from tests.planted.kernel import Plant, drive

Array = NDArray[np.float64]

STEP = 10e-6  # [s] at half of it the angle moves by a fortieth of an encoder's floor (measured)


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recording to make."""

    bench: Bench
    causes: Causes
    time: Array
    """Row instants [s], from 0, whole multiples of the step, shape (T,)."""
    command: Array
    """Commanded motor angle [rad], each held until the next row, shape (T,)."""
    knocks: tuple[Knock, ...] = ()
    """Hands in the way, one after the other."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What happened at the rows, before any sensor."""

    angle: Array
    """Motor angle as the servo sees it [rad], shape (T,)."""
    speed: Array
    """[rad/s], shape (T,)."""
    force: Array
    """Tension at the load cell just after the row's command took effect [N], shape (T,)."""
    coordinates: Array
    """Joint angles [rad], slider [m] and 0, shape (T, 2)."""
    tip: Array | None
    """Fingertip x and z [m], shape (T, 2); None on a slider."""


def simulate(runs: Sequence[Run], *, step: float = STEP) -> tuple[Motion, ...]:
    """Run all recordings in one launch, each from rest under its first command."""
    counts = np.array([run.time.size for run in runs], dtype=np.int32)
    shape = (len(runs), int(counts.max()))
    coordinates = wp.zeros(shape, dtype=wp.vec2d, device="cpu")
    speed = wp.zeros(shape, dtype=wp.float64, device="cpu")
    force = wp.zeros(shape, dtype=wp.float64, device="cpu")
    wp.launch(
        drive,
        dim=len(runs),
        inputs=[
            wp.array([_plant(run) for run in runs], dtype=Plant, device="cpu"),
            wp.array(counts, dtype=wp.int32, device="cpu"),
            wp.array(_padded([_steps(run, step) for run in runs], np.int32), device="cpu"),
            wp.array(_padded([_heard(run) for run in runs], np.float64), device="cpu"),
            *_knocks(runs),
            step,
        ],
        outputs=[coordinates, speed, force],
        device="cpu",
    )
    tables = [table.numpy().astype(np.float64) for table in (coordinates, speed, force)]
    return tuple(
        _motion(run, *(table[i, : counts[i]] for table in tables)) for i, run in enumerate(runs)
    )


def tip_position(bench: Bench, q: Array) -> Array:
    """Fingertip x and z [m] of joint angles q (T, 2), seen from the PIP axis."""
    first, second = bench.length
    both = q[:, 0] + q[:, 1]
    x = first * np.cos(q[:, 0]) + second * np.cos(both)
    z = -first * np.sin(q[:, 0]) - second * np.sin(both)
    return np.stack([x, z], axis=1)


def _plant(run: Run) -> Plant:
    bench, causes = run.bench, run.causes
    plant = Plant()
    plant.joints = 2 if bench.kind == "finger" else 1
    plant.mass = wp.vec2d(*(causes.mass_scale * m for m in bench.mass))
    plant.length = wp.vec2d(*bench.length)
    plant.stiffness = wp.vec2d(*(causes.stiffness_scale * k for k in bench.stiffness))
    plant.damping = wp.vec2d(*(causes.damping_scale * d for d in bench.damping))
    plant.upper = wp.vec2d(*bench.upper)
    plant.stop_stiffness = wp.vec2d(*bench.stop_stiffness)
    plant.stop_damping = wp.vec2d(*bench.stop_damping)
    plant.arm = wp.vec2d(*bench.moment_arm)
    plant.start = wp.vec2d(*equilibrium(bench, causes, float(_heard(run)[0])))
    plant.radius, plant.limit, plant.bristle = SPOOL_RADIUS, FORCE_LIMIT, causes.bristle
    plant.gain, plant.gravity = causes.gain_scale * GAIN, GRAVITY
    plant.delay, plant.offset = causes.delay, causes.offset
    plant.viscous, plant.curvature = causes.viscous, causes.viscous_curvature
    plant.coulomb, plant.load = causes.coulomb, causes.load
    plant.cogging, plant.cogging_rate = causes.cogging, causes.cogging_rate
    plant.cogging_phase = causes.cogging_phase
    return plant


def _heard(run: Run) -> Array:
    """Command as the servo understands it [rad]."""
    if run.causes.command_step == 0.0:
        return run.command
    return np.round(run.command / run.causes.command_step) * run.causes.command_step


def _steps(run: Run, step: float) -> NDArray[np.int32]:
    steps = np.round(run.time / step)
    if run.time[0] != 0.0 or np.any(np.abs(steps * step - run.time) > 1e-9):
        raise ValueError(f"rows must begin at 0 and fall on whole steps of {step} s.")
    return steps.astype(np.int32)


def _padded(rows: Sequence[NDArray], dtype: type) -> NDArray:
    table = np.zeros((len(rows), max(row.shape[0] for row in rows)), dtype=dtype)
    for i, row in enumerate(rows):
        table[i, : row.shape[0]] = row
    return table


def _knocks(runs: Sequence[Run]) -> tuple[wp.array, wp.array]:
    counts = np.array([len(run.knocks) for run in runs], dtype=np.int32)
    table = np.zeros((len(runs), max(1, int(counts.max())), 3))
    for i, run in enumerate(runs):
        for k, knock in enumerate(run.knocks):
            table[i, k] = knock.start, knock.width, knock.peak
    return wp.array(counts, device="cpu"), wp.array(table, dtype=wp.vec3d, device="cpu")


def _motion(run: Run, coordinates: Array, speed: Array, force: Array) -> Motion:
    arm = np.array(run.bench.moment_arm)
    return Motion(
        angle=coordinates @ arm / SPOOL_RADIUS + run.causes.offset,
        speed=speed,
        force=force,
        coordinates=coordinates,
        tip=tip_position(run.bench, coordinates) if run.bench.kind == "finger" else None,
    )
