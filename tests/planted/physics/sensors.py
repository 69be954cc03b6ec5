"""Sensors: what an encoder, a servo's register, a load cell and a camera make of a motion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.planted.physics.commands import ROW_RATE

Array = NDArray[np.float64]

ENCODER_STEP = 2.0 * np.pi / 4096.0  # [rad]; rounded to the nearest count: floor 0.443 mrad
JOINT_STEP, SLIDE_STEP = 2.0 * np.pi / 16384.0, 1.0e-6  # [rad, m]
CURRENT_STEP = 1.0e-3  # [A]
VOLTAGE_STEP, VOLTAGE_NOISE = 0.1, 0.03  # [V] of a servo's register, and standard deviation
SPEED_STEP = 0.024  # [rad/s]
SPEED_NOISE = 0.02  # [rad/s] standard deviation
FORCE_NOISE = 0.05  # [N] standard deviation
TIP_NOISE = 0.2e-3  # [m] standard deviation of each coordinate


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """How good the sensors are."""

    force_noise: float = FORCE_NOISE  # Standard deviation of the load cell's noise [N]
    noise_colour: float = 0.0  # Correlation of the load cell's noise from one row to the next [1]
    # Readings of the load cell per second [Hz], filled in linearly; None is one per row
    cell_rate: float | None = None
    # Whether joints have encoders of their own; their zeros are where they were switched on
    on_joint: bool = False
    supply: float | None = None  # Voltage of the supply without a load, where it is read [V]


def coloured_noise(rng: np.random.Generator, rows: int, colour: float) -> Array:
    """Noise of standard deviation 1 whose neighbours correlate by ``colour``, shape (rows,)."""
    fresh = rng.standard_normal(rows)
    noise = np.empty(rows)
    noise[0] = fresh[0]
    for k in range(1, rows):
        noise[k] = colour * noise[k - 1] + np.sqrt(1.0 - colour**2) * fresh[k]
    return noise


def encoder(angle: Array) -> Array:
    """Angle as 4096 counts a turn give it, to the nearest count [rad]."""
    return np.round(angle / ENCODER_STEP) * ENCODER_STEP


def speed_register(rng: np.random.Generator, speed: Array) -> Array:
    """Noisy speed in steps of the servo's register [rad/s]."""
    noisy = speed + SPEED_NOISE * rng.standard_normal(speed.size)
    return np.round(noisy / SPEED_STEP) * SPEED_STEP + 0.0  # no negative zeros


def load_cell(rng: np.random.Generator, force: Array, sensors: Sensors) -> Array:
    """Noisy force; a slow cell reads every so many rows from an unknown first one [N]."""
    measured = force + sensors.force_noise * coloured_noise(rng, force.size, sensors.noise_colour)
    if sensors.cell_rate is None:
        return measured
    every = round(ROW_RATE / sensors.cell_rate)
    rows = np.arange(force.size)
    read = rows[int(rng.integers(every)) :: every]
    return np.interp(rows, read, measured[read])


def kept_rows(rng: np.random.Generator, rows: int) -> NDArray[np.intp]:
    """Rows left after a log has lost single rows and a few stretches of 0.1 to 0.4 s.

    The servo heard what the log has lost: these rows' commands were given all the same.
    """
    kept = np.ones(rows, dtype=np.bool_)
    for first in rng.integers(2, rows - 40, size=int(rng.integers(2, 6))):
        kept[first] = False
    for first in rng.integers(2, rows - 40, size=int(rng.integers(1, 4))):
        kept[first : first + int(rng.integers(8, 31))] = False
    return np.flatnonzero(kept)
