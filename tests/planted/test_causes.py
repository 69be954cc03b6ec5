"""Each cause does in the plant what its definition says; expectations are derived by hand."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.planted.physics.bench import GAIN, GRAVITY, SPOOL_RADIUS
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import COMMANDS
from tests.planted.physics.plant import Motion
from tests.planted.trials import FROZEN, TAUT, WEAK, jump, rows, run, step_response

Array = NDArray[np.float64]

TIME = rows(6.0)
STEPS = COMMANDS["steps"](np.random.default_rng(3), TIME.size)
STIFFNESS, DAMPING, MASS = WEAK.stiffness[0], WEAK.damping[0], WEAK.mass[0]
RAMP = rows(2.0, rate=5000.0)  # so fine that a ramp of commands is no staircase
SLIDE = slice(5000, -1)  # its rows after the start


def weak(causes: Causes, command: Array = STEPS) -> Motion:
    """The weak spring under random steps."""
    return run("spring_weak", causes, TIME[: command.size], command)


def ramp(rate: float) -> Array:
    """A command that pulls or lets out steadily [rad]."""
    return 4.0 + rate * (RAMP - 1.0)


def pulled(causes: Causes, rate: float) -> Motion:
    """The weak spring under such a command."""
    return run("spring_weak", causes, RAMP, ramp(rate))


def asked(motion: Motion, command: Array = STEPS) -> Array:
    """Nominal motor force at the measured angle [N]."""
    return GAIN * (command - motion.angle)


def moved(motion: Motion) -> tuple[Array, Array]:
    """Slide [m] and speed [m/s] of a ramp, after its start."""
    slide = motion.coordinates[:, 0]
    return slide[SLIDE], np.gradient(slide, RAMP[1])[SLIDE]


def test_gain_drift_takes_a_share_of_the_gain_per_second() -> None:
    """F = P (1 - rate t) (theta_d - theta), row by row."""
    motion = weak(Causes(gain_drift=0.03))
    assert motion.force == pytest.approx(np.maximum(0.0, (1 - 0.03 * TIME) * asked(motion)))


def test_a_lag_lets_the_force_approach_its_target_exponentially() -> None:
    """With the mechanism frozen: 63 % of a jump after one time constant, without a step."""
    time = rows(1.0)
    motion = run("spring_weak", Causes(lag=0.05, inertia_scale=FROZEN), time, jump(time, 2.0, 3.0))
    way = 1.0 - np.exp(-np.maximum(time - 0.5, 0.0) / 0.05)
    assert motion.force - motion.force[0] == pytest.approx(GAIN * way, abs=1e-3)


def test_a_deadband_is_taken_off_every_error() -> None:
    """No force within the band, and beyond it the error counts from there."""
    motion = weak(Causes(deadband=0.2))
    error = STEPS - motion.angle
    beyond = np.sign(error) * np.maximum(0.0, np.abs(error) - 0.2)
    assert motion.force == pytest.approx(np.maximum(0.0, GAIN * beyond), abs=1e-9)


def test_a_saturating_motor_keeps_below_its_limit_and_elsewhere_to_the_law() -> None:
    """Only within a fifth of the limit, where the knee is, does it do neither."""
    motion, limit = weak(Causes(saturation=4.0)), 4.0
    ideal = np.maximum(0.0, asked(motion))
    assert motion.force.max() <= limit
    assert motion.force[ideal > 1.2 * limit] == pytest.approx(limit, rel=2e-3)
    assert motion.force[ideal < 0.8 * limit] == pytest.approx(ideal[ideal < 0.8 * limit], abs=0.01)
    assert np.sum(ideal > 1.2 * limit) > 10


def test_a_log_starts_at_rest_however_the_motor_gives_way() -> None:
    """Under a command that stays nothing moves, whatever a motor lacks and all of it at once."""
    lack = {"saturation": 4.0, "sag": 0.05, "fade": 0.01}
    for causes in (*(Causes(**{name: size}) for name, size in lack.items()), Causes(**lack)):
        motion = weak(causes, np.full(80, 6.0))
        assert np.ptp(motion.angle) < 1.0e-6
        assert np.ptp(motion.force) < 1.0e-5


def test_a_speed_limit_brakes_both_ways_and_does_nothing_below() -> None:
    """Winding it pulls less, unwinding it holds tension; the law holds at lower speeds."""
    limit, motion = 6.0, weak(Causes(speed_limit=6.0))
    ideal = np.maximum(0.0, asked(motion))
    assert np.abs(motion.speed).max() < limit + 0.05
    slower = np.abs(motion.speed) < 0.95 * limit
    assert motion.force[slower] == pytest.approx(ideal[slower], abs=1e-9)
    winding, unwinding = motion.speed > 0.99 * limit, motion.speed < -0.99 * limit
    assert (motion.force - ideal)[winding].min() < -1.0
    assert (motion.force - ideal)[unwinding].max() > 1.0


@pytest.mark.parametrize("rate", [0.5, 1.5, -1.5])
def test_stribeck_friction_falls_with_speed(rate: float) -> None:
    """Against the motion: coulomb + (static - coulomb) exp(-(v / (r stribeck_velocity))^2)."""
    motion = pulled(Causes(coulomb=0.6, static=0.5, stribeck_speed=1.2, viscous=1.0), rate)
    pace = motion.speed[SLIDE]
    friction = np.sign(rate) * (0.6 + 0.5 * np.exp(-((pace / 1.2) ** 2))) + 1.0 * pace
    assert (asked(motion, ramp(rate)) - motion.force)[SLIDE] == pytest.approx(friction, abs=2e-3)


def test_a_loose_tendon_leaves_the_motor_to_its_command() -> None:
    """Taut: r theta = l + length. Loose: no force, theta = clip(theta_d, l/r, (l + length)/r)."""
    motion = weak(Causes(slack=0.004))
    slide = motion.coordinates[:, 0]
    taut = motion.force > 0.0
    least, most = slide / SPOOL_RADIUS, (slide + 0.004) / SPOOL_RADIUS
    assert motion.angle[taut] == pytest.approx(most[taut], abs=1e-9)
    assert motion.force == pytest.approx(np.maximum(0.0, GAIN * (STEPS - most)), abs=1e-9)
    assert motion.angle[~taut] == pytest.approx(np.clip(STEPS, least, most)[~taut], abs=1e-9)
    assert np.any((motion.angle == STEPS)[~taut])


def test_friction_keeps_a_loosening_tendon_taut() -> None:
    """Tension is held, and the tendon taut, while the command is already below the angle."""
    motion = weak(Causes(slack=0.002, coulomb=0.8, viscous=1.5))
    held = (motion.force > 0.0) & (motion.angle > STEPS + 0.1)
    assert np.count_nonzero(held) > 5
    taut = (motion.coordinates[:, 0] + 0.002) / SPOOL_RADIUS
    assert motion.angle[held] == pytest.approx(taut[held], abs=1e-9)


def test_a_tendon_stretches_by_force_over_stiffness() -> None:
    """R theta = l + F / k and F = P (theta_d - theta), row by row."""
    motion = weak(Causes(compliance=1.0 / 4e3))
    stretched = motion.coordinates[:, 0] + motion.force / 4e3
    assert motion.angle * SPOOL_RADIUS == pytest.approx(stretched, abs=1e-9)
    assert motion.force == pytest.approx(np.maximum(0.0, asked(motion)), abs=1e-6)


def test_viscous_friction_and_a_stretching_tendon_make_a_lag() -> None:
    """With the mechanism frozen the force relaxes with b / (r k) / (1 + P / (r k))."""
    time = rows(1.0)
    causes = Causes(compliance=1.0 / 4e3, viscous=1.5, inertia_scale=FROZEN)
    motion = run("spring_weak", causes, time, jump(time, 2.0, 3.0))
    slope = GAIN / SPOOL_RADIUS / 4e3
    constant = 1.5 / SPOOL_RADIUS / 4e3 / (1.0 + slope)
    way = 1.0 - np.exp(-np.maximum(time - 0.5, 0.0) / constant)
    expected = GAIN / (1.0 + slope) * way
    assert motion.force - motion.force[0] == pytest.approx(expected, abs=4e-3)  # one step of lead


@pytest.mark.parametrize("rate", [1.0, -1.0])
def test_the_mechanism_feels_the_tension_less_the_capstan(rate: float) -> None:
    """Pulled steadily: F exp(-exponent sign(v)) = k l + d v, and F is the motor's."""
    motion = pulled(Causes(routing=0.2), rate)
    slide, speed = moved(motion)
    felt = motion.force[SLIDE] * np.exp(-0.2 * np.sign(rate))
    assert felt == pytest.approx(STIFFNESS * slide + DAMPING * speed, abs=2e-3)
    assert motion.force == pytest.approx(asked(motion, ramp(rate)), abs=1e-9)


