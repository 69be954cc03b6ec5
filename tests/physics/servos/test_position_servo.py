"""A servo of which only the position is known: what each effect does to it, in closed form."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile, InvalidRecording
from tendon_newton.identification import testable
from tendon_newton.identification.study import Study
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.kernels.position_kernels import POSITION_EFFECTS
from tests.effect_bench import commanded
from tests.made import recorded, stated_model
from tests.physics.runs import ideal_model

Array = NDArray[np.float64]
ROW = 0.02  # [s]
STAIRS = np.repeat([0.0, 1.0, 0.4, 0.5, 0.45], 25)
WAVE = 0.5 * np.sin(2.0 * np.pi * 0.5 * ROW * np.arange(200))


def servo_model(**effects: Mapping[str, float]) -> Model:
    """An ideal position servo with some effects."""
    return stated_model("ideal_position", {}, effects)


def theta(command: Array, start: float | None = None, **effects: Mapping[str, float]) -> Array:
    """The angle at each row, shape (T,)."""
    recording = commanded(command, "servo", ROW)
    if start is not None:
        position = np.full((len(command), 1), start)
        recording = replace(recording, motor_position=position, start="first_row")
    return replay([recording], servo_model(**effects))[0].motor_position[:, 0]


def test_without_effects_it_is_where_it_was_told_to_be() -> None:
    """The angle is the command in every row, to rounding."""
    np.testing.assert_allclose(theta(STAIRS), STAIRS, atol=1e-12)
    np.testing.assert_allclose(theta(WAVE), WAVE, atol=1e-12)


def test_a_delay_shifts_the_staircase() -> None:
    """theta(t) = theta_d(t - 60 ms): three rows."""
    late = theta(STAIRS, command_delay={"delay": 3.0 * ROW - 1e-6})
    np.testing.assert_allclose(late[3:], STAIRS[:-3], atol=1e-9)


def test_a_lag_answers_a_step_exponentially() -> None:
    """Exact for a command that stands still, whatever the step (1e-12: rounding)."""
    out = theta(STAIRS, actuator_lag={"time_constant": 0.05})
    since = ROW * np.arange(25)
    np.testing.assert_allclose(out[25:50], 1.0 - np.exp(-since / 0.05), atol=1e-12)


def test_a_deadband_rests_and_follows_at_its_width() -> None:
    """A step of 50 mrad is not answered by a band of 60 mrad; a long one ends beside its goal."""
    out = theta(STAIRS, deadband={"width": 0.06})
    np.testing.assert_allclose(out[25:50], 0.94, atol=1e-12)
    np.testing.assert_allclose(out[50:75], 0.46, atol=1e-12)
    np.testing.assert_allclose(out[75:], 0.46, atol=1e-12)


def test_play_lags_by_half_its_width_either_way() -> None:
    """The shaft follows behind the drive, and rests while the drive crosses the gap."""
    out = theta(WAVE, backlash={"width": 0.1})
    rising, falling = slice(10, 25), slice(45, 75)
    np.testing.assert_allclose(out[rising], WAVE[rising] - 0.05, atol=1e-12)
    np.testing.assert_allclose(out[falling], WAVE[falling] + 0.05, atol=1e-12)


def test_a_speed_limit_makes_ramps_of_steps() -> None:
    """One radian at 4 rad/s takes a quarter of a second."""
    out = theta(STAIRS, speed_limit={"limit": 4.0})
    np.testing.assert_allclose(out[25:38], 4.0 * ROW * np.arange(13), atol=1e-9)
    assert out[40] == pytest.approx(1.0, abs=1e-12)


def test_a_profile_speeds_up_and_slows_down() -> None:
    """One radian at 10 rad/s^2, in closed form: half the way up, half down; the speed is free."""
    limit = 10.0
    out = theta(STAIRS, acceleration_limit={"limit": limit, "speed": 100.0})
    t = ROW * np.arange(25)
    end = 2.0 / np.sqrt(limit)
    left = np.maximum(end - t, 0.0)
    expected = np.where(t < 0.5 * end, 0.5 * limit * t**2, 1.0 - 0.5 * limit * left**2)
    np.testing.assert_allclose(out[25:49], expected[:24], atol=1e-9)


def test_a_profile_that_is_too_fast_for_its_goal_comes_back() -> None:
    """At 3 rad/s 0.45 rad are what 10 rad/s^2 need to stop: 0.7 are enough, 0.3 lack 0.15."""
    limit, fast = 10.0, 15 * ROW
    way = 0.5 * limit * fast**2
    for ahead, passed in ((0.7, 0.0), (0.3, 0.15)):
        command = np.concatenate([np.repeat([0.0, 50.0], [10, 15]), np.full(60, way + ahead)])
        out = theta(command, acceleration_limit={"limit": limit, "speed": 100.0})
        assert out[25] == pytest.approx(way, abs=1e-9)
        assert out.max() - (way + ahead) == pytest.approx(passed, abs=2e-3)
        assert out[-1] == pytest.approx(way + ahead, abs=1e-9)


def test_a_sine_that_asks_for_more_than_a_profile_gives_loses_amplitude() -> None:
    """2 Hz and 0.4 rad ask for 63 rad/s^2: the goal never goes faster than a quarter at 39."""
    time = ROW * np.arange(400)
    wave = 0.4 * np.sin(4.0 * np.pi * time)
    slow = 0.1 * np.sin(4.0 * np.pi * time)
    held = theta(wave, acceleration_limit={"limit": 39.0, "speed": 100.0})
    free = theta(slow, acceleration_limit={"limit": 39.0, "speed": 100.0})
    assert np.ptp(held[100:]) < 0.9 * np.ptp(wave)
    assert np.ptp(free[100:]) == pytest.approx(np.ptp(slow), rel=0.1)


def test_an_offset_shifts_what_is_reported() -> None:
    """By the same angle everywhere; a start where it was measured is met all the same."""
    np.testing.assert_allclose(theta(STAIRS, position_offset={"angle": 0.1}), STAIRS + 0.1)
    held = theta(np.zeros(5), start=0.03, deadband={"width": 0.05})
    np.testing.assert_allclose(held, 0.03, atol=1e-12)


def test_a_load_takes_the_shaft_from_its_goal_and_a_deadband_holds_it_there() -> None:
    """The goal is theta_d + s tau; the shaft rests while that moves by less than the band."""
    load = np.repeat([0.0, 0.5, -1.0], 50)
    recording = replace(commanded(np.zeros(150), "servo", ROW), joint_load=load)
    soft = replace(
        servo_model(), actuator=NamedValues(name="ideal_position", values={"compliance": 0.08})
    )
    banded = replace(soft, effects=(NamedValues(name="deadband", values={"width": 0.05}),))
    (free,), (held,) = (replay([recording], model) for model in (soft, banded))
    np.testing.assert_allclose(free.motor_position[1:, 0], 0.08 * load[1:], atol=1e-12)
    rests = np.repeat([0.0, 0.0, -0.03], 50)
    np.testing.assert_allclose(held.motor_position[1:, 0], rests[1:], atol=1e-12)


def test_torque_off_leaves_the_shaft_where_it_is() -> None:
    """Without torque nothing is known but where it was."""
    enabled = np.arange(len(STAIRS)) < 60
    recording = replace(commanded(STAIRS, "servo", ROW), enabled=enabled)
    out = replay([recording], servo_model())[0].motor_position[:, 0]
    np.testing.assert_array_equal(out[60:], 0.4)


def test_only_effects_on_positions_are_tried_and_held() -> None:
    """Friction needs a force, and a tendon needs one too."""
    study = Study([commanded(WAVE, "servo", ROW)], servo_model(), tuple(EFFECTS))
    names = set(testable.testable_effects(study))
    assert names <= set(POSITION_EFFECTS)
    assert {"command_delay", "actuator_lag", "deadband", "backlash"} <= names
    with pytest.raises(InvalidModelFile, match="no place for 'coulomb_friction'"):
        theta(WAVE, coulomb_friction={"force": 1.0})
    with pytest.raises(InvalidModelFile, match="turns its only joint directly"):
        replay([commanded(WAVE, "finger")], servo_model())
    still = np.zeros((5, 1))
    driven = recorded(np.linspace(0.0, 4.0 * ROW, 5), still, force=still)
    with pytest.raises(InvalidRecording, match="follows theta_d"):
        replay([driven], servo_model())


@pytest.mark.parametrize("bench", ["servo", "pendulum"])
def test_a_shaft_may_have_play_but_no_string(bench: str) -> None:
    """Of the transmission, a gear's play is tried on a bench whose servo turns it directly."""
    model = servo_model() if bench == "servo" else ideal_model()
    study = Study([commanded(WAVE, bench, ROW)], model, tuple(EFFECTS))
    names = testable.testable_effects(study)
    assert [name for name in names if EFFECTS[name].side == "transmission"] == ["backlash"]


