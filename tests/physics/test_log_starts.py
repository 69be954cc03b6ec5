"""A log that begins with a jump is simulated as the longer log that it is part of."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.checks.first_rows import first_row
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.identification.cutting import rows_of
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.timeline import make_timeline
from tests.made import stated_model
from tests.physics.runs import held_run, ideal_model, run_of

RATE, COUNT = 100.0, 2.0 * np.pi / 4096.0
BEGINS = 50  # Row of the first jump; what stands before it is cut away


def followed(command: Array, *, late: float = 0.06, slow: float = 0.05, sag: float = 0.0) -> Array:
    """Return the readings of a shaft that follows a held command late and slowly [rad]."""
    fine = np.repeat(command, 10)
    fine = np.r_[np.full(round(late * 10 * RATE), fine[0]), fine][: len(fine)]
    shaft, out = fine[0], np.zeros(len(fine))
    for k, asked in enumerate(fine):
        out[k] = shaft
        shaft += (asked - shaft) * (1.0 - np.exp(-0.1 / RATE / slow))
    return COUNT * np.round((out[::10] - sag) / COUNT)


def log_of(command: Array, angle: Array) -> Recording:
    """Return a log of the servo bench."""
    run = run_of(command, bench="servo", rate=RATE)
    return replace(
        run, motor_position=angle[:, None], motor_velocity=np.gradient(angle, 1.0 / RATE)[:, None]
    )


def stairs(rng: np.random.Generator) -> Array:
    """Return levels [rad], each held for a second; the first lasts until the row `BEGINS`."""
    return np.r_[np.full(BEGINS, 0.2), np.repeat(rng.uniform(-1.0, 1.0, 6), 100)]


@pytest.mark.parametrize("sag", [0.0, 0.15])
def test_a_servo_that_stands_had_been_told_to_stand_there(sag, rng) -> None:
    """The log begins with the jump; the command before it is the angle and the sag of other rests.

    To a count and a half: two readings of a count.
    """
    command = stairs(rng)
    log = log_of(command, followed(command, sag=sag))
    begin = first_row(rows_of(log, slice(BEGINS, len(command)), "jump"))
    assert begin.before == pytest.approx(0.2, abs=1.5 * COUNT)
    assert (begin.rate[0], begin.doubtful) == (0.0, 0.0)


def test_a_servo_at_rest_under_its_first_command_had_been_told_the_same(rng) -> None:
    """With half a second of rest in front nothing is open, whatever friction holds."""
    command = stairs(rng)
    log = log_of(command, followed(command) + 0.03)
    assert first_row(replace(log, start="first_row")).before == pytest.approx(0.2)


def test_a_servo_that_hangs_with_its_motor_off_says_nothing_of_its_sag(rng) -> None:
    """Told -1.5 rad it hangs at zero to the end; it had been told to stand where it began."""
    command = np.r_[np.linspace(0.2, -1.5, 400), np.full(300, -1.5)]
    angle = followed(command)
    angle[450:] = 0.0
    log = replace(log_of(command, angle), start="first_row", enabled=np.arange(len(command)) < 430)
    assert first_row(log).before == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize("after", [0.1, 0.14])
def test_of_a_servo_in_motion_nobody_knows_what_it_had_been_told(after, rng) -> None:
    """It was on its way to its command; rows count once its past is gone: after delay and lags.

    The past is a first-order lag of 50 ms late by 60: beyond 0.23 s under 3 % of it is left.
    """
    command = stairs(rng)
    log = log_of(command, followed(command))
    part = rows_of(log, slice(BEGINS + round(after * RATE), len(command)), "moving")
    begin = first_row(part)
    assert begin.before == pytest.approx(command[BEGINS])
    assert abs(begin.rate[0]) > 1.0
    assert 0.23 < begin.doubtful < 0.5
    trusted = make_timeline(part).trusted
    assert trusted.sum() == pytest.approx(len(trusted) - RATE * begin.doubtful, abs=1.0)


def test_what_was_not_measured_is_as_it_is_stated() -> None:
    """A run that is only planned has one angle and a speed: both are taken at their word."""
    begin = first_row(run_of(np.full(40, 1.0), start="first_row", angle=0.3, speed=2.0))
    assert (begin.angle[0], begin.rate[0], begin.doubtful) == (0.3, 2.0, 0.0)
    assert begin.before == pytest.approx(1.0)


def test_a_jump_at_the_start_of_a_log_is_late_as_any_other(rng) -> None:
    """A lag and a delay act on the first jump too (2 counts of the encoder)."""
    command = stairs(rng)
    whole = log_of(command, followed(command))
    effects = (
        NamedValues(name="command_delay", values={"delay": 0.06}),
        NamedValues(name="actuator_lag", values={"time_constant": 0.05}),
    )
    model = Model(actuator=NamedValues(name="ideal_position", values={}), effects=effects)
    (out,) = replay([rows_of(whole, slice(BEGINS, len(command)), "jump")], model)
    np.testing.assert_allclose(
        out.motor_position[:, 0], whole.motor_position[BEGINS:, 0], atol=2.0 * COUNT
    )


def test_a_string_that_hung_loose_is_wound_in_first() -> None:
    """A profile's goal, the lag of a motor and 3 mm of loose string begin where they were.

    The longer run has a second of rest in front (0.2 mrad: a tenth of an encoder's count).
    """
    command = np.r_[np.full(80, 0.05), np.full(120, 1.6), np.full(120, 0.6)]
    servo = {"duty_per_rad": 1.15, "max_duty": 1.0, "supply_voltage": 5.0, "torque_constant": 0.45,
             "resistance": 4.4, "armature": 1.4e-3, "spool_radius": 0.015}  # fmt: skip
    effects = {
        "command_delay": {"delay": 0.03},
        "command_rate_limit": {"limit": 2.5},
        "actuator_lag": {"time_constant": 0.02},
        "tendon_slack": {"length": 3.0e-3},
    }
    model = stated_model("pwm_servo", servo, effects)
    run = run_of(command, bench="spring_weak")
    (whole,) = replay([run], model)
    measured = replace(
        run, motor_position=whole.motor_position, motor_velocity=whole.motor_velocity
    )
    (part,) = replay([rows_of(measured, slice(80, len(command)), "jump")], model)
    np.testing.assert_allclose(part.motor_position, whole.motor_position[80:], atol=2.0e-4)


def test_a_servo_that_friction_holds_begins_where_it_rests() -> None:
    """Its log begins amid a rest short of equilibrium; a model without friction begins in that.

    To a tenth of an encoder's count.
    """
    sticky = ideal_model(coulomb_friction={"force": 0.3})
    free = ideal_model(coulomb_friction={"force": 0.0})
    measured = held_run(sticky, "spring_weak")
    assert measured.command is not None
    run = run_of(measured.command[:, 0], bench="spring_weak")
    held, loose, planned = (
        replay([r], m)[0].motor_position
        for r, m in ((measured, sticky), (measured, free), (run, free))
    )
    assert planned[0, 0] - measured.motor_position[0, 0] > 10.0 * COUNT
    np.testing.assert_allclose(held, measured.motor_position, atol=0.1 * COUNT)
    np.testing.assert_array_equal(loose, planned)
