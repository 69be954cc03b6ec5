"""Causes outside the catalogue do what they say, and are drawn recording by recording."""

import numpy as np
import pytest

from tests.planted.physics.bench import GAIN, SPOOL_RADIUS
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import COMMANDS
from tests.planted.physics.disturbances import draw_disturbances, stuck_rows, wander
from tests.planted.sets.draws import EFFECTS, NEAR, OUTSIDE
from tests.planted.trials import FROZEN, TAUT, jump, rows, run, step_response

TIME = rows(4.0)
STEPS = COMMANDS["steps"](np.random.default_rng(3), TIME.size)


def test_cogging_and_a_dead_spot_depend_on_the_angle() -> None:
    """F = P e + a sin(n theta + phase), and F = P e (1 - depth exp(-((theta - at) / w)^2))."""
    ripple = run(
        "spring_weak", Causes(cogging=0.6, cogging_rate=9.0, cogging_phase=1.0), TIME, STEPS
    )
    expected = GAIN * (STEPS - ripple.angle) + 0.6 * np.sin(9.0 * ripple.angle + 1.0)
    assert ripple.force == pytest.approx(np.maximum(0.0, expected), abs=1e-9)
    causes = Causes(dead_spot=0.7, dead_spot_at=0.8, dead_spot_width=0.15)
    lost = run("spring_weak", causes, TIME, STEPS)
    share = 1.0 - 0.7 * np.exp(-(((lost.angle - 0.8) / 0.15) ** 2))
    expected = GAIN * (STEPS - lost.angle) * share
    assert lost.force == pytest.approx(np.maximum(0.0, expected), abs=1e-9)


def test_a_coarse_servo_hears_the_nearest_step() -> None:
    """F = P (rounded theta_d - theta)."""
    motion = run("spring_weak", Causes(command_step=0.2), TIME, STEPS)
    heard = np.round(STEPS / 0.2) * 0.2
    assert motion.force == pytest.approx(np.maximum(0.0, GAIN * (heard - motion.angle)), abs=1e-9)


def test_gain_and_friction_follow_their_tables() -> None:
    """F = P g(t) e without friction; in a steady pull F is less by the friction of that row."""
    gain = 1.0 + 0.1 * np.sin(TIME)
    motion = run("spring_weak", Causes(), TIME, STEPS, gain=gain)
    expected = GAIN * gain * (STEPS - motion.angle)
    assert motion.force == pytest.approx(np.maximum(0.0, expected), abs=1e-6)
    time = rows(2.0)
    friction = 0.5 + 0.4 * np.sin(3.0 * time)
    pulled = run("spring_weak", Causes(), time, 2.5 + time, friction=friction)
    lost = GAIN * (2.5 + time - pulled.angle) - pulled.force
    assert lost[80:] == pytest.approx(friction[80:], abs=1e-3)


def test_a_jittering_command_takes_effect_at_its_own_time() -> None:
    """With the mechanism frozen, the force jumps when that row's command is due."""
    time = rows(0.2, rate=2000.0)
    lateness = np.where(time < 0.1, 0.0, 0.033)
    causes = Causes(inertia_scale=FROZEN)
    motion = run("spring_weak", causes, time, jump(time, 2.0, 3.0, at=0.1), lateness=lateness)
    jumped = time[np.flatnonzero(motion.force > motion.force[0] + 1.0)[0]]
    assert jumped == pytest.approx(0.133, abs=0.6e-3)  # one row of 0.5 ms


def test_a_mount_gives_way_and_swings() -> None:
    """Frozen in front, it is an oscillator on its own spring and the servo's, damped to a tenth."""
    time, give, pace = rows(1.5), 2e-4, 2.0 * np.pi * 4.0
    causes = Causes(mount_compliance=give, mount_rate=pace, inertia_scale=FROZEN)
    motion = run("spring_weak", causes, time, jump(time, 2.0, 2.5))
    away = motion.angle * SPOOL_RADIUS - motion.coordinates[:, 0]
    assert away[0] == pytest.approx(give * motion.force[0], abs=1e-9)
    natural = pace * np.sqrt(1.0 + give * TAUT)
    end = give * GAIN * 0.5 / (1.0 + give * TAUT)
    expected = end * step_response(time - 0.5, natural, 0.1 * pace)
    assert away - away[0] == pytest.approx(expected, abs=2e-3 * end)


def test_a_wandering_gain_keeps_its_mean_and_size() -> None:
    """Over many recordings the mean is 0 and the deviation 1; it forgets within seconds."""
    time = rows(15.0)
    walks = np.array([wander(np.random.default_rng(seed), time) for seed in range(200)])
    assert abs(walks.mean()) < 0.1
    assert walks.std() == pytest.approx(1.0, rel=0.1)
    assert np.corrcoef(walks[:, 0], walks[:, 800])[0, 1] < 0.3


def test_a_stuck_encoder_repeats_a_row_for_a_while() -> None:
    """Stretches of up to half a second; in between every row is its own."""
    repeated = stuck_rows(np.random.default_rng(0), rows(15.0), rate=1.0)
    own = repeated == np.arange(repeated.size)
    assert 0.5 < own.mean() < 0.95
    assert np.all(repeated <= np.arange(repeated.size))
    assert (np.arange(repeated.size) - repeated).max() <= 2 * 0.5 * 80


def test_disturbances_are_only_those_that_are_planted() -> None:
    """Nothing befalls a recording of a plant without such causes."""
    drawn = draw_disturbances(np.random.default_rng(0), Causes(), TIME)
    assert drawn.knocks == ()
    nothing = (None, None, None, None)
    assert (drawn.gain, drawn.friction, drawn.lateness, drawn.logged) == nothing


def test_what_comes_near_is_an_effect_of_the_catalogue() -> None:
    """And at most three of them, so that there is something left to get wrong."""
    for cause, near in NEAR.items():
        assert cause in OUTSIDE
        assert set(near) <= set(EFFECTS)
        assert len(near) <= 3