def test_the_whole_catalogue_at_null_moves_no_position() -> None:
    """Effects of force share stages with those of position; what they remember is no angle."""
    study = Study([commanded(STAIRS, "servo", ROW)], servo_model(), tuple(EFFECTS))
    (simulated,) = study.trajectories({})
    np.testing.assert_allclose(simulated.motor_position[:, 0], STAIRS, atol=1e-12)


def test_the_causes_of_a_made_up_servo_are_measured() -> None:
    """Delay, lag and deadband of a servo written down here, within 3 %, from its position alone."""
    step, delay, lag, band = 1.0e-3, 0.04, 0.06, 0.01
    rows = np.arange(900)
    goal = 0.3 * np.sin(0.02 * rows + 6e-5 * rows**2)
    x, measured = 0.0, np.zeros(len(rows))
    for k in range(len(rows) * 20):
        if k % 20 == 0:
            measured[k // 20] = x
        asked = goal[max(0, int((k * step - delay) / ROW + 1e-9))]
        error = asked - x
        error = np.sign(error) * max(0.0, abs(error) - band)
        x += (1.0 - np.exp(-step / lag)) * error
    count = 2.0 * np.pi / 4096.0
    recording = replace(
        commanded(goal, "servo", ROW), motor_position=count * np.round(measured[:, None] / count)
    )
    names = ("command_delay", "actuator_lag", "deadband")
    study = Study([recording], servo_model(), names)
    worlds = SearchWorlds(study)
    fit = fit_set_anew(worlds, servo_model(), names)
    values = list(values_of(worlds, fit.columns, fit.place).values())
    assert values == pytest.approx([delay, lag, band], rel=0.03)


def test_rows_in_which_something_solid_holds_the_shaft_are_not_compared() -> None:
    """A stop at -0.3 rad in the way of 0.5: from arrival to leaving (25 mrad give way there)."""
    blocked = replace(commanded(WAVE, "servo", ROW), motor_position=np.maximum(WAVE, -0.3)[:, None])
    study = Study([blocked], servo_model(), ())
    trusted = study.timeline(0).trusted
    np.testing.assert_array_equal(trusted, WAVE >= -0.275)
