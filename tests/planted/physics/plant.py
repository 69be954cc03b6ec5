"""The plant: benches in closed loop with a servo, with or without a hidden cause.

It shares no code with ``tendon_newton``: the equations are typed in by hand, friction is a field
of bristles and not Coulomb's law, each gear and each guide has bristles of its own, a rotor is a
body on an elastic string, and delays fall between samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from tests.planted.physics.bench import Bench
from tests.planted.physics.causes import Causes
from tests.planted.physics.disturbances import Disturbances
from tests.planted.physics.kernel import drive
from tests.planted.physics.kernel_plant import Plant
from tests.planted.physics.plant_arrays import (
    disturbance,
    due_steps,
    heard,
    knock_tables,
    padded,
    plant_of,
    row_steps,
)
from tests.planted.physics.servo import DcServo

Array = NDArray[np.float64]

STEP = 20e-6  # [s] at half of it the angle moves by less than a tenth of an encoder's floor


@dataclass(frozen=True, kw_only=True)
class Run(Disturbances):
    """One recording to make."""

    bench: Bench
    causes: Causes
    # Row instants of the log [s], from 0; really whole multiples of the step, shape (T,)
    time: Array
    command: Array  # Commanded motor angle [rad], each held until the next row, shape (T,)
    servo: DcServo | None = None  # What pulls; None is the ideal source, a force without inertia

    @property
    def true_time(self) -> Array:
        """When the rows really are [s], shape (T,); the log may have it otherwise."""
        return self.time * self.causes.period_scale


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What happened at the rows, before any noise."""

    angle: Array  # Motor angle as the servo sees it [rad], or as the log repeats it, shape (T,)
    speed: Array  # [rad/s], shape (T,)
    # Tension at the load cell just after the row's command took effect [N], shape (T,)
    force: Array
    cell: Array  # What the load cell says at each row: late, lagging, scaled, shifted, drifting [N]
    given: Array  # Force of the motor, before its gear [N], shape (T,)
    coordinates: Array  # Joint angles [rad], slider [m] and 0, shape (T, 2)
    tip: Array | None  # Fingertip x and z [m], shape (T, 2); None on a slider


def simulate(runs: Sequence[Run], *, step: float = STEP) -> tuple[Motion, ...]:
    """Run all recordings in one launch, each from rest under its first command."""
    counts = np.array([run.time.size for run in runs], dtype=np.int32)
    shape = (len(runs), int(counts.max()))
    pairs = [wp.zeros(shape, dtype=wp.vec2d, device="cpu") for _ in range(2)]
    scalars = [wp.zeros(shape, dtype=wp.float64, device="cpu") for _ in range(3)]
    levels = padded([disturbance(run) for run in runs])
    wp.launch(
        drive,
        dim=len(runs),
        inputs=[
            wp.array([plant_of(run, step) for run in runs], dtype=Plant, device="cpu"),
            wp.array(counts, dtype=wp.int32, device="cpu"),
            wp.array(padded([row_steps(run, step) for run in runs]), device="cpu"),
            wp.array(padded([due_steps(run, step) for run in runs]), device="cpu"),
            wp.array(padded([heard(run) for run in runs]), device="cpu"),
            wp.array(levels, dtype=wp.vec2d, device="cpu"),
            *knock_tables(runs),
        ],
        outputs=[*pairs, *scalars],
        device="cpu",
    )
    tables = [table.numpy().astype(np.float64) for table in (*pairs, *scalars)]
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


def _motion(
    run: Run, coordinates: Array, motor: Array, force: Array, cell: Array, given: Array
) -> Motion:
    causes = run.causes
    if run.logged is not None:
        motor = motor[run.logged]
    said = causes.cell_gain * cell + causes.cell_bias + causes.cell_drift * run.true_time
    return Motion(
        angle=motor[:, 0],
        speed=motor[:, 1],
        force=force,
        cell=said,
        given=given,
        coordinates=coordinates,
        tip=tip_position(run.bench, coordinates) if run.bench.kind == "finger" else None,
    )
