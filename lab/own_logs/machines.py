"""Machines of strangers, integrated here; the laws are Newton's and those of a text book.

No code is shared with the simulator, and no number with an asset that comes along.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.planted.owners.strings import Array, Strings

STEP, FINE = 1e-4, 2.5e-5  # [s]
LINE_DAMPING = 5.0  # [N s/m] of a string
STOP, STOP_DAMPING = 30.0, 0.01  # [N m/rad], [N m s/rad] of an end stop
GRAVITY = 9.81  # [m/s^2]
COUNT = 2.0 * np.pi / 4096.0  # [rad] of an encoder
Law = Callable[[float, float, float], float]  # Position, speed and the drive's force -> a force


class FixedArms(Strings):
    """Strings over pulleys: moment arms that do not change.

    Args:
        arms: Arms of every string at every joint [m], shape (S, J).
    """

    def __init__(self, arms: Array) -> None:
        self.arms = self.taken = arms

    def at(self, q: Array) -> tuple[Array, Array]:
        """Return excursions [m], shape (B, S), and arms [m], (B, S, J)."""
        return q @ self.arms.T, np.broadcast_to(self.arms, (len(q), *self.arms.shape))


def one_body(
    command: Array,
    period: float,
    stiffness: float,
    inertia: float,
    resistance: Law,
    limit: Law,
    start: float = 0.0,
) -> tuple[Array, Array]:
    """Move one body by a drive that follows positions, behind dry friction that sticks exactly.

    Args:
        command: Held for a row each, shape (T,).
        period: Time of a row [s].
        stiffness: Force for a unit of position error.
        inertia: Mass [kg] or moment [kg m^2].
        resistance: What opposes the drive besides dry friction.
        limit: Greatest dry friction.
        start: Position at rest.

    Returns:
        Position, and what friction leaves of the drive's force, row by row.
    """
    x, v, every = start, 0.0, round(period / STEP)
    rows = np.zeros((2, len(command)))
    for k in range(len(command) * every):
        force = stiffness * (command[k // every] - x)
        push, most = force - resistance(x, v, force), limit(x, v, force)
        sign = np.sign(v) if v != 0.0 else np.sign(push)
        free = v + STEP * (push - most * sign) / inertia
        stuck = (v == 0.0 and abs(push) < most) or free * v < 0.0
        if k % every == 0:
            rows[:, k // every] = x, resistance(x, v, force) if stuck else force - most * sign
        v = 0.0 if stuck else free
        x += STEP * v
    return rows[0], rows[1]


@dataclass(frozen=True, kw_only=True)
class Motor:
    """A motor behind a position loop, with its gear and what it turns: a shaft or a string's spool.

    All numbers are SI, as seen at the output shaft.
    """

    duty: float = 1.15  # Share of the supply for an error of 1 rad
    supply: float = 5.0
    constant: float = 0.45  # Torque constant, and back EMF for each rad/s
    resistance: float = 4.4
    rotor: float = 1.4e-3
    friction: float = 0.0  # Torque that sticks
    delay: float = 0.0
    profile: float = np.inf  # Greatest speed of its goal
    radius: float = 0.0125  # Of the spool; 1 on a shaft
    slack: float = 0.0  # Loose string
    line: float = 2.0e4  # Stiffness of the string; on a shaft of the coupling

    def torque(self, error: float, speed: float) -> float:
        """Return what it gives at a position error and a speed."""
        share = min(max(self.duty * error, -1.0), 1.0)
        return self.constant * (share * self.supply - self.constant * speed) / self.resistance


@dataclass(frozen=True, kw_only=True)
class Load:
    """What a motor moves: one joint with a spring, a damper and a weight."""

    inertia: float
    arm: float  # Of the string at the joint; 1 on a shaft
    stiffness: float = 0.0
    damping: float = 0.0
    lift: Callable[[float], float] = lambda q: 0.0  # Torque of the weight at an angle
    lowest: float = -np.inf  # Where a stop holds it


def motor_rows(command: Array, period: float, motor: Motor, load: Load) -> tuple[Array, Array]:
    """Move a load by a motor: angles of its shaft and tensions, row by row.

    The log begins with the second command, after the first has been held for as long as it takes:
    the row in which that comes is the first of the result, shape (T - 1,).
    """
    every = round(period / FINE)
    settling = round(1.5 / FINE)
    late = round(motor.delay / FINE)
    told = np.r_[np.full(settling + late, command[0]), np.repeat(command[1:], every)]
    theta = goal = q = w = v = 0.0
    rows = np.zeros((2, len(command) - 1))
    one_way = motor.radius != 1.0
    most = motor.profile * FINE
    for k in range(settling + every * (len(command) - 1)):
        asked = float(told[k])
        goal += min(max(asked - goal, -most), most) if k else asked - goal
        stretch = motor.radius * theta - load.arm * q - motor.slack
        tension = motor.line * stretch
        pulls = stretch > 0.0 or not one_way
        if pulls:
            tension += LINE_DAMPING * (motor.radius * w - load.arm * v)
        tension = max(tension, 0.0) if one_way else tension
        row, between = divmod(k - settling, every)
        if row >= 0 and between == 0:
            rows[:, row] = theta, tension
        push = motor.torque(goal - theta, w) - motor.radius * tension
        sign = np.sign(w) if w != 0.0 else np.sign(push)
        free = w + FINE * (push - motor.friction * sign) / motor.rotor
        stuck = (w == 0.0 and abs(push) < motor.friction) or free * w < 0.0
        w = 0.0 if stuck else free
        theta += FINE * w
        torque = load.arm * tension + load.lift(q) - load.stiffness * q - load.damping * v
        if q < load.lowest:
            torque -= STOP * (q - load.lowest) + STOP_DAMPING * v
        v += FINE * torque / load.inertia
        q += FINE * v
    return rows[0], rows[1]


def position_servo(
    command: Array,
    period: float,
    delay: float = 0.0,
    lag: float = 0.0,
    play: float = 0.0,
    offset: float = 0.0,
    speed: float = np.inf,
) -> Array:
    """Move a shaft that carries nothing to speak of [rad], shape (T,).

    Args:
        command: Held for a row each [rad], shape (T,).
        period: Time of a row [s].
        delay: Time in which the servo hears nothing [s].
        lag: Time constant [s].
        play: Width of the gear's play [rad].
        offset: By how much the encoder reads too high [rad].
        speed: Greatest speed [rad/s].
    """
    step = period / 40
    heard = np.r_[np.full(round(delay / step), command[0]), np.repeat(command, 40)]
    drive = shaft = command[0]
    rows = np.zeros(len(command))
    for k in range(40 * len(command)):
        change = (heard[k] - drive) * (1.0 - np.exp(-step / lag) if lag > 0.0 else 1.0)
        drive += np.clip(change, -speed * step, speed * step)
        shaft = min(max(shaft, drive - play / 2.0), drive + play / 2.0)
        if k % 40 == 0:  # just after the row's command took effect
            rows[k // 40] = shaft
    return rows + offset


def random_steps(
    rng: np.random.Generator, low: float, high: float, rows: int, held: tuple[int, int]
) -> Array:
    """Draw levels, each held for some rows, shape (T,)."""
    levels = rng.uniform(low, high, rows)
    return np.repeat(levels, rng.integers(*held, rows))[:rows]


def sine(rng: np.random.Generator, low: float, high: float, rows: int, turns: float) -> Array:
    """Swing over a range so many times, beginning at its middle, shape (T,)."""
    phase = 2.0 * np.pi * turns * np.arange(rows) / rows
    return 0.5 * (low + high) + 0.5 * (high - low) * np.sin(phase + rng.uniform(0.0, 0.3))