def test_a_thicker_spool_turns_less() -> None:
    """Theta = l / (scale r), and P stays."""
    motion = weak(Causes(radius_scale=1.15))
    turned = motion.coordinates[:, 0] / (1.15 * SPOOL_RADIUS)
    assert motion.angle == pytest.approx(turned, abs=1e-12)
    assert motion.force == pytest.approx(np.maximum(0.0, asked(motion)), abs=1e-9)


@pytest.mark.parametrize(("damping", "inertia"), [(3.0, 1.0), (0.2, 1.0), (1.0, 4.0)])
def test_damping_and_inertia_scale_the_closed_step_response(damping: float, inertia: float) -> None:
    """A damped oscillator of that damping and mass on springs k and P / r."""
    time = rows(1.5)
    causes = Causes(damping_scale=damping, inertia_scale=inertia)
    motion = run("spring_weak", causes, time, jump(time, 2.0, 2.3))
    mass = inertia * MASS
    shape = step_response(
        time - 0.5, np.sqrt((STIFFNESS + TAUT) / mass), damping * DAMPING / (2.0 * mass)
    )
    rest = np.array([2.0, 2.3]) * GAIN / (STIFFNESS + TAUT)
    expected = (rest[0] + (rest[1] - rest[0]) * shape) / SPOOL_RADIUS
    assert motion.angle == pytest.approx(expected, abs=1e-5)


