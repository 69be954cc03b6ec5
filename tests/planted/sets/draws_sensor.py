"""Causes in the sensors, drawn by seed."""

from collections.abc import Mapping

import numpy as np

from tests.planted.physics.commands import ROW_RATE
from tests.planted.physics.plant import STEP
from tests.planted.sets.planted import Draw, Planted, either, either_way, evenly, off, single

PLANT_STEPS = round(1.0 / (ROW_RATE * STEP))  # Steps of the plant in a row


def sample_period_error(rng: np.random.Generator, size: float) -> Planted:
    """Rows 4 to 15 % closer or further apart than the log says; whole steps of the plant."""
    away = round(PLANT_STEPS * size * either(rng, 0.04, 0.15))
    return single("scale", "period_scale", 1.0 + away / PLANT_STEPS)


SENSOR: Mapping[str, Draw] = {
    # An encoder's zero 0.03 to 0.15 rad off, either way
    "position_offset": either_way("angle", "offset", 0.03, 0.15),
    # A load cell 0.2 to 1 N off, either way
    "load_cell_bias": either_way("offset", "cell_bias", 0.2, 1.0),
    # A load cell that says 5 to 20 % too little or too much
    "load_cell_gain": off("scale", "cell_gain", 0.05, 0.20),
    # A load cell that drifts by 15 to 60 mN a second, either way
    "load_cell_drift": either_way("rate", "cell_drift", 0.015, 0.06),
    # A load cell with a time constant of 15 to 70 ms
    "load_cell_lag": evenly("time_constant", "cell_lag", 0.015, 0.07),
    # A load cell whose clock is 20 to 110 ms late
    "load_cell_delay": evenly("delay", "cell_delay", 0.02, 0.11),
    "sample_period_error": sample_period_error,
}
FURTHER_SENSORS: Mapping[str, Draw] = {
    # Encoders on joints that read 3 to 12 % too little or too much
    "joint_encoder_gain": off("scale", "joint_gain", 0.03, 0.12),
    # Encoders on joints that are 10 to 60 ms late
    "joint_encoder_delay": evenly("delay", "joint_delay", 0.01, 0.06),
    # A tip that is seen to move 8 to 20 % too little or too far: links may be 5 % longer
    "tip_sensor_gain": off("scale", "tip_gain", 0.08, 0.20),
    # A camera that is 10 to 60 ms late
    "tip_sensor_delay": evenly("delay", "tip_delay", 0.01, 0.06),
    # A motor's current that is read 5 to 20 % too little or too much
    "current_sensor_gain": off("scale", "current_gain", 0.05, 0.20),
    # A register of the current that is 10 to 60 ms late
    "current_sensor_delay": evenly("delay", "current_delay", 0.01, 0.06),
    # A supply that is read 2 to 6 % per newton lower than it is
    "voltage_sensor_sag": evenly("sag", "supply_sag", 0.02, 0.06),
}
"""Causes of benches that have encoders on their joints, a camera, or a servo with a motor."""
