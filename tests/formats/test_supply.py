"""The supply voltage behind a register that scatters."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.checks.measures import supply_of
from tendon_newton.data.recording import Array
from tendon_newton.simulation.hosts.rollout import row_inputs, timeline_of
from tests.physics.runs import ROWS, run_of

ROW_COUNT, SCATTER = 800, 0.25  # Rows of a run, and what a register scatters by [V]
TIME = np.arange(ROW_COUNT) / ROWS


def told(voltage: Array) -> Array:
    """Return the supply [V] of a run whose register says so."""
    supply = supply_of(replace(run_of(np.zeros(ROW_COUNT)), voltage=voltage))
    assert supply is not None
    return supply


@pytest.mark.parametrize("form", ["each row", "drawn out", "held"])
def test_readings_that_only_scatter_are_their_mean(form: str, rng: np.random.Generator) -> None:
    """A register that is read every half second tells of one supply, however rows fill it in."""
    count = ROW_COUNT if form == "each row" else 20
    readings = 9.0 + SCATTER * rng.standard_normal(count)
    voltage = np.repeat(readings, ROW_COUNT // count)
    if form == "drawn out":
        voltage = np.interp(TIME, np.linspace(0.0, TIME[-1], count), readings)
    supply = told(voltage)
    assert np.ptp(supply) == 0.0
    # four standard errors of a mean
    assert supply[0] == pytest.approx(9.0, abs=4.0 * SCATTER / np.sqrt(count))


@pytest.mark.parametrize(
    "true",
    [12.0 - 0.1 * TIME, 9.0 + 0.5 * np.sin(6.0 * TIME), np.where(abs(TIME - 4.0) < 1.0, 7.0, 9.0)],
    ids=["drains", "sways", "dips"],
)
def test_a_supply_that_moves_is_followed(true: Array, rng: np.random.Generator) -> None:
    """Without scatter it is what was read; with scatter at most half of that is left."""
    np.testing.assert_array_equal(told(true), true)
    left = told(true + SCATTER * rng.standard_normal(ROW_COUNT)) - true
    assert np.sqrt(np.mean(left**2)) < 0.5 * SCATTER


def test_a_simulated_motor_does_not_follow_the_scatter(rng: np.random.Generator) -> None:
    """What a rollout feeds its motor is the supply, not the register."""
    voltage = 9.0 + SCATTER * rng.standard_normal(ROW_COUNT)
    recording = replace(run_of(np.zeros(ROW_COUNT)), voltage=voltage)
    fed, _ = row_inputs(recording, timeline_of(recording, 0.0, "pwm_servo"))
    assert np.ptp(fed) == 0.0