def test_inertia_does_not_change_the_weight() -> None:
    """A finger of fourfold inertia hangs where the nominal one does."""
    time = rows(0.2)
    heavy, nominal = (
        run("finger", Causes(inertia_scale=scale), time, np.full(time.size, 1.5))
        for scale in (4.0, 1.0)
    )
    assert heavy.coordinates == pytest.approx(nominal.coordinates, abs=1e-9)


@pytest.mark.parametrize("rate", [1.0, -1.0])
def test_joint_friction_is_a_share_of_the_springs_greatest_force(rate: float) -> None:
    """Pulled steadily: F = k l + d v + sign(v) fraction k l_max."""
    motion = pulled(Causes(joint_friction=0.05), rate)
    slide, speed = moved(motion)
    expected = STIFFNESS * (slide + np.sign(rate) * 0.05 * WEAK.upper[0]) + DAMPING * speed
    assert motion.force[SLIDE] == pytest.approx(expected, abs=2e-3)


def test_a_stiffening_spring_grows_with_the_cube() -> None:
    """At rest F = k l (1 + beta (l / l_max)^2)."""
    motion = weak(Causes(stiffening=0.8), np.full(80, 4.5))
    slide = motion.coordinates[:, 0]
    expected = STIFFNESS * slide * (1.0 + 0.8 * (slide / WEAK.upper[0]) ** 2)
    assert motion.force == pytest.approx(expected, abs=1e-6)


def test_a_relaxing_spring_adds_stiffness_times_time_times_speed() -> None:
    """Pulled steadily, long after the start: F = k l + (d + ratio k tau) v; at rest F = k l."""
    motion = pulled(Causes(maxwell_ratio=0.5, relaxation=0.1), 1.0)
    slide, speed = moved(motion)
    expected = STIFFNESS * slide + (DAMPING + 0.5 * STIFFNESS * 0.1) * speed
    assert motion.force[SLIDE] == pytest.approx(expected, abs=2e-3)
    assert motion.force[0] == pytest.approx(STIFFNESS * motion.coordinates[0, 0], abs=1e-6)


