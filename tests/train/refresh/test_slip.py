"""A spool that has slipped: how far, from logs in which the tendon hangs loose at times."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_train.refresh.slip import SlipComparison, best_offset, slip_since, taut_from, with_slip
from tests.diagnosis.in_time.test_changes import FIRST as FITTED
from tests.diagnosis.in_time.test_changes import log_of
from tests.effect_bench import commanded
from tests.physics.runs import ideal_model


def offset_of(model: Model) -> float:
    """Return the offset [rad] that a model has."""
    (own,) = (effect.values for effect in model.effects if effect.name == "position_offset")
    return float(own["angle"])


def test_a_tendon_is_taut_above_the_open_finger() -> None:
    """A spool that has slipped by 0.48 rad leaves it loose about as much farther."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.006})
    before = taut_from([log_of(FITTED, 1)], FITTED)
    # the same commands pull less on it, and let the finger open farther, by 0.13 rad
    assert taut_from([log_of(worn, 1)], FITTED) == pytest.approx(before + 0.48, abs=0.15)


@pytest.mark.parametrize("length", [0.0, 0.0025, 0.006])
def test_a_slip_is_found_where_the_tendon_is_taut(length: float) -> None:
    """Loose tendon of some length is an offset of the encoder; the loose rows do not count."""
    loose = {"tendon_slack": {"length": length}} if length else {}
    worn = ideal_model(coulomb_friction={"force": 0.6}, **loose)
    corrected = with_slip([log_of(worn, 1)], FITTED)
    assert offset_of(corrected) == pytest.approx(length / 0.0125, abs=0.01)  # two steps of the grid
    assert corrected.effects[0] == FITTED.effects[0]


def test_an_offset_of_the_model_is_replaced() -> None:
    """What is found is the new total."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.3})
    before = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.1})
    corrected = with_slip([log_of(worn, 2)], before)
    assert [effect.name for effect in corrected.effects] == ["coulomb_friction", "position_offset"]
    assert offset_of(corrected) == pytest.approx(0.3, abs=0.01)  # two steps of the grid


def test_rows_below_the_open_finger_do_not_count() -> None:
    """Two thirds of the rows are loose and agree on no slip; the others say what it is."""
    offset = np.array([0.0, 0.2, 0.4])
    simulated = np.r_[np.full(40, 0.1), np.linspace(0.5, 1.0, 20)]
    measured = np.r_[np.full(40, 0.1), simulated[40:] + 0.4]
    error = measured - (simulated + offset[:, None])
    assert best_offset(SlipComparison(offset=offset, angle=measured, error=error), 0.2) == 2


RADIUS = 0.0125  # Of the spool [m]
SERVO_RATE = 80.0  # Hz


def servo_log(seed: int, slip: float = 0.0) -> Recording:
    """Return a log of a motor behind friction that pulls at a spring, as far as its host asks.

    J dw/dt = k (command - angle) - b w - pull - friction, in the command's unit [rad].
    """
    rng = np.random.default_rng(seed)
    asked = np.repeat(rng.uniform(-1.5, 4.0, 40), 40)
    angles, angle, rate = [], 0.4, 0.0
    substep = 1.0 / (SERVO_RATE * 20.0)
    for command in asked:
        angles.append(angle)
        for _ in range(20):
            pull = 2.5 * max(0.0, angle - slip - 0.3)
            free = rate + (command - angle - pull - 1.7 * rate) * substep / 0.035
            held = (0.3 + 0.2 * pull) * substep / 0.035
            rate = float(np.sign(free) * max(0.0, abs(free) - held))
            angle += rate * substep
    noise = rng.normal(0.0, 1.0e-3, len(angles))
    log = commanded(asked, bench="finger", row=1.0 / SERVO_RATE)
    return replace(log, motor_position=(np.array(angles) + noise)[:, None])


@pytest.mark.parametrize("slip", [-0.2, 0.0, 0.3, 0.5])
def test_a_slip_is_found_without_any_model(slip: float) -> None:
    """Either way, and none where there is none; 20 mrad are a tenth of a small slip."""
    assert slip_since([servo_log(1)], [servo_log(2, slip)]) == pytest.approx(slip, abs=0.02)


def test_logs_in_which_little_turns_say_nothing() -> None:
    """A finger that was held all the time, and a log without commands."""
    still = replace(servo_log(1), motor_position=np.full((1600, 1), 0.4))
    assert slip_since([servo_log(1)], [still]) is None
    pulled = replace(servo_log(2), command=None, force=np.ones((1600, 1)))
    assert slip_since([servo_log(1)], [pulled]) is None


def test_logs_of_the_new_bench_make_up_for_a_wrong_model() -> None:
    """The model is of another finger altogether; the offset that it had is added to."""
    new, later = servo_log(1), servo_log(2, 0.3)
    before = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.1})
    corrected = with_slip([later], before, [new])
    assert offset_of(corrected) == pytest.approx(0.4, abs=0.02)  # a tenth of a small slip


def test_without_logs_of_the_new_bench_the_model_says_it() -> None:
    """Reference logs that say nothing leave the result as it is without them."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.3 * RADIUS})
    log = log_of(worn, 1)
    still = replace(log, motor_position=np.full_like(log.motor_position, 0.4))
    assert with_slip([log], FITTED, [still]) == with_slip([log], FITTED)
