"""Recordings: which bench sees which command, and what its sensors log of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from tendon_newton.data.recording import Array, Recording
from tests.planted.physics.bench import Bench
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import COMMANDS, row_times
from tests.planted.physics.disturbances import draw_disturbances
from tests.planted.physics.plant import Motion, Run
from tests.planted.physics.sensors import (
    CURRENT_STEP,
    JOINT_STEP,
    SLIDE_STEP,
    TIP_NOISE,
    VOLTAGE_NOISE,
    VOLTAGE_STEP,
    Sensors,
    encoder,
    kept_rows,
    load_cell,
    speed_register,
)
from tests.planted.physics.servo import DcServo

TRAIN_COUNT = 5
TEST_COUNT = 3
MIXES: Mapping[str, tuple[str, ...]] = {
    "A": ("finger", "spring_weak", "spring_strong"),
    "F": ("finger",),
    "S": ("spring_strong",),
    "W": ("spring_weak",),
    "P": ("pendulum",),
}
SWING = 1.2  # Greatest command of a pendulum, either way [rad]; the others are asked for 0 to 2 pi
KINDS = ("steps", "sine", "ramp", "stairs", "steps")


@dataclass(frozen=True, kw_only=True)
class Slot:
    """One recording to make: where, with which command."""

    file: str
    bench: str
    kind: str


def draw_slots(rng: np.random.Generator, benches: Sequence[str]) -> tuple[Slot, ...]:
    """Draw which bench sees which command: five to train on, three to test on."""
    test_kinds = ("steps", "sine", ("ramp", "stairs")[int(rng.integers(2))])
    slots: list[Slot] = []
    for kinds in (KINDS, test_kinds):
        # every bench in turn, so that each is in both splits
        turns = [benches[i % len(benches)] for i in range(len(kinds))]
        for bench, kind in zip(rng.permutation(turns), rng.permutation(kinds), strict=True):
            number = sum(slot.bench == bench for slot in slots)
            slots.append(Slot(file=f"{bench}_{kind}_{number}.csv", bench=str(bench), kind=kind))
    return tuple(slots)


def draw_run(
    rng: np.random.Generator,
    slot: Slot,
    causes: Causes,
    benches: Mapping[str, Bench],
    duration: tuple[float, float],
    servo: DcServo | None = None,
) -> Run:
    """Draw the command of a recording, and what befalls it."""
    time = row_times(rng, duration)
    command = COMMANDS[slot.kind](rng, time.size)
    if benches[slot.bench].direct:
        command = SWING * (command / np.pi - 1.0)
    command = np.round(command, 6)  # as the file has it
    befalling = draw_disturbances(rng, causes, time)
    return Run(
        **vars(befalling), bench=benches[slot.bench], causes=causes, time=time, command=command,
        servo=servo,
    )  # fmt: skip


def joint_encoders(motion: Motion, run: Run) -> Array:
    """Joints from where each began: angles of 14 bits a turn (T, 2), places of 1 um (T, 1)."""
    turns = motion.tip is not None
    step, place = (
        (JOINT_STEP, motion.coordinates) if turns else (SLIDE_STEP, motion.coordinates[:, :1])
    )
    read = run.causes.joint_gain * earlier(run, place - place[0], run.causes.joint_delay)
    return (np.round(read / step) * step).round(6)


def earlier(run: Run, signal: Array, delay: float) -> Array:
    """What a signal was some time before each row [s], shape (T, C)."""
    then = np.maximum(run.time - delay, run.time[0])
    return PchipInterpolator(run.time, signal)(then) if delay else signal


def camera(rng: np.random.Generator, motion: Motion, run: Run) -> Array | None:
    """Place of the tip as it is seen [m], shape (T, 2); None on a slider."""
    if motion.tip is None:
        return None
    place = run.causes.tip_gain * earlier(run, motion.tip, run.causes.tip_delay)
    return (place + TIP_NOISE * rng.standard_normal(place.shape)).round(5)


def read_current(motion: Motion, run: Run, servo: DcServo) -> Array:
    """Current of a winding as a register tells it [A], shape (T,)."""
    radius = run.causes.radius_scale * run.bench.spool_radius
    current = motion.given * radius / servo.torque_constant
    read = run.causes.current_gain * earlier(run, current, run.causes.current_delay)
    return (np.round(read / CURRENT_STEP) * CURRENT_STEP).round(6)


def read_supply(rng: np.random.Generator, motion: Motion, run: Run, idle: float) -> Array:
    """Voltage as a register tells it [V], shape (T,): leads take as much of it as of the force."""
    lost = (run.causes.sag + run.causes.supply_sag) * np.abs(motion.given)
    read = idle * (1.0 - lost) + VOLTAGE_NOISE * rng.standard_normal(lost.size)
    return (np.round(read / VOLTAGE_STEP) * VOLTAGE_STEP).round(6)


def record(
    rng: np.random.Generator, slot: Slot, run: Run, motion: Motion, sensors: Sensors, *, gaps: bool
) -> Recording:
    """Pass a motion through the sensors."""
    theta, speed = encoder(motion.angle).round(6), speed_register(rng, motion.speed).round(3)
    force = load_cell(rng, motion.cell, sensors).round(4)
    joint = joint_encoders(motion, run) if sensors.on_joint else None
    tip = camera(rng, motion, run)
    kept = kept_rows(rng, run.time.size) if gaps else np.arange(run.time.size)
    current = None if run.servo is None else read_current(motion, run, run.servo)[kept]
    idle = sensors.supply
    voltage = None if idle is None else read_supply(rng, motion, run, idle)[kept]
    return Recording(
        name=slot.file,
        bench=slot.bench,
        time=run.time[kept],
        command=run.command[kept, None],
        motor_position=theta[kept, None],
        motor_velocity=speed[kept, None],
        force=force[kept, None],
        joint_position=None if joint is None else joint[kept],
        tip=None if tip is None else tip[kept],
        current=current,
        voltage=voltage,
        current_in=None if current is None else "winding",
        load_cell_rate=sensors.cell_rate,
    )
