"""Effects of encoder, load cell and clock, against numbers worked out by hand."""

from collections.abc import Sequence

import numpy as np
import pytest

from tendon_newton.data.recording import Array, Indices
from tendon_newton.effects import EFFECTS
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.force_source import Equation
from tendon_newton.simulation.hosts.rollout import Candidates, Rollout
from tests.effect_bench import GAIN, RADIUS, ROW, commanded, run, simulate, steps_and_waves
from tests.made import stated_model

CELL = [name for name in EFFECTS if name.startswith("load_cell")]


def test_the_servo_believes_an_offset_encoder() -> None:
    """Encoder: theta = l / r + phi; servo: F = P (theta_d - theta)."""
    out = run(np.full(10, 2.0), {"position_offset": {"angle": 0.1}})
    np.testing.assert_allclose(out["theta"], out["travel"] / RADIUS + 0.1, rtol=1e-9)
    np.testing.assert_allclose(out["force"], GAIN * (2.0 - out["theta"]), rtol=1e-9)


@pytest.mark.parametrize("name", CELL)
def test_a_load_cell_moves_nothing(name: str) -> None:
    """The mechanism does not know what the cell reads."""
    command = steps_and_waves()
    strength = {EFFECTS[name].parameters[0].name: 0.05}
    if name == "load_cell_gain":
        strength = {"scale": 0.5}
    np.testing.assert_array_equal(run(command, {name: strength})["theta"], run(command)["theta"])


def test_a_cell_scales_shifts_and_drifts() -> None:
    """Gain, then bias, then drift; a biased cell may read below zero."""
    command = steps_and_waves()
    true = run(command)
    effects = {
        "load_cell_gain": {"scale": 1.1},
        "load_cell_bias": {"offset": -0.5},
        "load_cell_drift": {"rate": 0.2},
    }
    read = run(command, effects)
    expected = 1.1 * true["force"] - 0.5 + 0.2 * true["time"]
    np.testing.assert_allclose(read["force"], expected, atol=1e-12)
    assert read["force"].min() < 0.0


@pytest.mark.parametrize("rows", [1, 3])
def test_a_late_cell_reads_what_was(rows: int) -> None:
    """A delay of whole rows shifts the readings by rows; before the first the cell is at rest."""
    command = steps_and_waves()
    true = run(command)["force"]
    read = run(command, {"load_cell_delay": {"delay": rows * ROW}})["force"]
    np.testing.assert_allclose(read[rows:], true[:-rows], atol=1e-9)
    np.testing.assert_allclose(read[:rows], true[0], atol=1e-12)


def test_a_delay_between_rows_reads_between_rows() -> None:
    """On a slow sine the reading is the force half a row ago, halfway between two readings."""
    command = 2.5 + 0.8 * np.sin(0.05 * np.arange(160))
    lag = {"actuator_lag": {"time_constant": 0.05}}  # a force without jumps
    true = run(command, lag)["force"]
    read = run(command, {**lag, "load_cell_delay": {"delay": 0.5 * ROW}})["force"]
    middle = 0.5 * (true[1:] + true[:-1])
    np.testing.assert_allclose(read[1:], middle, atol=8e-3)  # the force's bend between rows


def test_a_lagging_cell_rounds_a_step_off() -> None:
    """Against a wall the force steps at once and the reading follows as 1 - exp(-t / tau)."""
    command = np.where(np.arange(80) < 20, 1.0, 3.0)
    true = run(command, stiffness=1e6)
    read = run(command, {"load_cell_lag": {"time_constant": 0.04}}, stiffness=1e6)
    since = read["time"][20:] - read["time"][20]
    expected = true["force"][-1] + (true["force"][0] - true["force"][-1]) * np.exp(-since / 0.04)
    np.testing.assert_allclose(read["force"][20:], expected, atol=5e-3)


def test_a_wrong_clock_is_another_row_rate() -> None:
    """A fifth more seconds per logged second is the same commands at a fifth lower rate."""
    command = steps_and_waves()
    wrong = simulate(commanded(command), {"sample_period_error": {"scale": 1.2}})
    slow = simulate(commanded(command, row=1.2 * ROW))
    np.testing.assert_allclose(wrong.motor_position, slow.motor_position, atol=1e-10)


class Paused(Equation):
    """An equation's forces, with pauses in two rows."""

    def rounds(self, times: Sequence[Array]) -> Indices:
        """Return the rows in which a launch begins."""
        return np.array([[0], [57], [90]])


def test_a_run_in_three_launches_is_one_run() -> None:
    """Positions, speeds and every memory pass from launch to launch."""
    effects = {
        "actuator_lag": {"time_constant": 0.03},
        "tendon_compliance": {"stiffness": 8000.0},
        "viscoelastic_spring": {"stiffness_ratio": 0.4, "relaxation_time": 0.1},
        "load_cell_lag": {"time_constant": 0.02},
        "load_cell_delay": {"delay": 0.031},
    }
    model = stated_model("ideal", {"gain": GAIN}, effects)
    recordings = [commanded(steps_and_waves())]
    found = []
    for force in (Equation(), Paused()):
        rollout = Rollout(
            load_mechanism("spring_weak"),
            recordings,
            model,
            candidates=Candidates(effects=tuple(EFFECTS)),
            force=force,
        )
        found.append(rollout.run(rollout.base_vectors(model)[None])[0][0])
    whole, parts = found
    np.testing.assert_array_equal(parts.motor_position, whole.motor_position)
    np.testing.assert_allclose(parts.force, whole.force, atol=1e-12)


def test_a_signal_alone_is_what_it_was_among_all() -> None:
    """Who asks for the force gets no other signal, and the same force."""
    recordings = [commanded(steps_and_waves())]
    model = stated_model("ideal", {"gain": GAIN}, {})
    every = Candidates(effects=tuple(EFFECTS))
    rollout = Rollout(load_mechanism("spring_weak"), recordings, model, candidates=every)
    vectors = rollout.base_vectors(model)[None]
    alone = rollout.run_rows(vectors, signals=("force",))
    assert list(alone) == ["force"]
    np.testing.assert_array_equal(alone["force"], rollout.run_rows(vectors)["force"])