def test_an_obstruction_adds_its_stiffness_beyond_its_place() -> None:
    """At rest beyond it F = k l + k_o (l - position r); before it nothing is felt."""
    causes = Causes(obstruction=500.0, obstruction_at=0.9)
    for command in (1.2, 4.0):
        motion = weak(causes, np.full(40, command))
        slide = motion.coordinates[:, 0]
        depth = np.maximum(0.0, slide - 0.9 * SPOOL_RADIUS)
        assert np.all(depth > 0.0) == (command > 2.0)
        assert motion.force == pytest.approx(STIFFNESS * slide + 500.0 * depth, abs=1e-6)


def test_tilting_downward_helps_the_tendon() -> None:
    """A rail tipped by an angle carries m g sin(angle); a finger tipped by 90 degrees hangs."""
    motion = weak(Causes(tilt=0.4), np.full(40, 2.0))
    weight = MASS * GRAVITY * np.sin(0.4)
    assert motion.force + weight == pytest.approx(STIFFNESS * motion.coordinates[:, 0], abs=1e-6)
    time = rows(0.1)
    hanging = run("finger", Causes(tilt=np.pi / 2.0), time, np.zeros(time.size))
    assert hanging.coordinates == pytest.approx(0.0, abs=1e-6)
    level = run("finger", Causes(), time, np.zeros(time.size))
    assert level.coordinates.min() > 0.03


def test_the_cell_scales_shifts_and_drifts_without_a_clip() -> None:
    """Gain, then bias, then drift from the first row on; readings below zero stay."""
    motion = weak(Causes(cell_gain=0.9, cell_bias=-0.5, cell_drift=0.03))
    assert motion.cell == pytest.approx(0.9 * motion.force - 0.5 + 0.03 * TIME, abs=1e-12)
    assert motion.cell.min() < 0.0


def test_a_late_cell_shows_what_was_two_rows_ago() -> None:
    """A clock 25 ms late shifts the readings by two rows, and the first force fills in."""
    motion = weak(Causes(cell_delay=0.025))
    assert motion.cell[2:] == pytest.approx(motion.force[:-2], abs=1e-9)
    assert motion.cell[:2] == pytest.approx(motion.force[0], abs=1e-9)
    between = weak(Causes(cell_delay=0.03))
    assert np.abs(between.cell[2:] - between.force[:-2]).max() > 0.1


def test_a_lagging_cell_approaches_the_force_exponentially() -> None:
    """With the mechanism frozen: 63 % of a jump after one time constant."""
    time = rows(1.0)
    motion = run(
        "spring_weak", Causes(cell_lag=0.05, inertia_scale=FROZEN), time, jump(time, 2.0, 3.0)
    )
    way = 1.0 - np.exp(-np.maximum(time - 0.5, 0.0) / 0.05)
    assert motion.cell - motion.force[0] == pytest.approx(GAIN * way, abs=2e-3)
    assert motion.force - motion.force[0] == pytest.approx(GAIN * (time >= 0.5), abs=1e-5)


def test_the_second_form_of_the_plant_has_rounder_knees_and_bristles_that_slide_at_once() -> None:
    """Far from knees and edges both forms give the same, and near them they do not."""
    for causes in (Causes(saturation=4.0), Causes(deadband=0.2), Causes(coulomb=0.6)):
        first, second = weak(causes), weak(replace(causes, second_form=True))
        apart = np.abs(first.force - second.force)
        assert 0.01 < apart.max() < 0.4, causes
        assert np.median(apart) < 5e-3, causes  # a tenth of what a cell resolves


def test_bristles_of_the_second_form_hold_below_the_friction_and_slide_at_it() -> None:
    """A pull of 0.4 N against 1 N bends them in proportion."""
    time, causes = rows(4.0), Causes(coulomb=1.0, second_form=True)
    held = run("spring_weak", causes, time, jump(time, 2.0, 2.0 + 0.4 / GAIN))
    moved = held.coordinates[-1, 0] - held.coordinates[0, 0]
    assert moved == pytest.approx(0.4 * causes.bristle / 0.632, rel=0.05)
