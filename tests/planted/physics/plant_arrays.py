"""Recordings as the kernel's arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import warp as wp
from numpy.typing import NDArray

from tests.planted.physics.bench import FORCE_LIMIT, GAIN, GRAVITY, SPOOL_RADIUS, Bench
from tests.planted.physics.causes import Causes
from tests.planted.physics.equilibrium import Drive, equilibrium, tendon_force
from tests.planted.physics.kernel_plant import Plant

if TYPE_CHECKING:
    from tests.planted.physics.plant import Run

Array = NDArray[np.float64]

CONTACT_TIME = 0.005  # [s] damping of the obstruction over its stiffness
STRING = 5.0e6  # [N/m] between a rotor and the mechanism: 4 um under 20 N
SHAFT = 2.0e3  # [N m/rad] the same of a direct drive: 0.5 mrad under 1 N m
STRING_TIME = 4.0e-5  # [s] its damping over its stiffness


def plant_of(run: Run, step: float) -> Plant:
    """Fill in the numbers of one recording's plant."""
    plant = Plant()
    plant.step = step
    for name in vars(run.causes).keys() & Plant.vars.keys():  # what is scaled follows below
        if Plant.vars[name].type is wp.float64:
            setattr(plant, name, getattr(run.causes, name))
    _fill_bench(plant, run.bench, run.causes)
    _fill_servo(plant, run.bench, run.causes, step)
    if run.servo is not None:
        _fill_rotor(plant, run)
    plant.disturbed = int(run.gain is not None or run.friction is not None)
    gain = 1.0 if run.gain is None else float(run.gain[0])
    drive = Drive(command=float(heard(run)[0]), gain=gain, servo=run.servo)
    rest = equilibrium(run.bench, run.causes, drive)
    plant.start = wp.vec2d(*rest)
    plant.start_tension = tendon_force(run.bench, run.causes, drive, rest)
    return plant


def _fill_bench(plant: Plant, bench: Bench, causes: Causes) -> None:
    nominal = np.array(bench.stiffness)
    plant.joints = 2 if bench.kind == "finger" else 1
    plant.direct = int(bench.direct)
    plant.mass = wp.vec2d(*(causes.mass_scale * m for m in bench.mass))
    plant.length = wp.vec2d(*bench.length)
    plant.stiffness = wp.vec2d(*(causes.stiffness_scale * nominal))
    damping = causes.damping_scale * causes.damper_scale
    plant.damping = wp.vec2d(*(damping * d for d in bench.damping))
    plant.upper = wp.vec2d(bench.upper[0], bench.upper[1] or 1.0)
    plant.stop_stiffness = wp.vec2d(*bench.stop_stiffness)
    plant.stop_damping = wp.vec2d(*bench.stop_damping)
    plant.arm = wp.vec2d(*bench.moment_arm)
    plant.gravity, plant.inertia = GRAVITY, causes.inertia_scale
    plant.joint_friction = wp.vec2d(*(causes.joint_friction * nominal * np.array(bench.upper)))
    plant.joint_bristle = wp.vec2d(*(causes.bristle / (arm or 1.0) for arm in bench.moment_arm))
    plant.maxwell = wp.vec2d(*(causes.maxwell_ratio * nominal))
    plant.relaxation = causes.relaxation if causes.maxwell_ratio else 0.0
    plant.contact_damping = CONTACT_TIME * causes.obstruction
    plant.obstruction_at = causes.obstruction_at * bench.spool_radius


def _fill_servo(plant: Plant, bench: Bench, causes: Causes, step: float) -> None:
    plant.rounded, plant.knee = int(causes.second_form), causes.knee
    plant.nominal_radius = bench.spool_radius
    plant.radius = causes.radius_scale * bench.spool_radius
    plant.gain, plant.limit = causes.gain_scale * GAIN, FORCE_LIMIT
    plant.lag_share = _share(causes.lag, step)
    plant.curvature, plant.excess = causes.viscous_curvature, causes.static
    # a direct drive's gear slips by the angle at which a spool's slips by that travel
    plant.bristle = causes.bristle * bench.spool_radius / SPOOL_RADIUS
    plant.dahl_travel = causes.dahl_travel * bench.spool_radius / SPOOL_RADIUS
    plant.fade_share = _share(causes.fade_time, step)
    plant.cell_share = _share(causes.cell_lag, step)
    plant.cell_delay = causes.cell_delay / step


def _fill_rotor(plant: Plant, run: Run) -> None:
    servo, causes = run.servo, run.causes
    if causes.speed_limit or causes.mount_compliance:
        raise ValueError("a servo with a rotor has neither a speed limit nor a swinging mount.")
    plant.rotor, plant.duty_per_rad = servo.inertia, causes.gain_scale * servo.duty_per_rad
    plant.greatest_duty, plant.supply = servo.greatest_duty, servo.supply
    plant.torque_constant, plant.resistance = servo.torque_constant, servo.resistance
    firm = SHAFT if run.bench.direct else STRING
    plant.string = 1.0 / (1.0 / firm + causes.compliance)
    plant.string_damping = STRING_TIME * plant.string


def _share(time_constant: float, step: float) -> float:
    return 1.0 - float(np.exp(-step / time_constant)) if time_constant else 1.0


def heard(run: Run) -> Array:
    """Command as the servo understands it [rad]."""
    if run.causes.command_step == 0.0:
        return run.command
    return np.round(run.command / run.causes.command_step) * run.causes.command_step


def due_steps(run: Run, step: float) -> Array:
    """Steps at which each row's command takes effect, in the order of the rows."""
    due = run.true_time + run.causes.delay
    if run.lateness is not None:
        due = np.maximum.accumulate(due + run.lateness)
        due += 2.0 * step * np.arange(due.size) / due.size  # no two at once
    return due / step


def row_steps(run: Run, step: float) -> NDArray[np.int32]:
    """Steps of the rows."""
    time = run.true_time
    steps = np.round(time / step)
    if time[0] != 0.0 or np.any(np.abs(steps * step - time) > 1e-9):
        raise ValueError(f"rows must begin at 0 and fall on whole steps of {step} s.")
    return steps.astype(np.int32)


def disturbance(run: Run) -> Array:
    """Gain against its mean [1] and further friction [N] at each row, shape (T, 2)."""
    table = np.zeros((run.time.size, 2))
    table[:, 0] = 1.0 if run.gain is None else run.gain
    table[:, 1] = 0.0 if run.friction is None else run.friction
    return table


def padded(tables: Sequence[NDArray]) -> NDArray:
    """Stack tables of different lengths, zeros after the shorter ones."""
    longest = max(table.shape[0] for table in tables)
    stack = np.zeros((len(tables), longest, *tables[0].shape[1:]), dtype=tables[0].dtype)
    for i, table in enumerate(tables):
        stack[i, : table.shape[0]] = table
    return stack


def knock_tables(runs: Sequence[Run]) -> tuple[wp.array, wp.array]:
    """How many knocks each recording has, and (start, width, peak) of each."""
    counts = np.array([len(run.knocks) for run in runs], dtype=np.int32)
    table = np.zeros((len(runs), max(1, int(counts.max())), 3))
    for i, run in enumerate(runs):
        for k, knock in enumerate(run.knocks):
            table[i, k] = knock.start, knock.width, knock.peak
    return wp.array(counts, device="cpu"), wp.array(table, dtype=wp.vec3d, device="cpu")
