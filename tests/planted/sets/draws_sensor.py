"""Causes in the sensors, drawn by seed."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tests.planted.physics.commands import ROW_RATE
from tests.planted.physics.plant import STEP
from tests.planted.sets.planted import Draw, Planted, either, scale, single

PLANT_STEPS = round(1.0 / (ROW_RATE * STEP))  # Steps of the plant in a row


def position_offset(rng: np.random.Generator, size: float) -> Planted:
    """An encoder's zero 0.03 to 0.15 rad off, either way."""
    return single("angle", "offset", size * either(rng, 0.03, 0.15))


def load_cell_bias(rng: np.random.Generator, size: float) -> Planted:
    """A load cell 0.2 to 1 N off, either way."""
    return single("offset", "cell_bias", size * either(rng, 0.2, 1.0))


def load_cell_gain(rng: np.random.Generator, size: float) -> Planted:
    """A load cell that says 5 to 20 % too little or too much."""
    return single("scale", "cell_gain", scale(rng, 0.05, 0.20, size))


def load_cell_drift(rng: np.random.Generator, size: float) -> Planted:
    """A load cell that drifts by 15 to 60 mN a second, either way."""
    return single("rate", "cell_drift", size * either(rng, 0.015, 0.06))


def load_cell_lag(rng: np.random.Generator, size: float) -> Planted:
    """A load cell with a time constant of 15 to 70 ms."""
    return single("time_constant", "cell_lag", size * float(rng.uniform(0.015, 0.07)))


def load_cell_delay(rng: np.random.Generator, size: float) -> Planted:
    """A load cell whose clock is 20 to 110 ms late."""
    return single("delay", "cell_delay", size * float(rng.uniform(0.02, 0.11)))


def sample_period_error(rng: np.random.Generator, size: float) -> Planted:
    """Rows 4 to 15 % closer or further apart than the log says; whole steps of the plant."""
    away = round(PLANT_STEPS * size * either(rng, 0.04, 0.15))
    return single("scale", "period_scale", 1.0 + away / PLANT_STEPS)


SENSOR: Mapping[str, Draw] = MappingProxyType(
    {
        "position_offset": position_offset,
        "load_cell_bias": load_cell_bias,
        "load_cell_gain": load_cell_gain,
        "load_cell_drift": load_cell_drift,
        "load_cell_lag": load_cell_lag,
        "load_cell_delay": load_cell_delay,
        "sample_period_error": sample_period_error,
    }
)
