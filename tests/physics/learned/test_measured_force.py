"""Without commands the measured force drives the mechanism, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.decide.find_causes import find_causes
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidRecording
from tendon_newton.identification import testable
from tendon_newton.identification.study import Study
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tendon_newton.simulation.hosts.rollout import drive_of
from tests.effect_bench import commanded, steps_and_waves
from tests.made import recorded
from tests.physics.runs import RADIUS, ideal_model

Array = NDArray[np.float64]
STEP = 5.0e-4  # [s]
ASLEEP = {
    "command_delay": {"delay": 0.0},
    "coulomb_friction": {"force": 0.0},
    "joint_dry_friction": {"fraction": 0.0},
    "load_cell_bias": {"offset": 0.0},
    "load_cell_gain": {"scale": 1.0},
}
"""All effects that a test wakes, at null: they share a kernel."""


def theta_of(recording: Recording, **effects: dict[str, float]) -> Array:
    """The angle that a model makes of one recording, shape (T,)."""
    model = ideal_model(**{**ASLEEP, **effects})
    return replay([recording], model, time_step=STEP)[0].motor_position[:, 0]


@pytest.fixture(scope="module")
def driven() -> Recording:
    """What the ideal bench logs, without its commands."""
    asked = replace(commanded(steps_and_waves()), force=np.zeros((160, 1)))
    (out,) = replay([asked], ideal_model(**ASLEEP), time_step=STEP)
    return replace(simulated_recording(asked, out), command=None)


def test_the_force_that_a_motion_took_brings_it_back(driven: Recording) -> None:
    """Within 0.08 rad of steps of 5 rad: in the rows after a jump the force sags in a curve."""
    error = theta_of(driven) - driven.motor_position[:, 0]
    assert np.sqrt(np.mean(error**2)) < 0.08
    assert np.sqrt(np.mean(error[90:] ** 2)) < 0.015  # a smooth motion, some rows after a jump
    assert np.ptp(driven.motor_position) > 3.0


def test_the_cell_s_own_errors_are_undone(driven: Recording) -> None:
    """A cell that reads 1.2 F + 0.5 N, and says so in the model, drives the same motion."""
    wrong = replace(driven, force=1.2 * driven.force + 0.5)
    # the sag between rows is taken off before the cell's gain is undone: a fifth of it is missed
    told = theta_of(wrong, load_cell_gain={"scale": 1.2}, load_cell_bias={"offset": 0.5})
    assert np.sqrt(np.mean((told - theta_of(driven)) ** 2)) < 0.03
    assert np.abs(theta_of(wrong) - theta_of(driven)).max() > 0.1


def test_what_lies_before_the_cell_changes_nothing(driven: Recording) -> None:
    """Delay and friction of the servo are in the force already; the joint's friction is not."""
    before = theta_of(driven)
    servo = theta_of(driven, command_delay={"delay": 0.1}, coulomb_friction={"force": 2.0})
    np.testing.assert_array_equal(servo, before)
    assert np.abs(theta_of(driven, joint_dry_friction={"fraction": 0.1}) - before).max() > 0.1


def test_only_what_can_show_is_tried(driven: Recording) -> None:
    """No actuator effect, no command's effect, no lag of the cell; and the report says so."""
    study = Study([driven], ideal_model(), tuple(EFFECTS), time_step=STEP)
    names = testable.testable_effects(study)
    assert {EFFECTS[name].side for name in names} == {"mechanism", "transmission", "sensor"}
    assert not {"tendon_slack", "backlash", "load_cell_lag"} & set(names)
    assert {"load_cell_bias", "joint_stiffness_error", "routing_friction"} <= set(names)
    (note,) = testable.untested_sides(study)
    assert "no theta_d" in note
    assert study.residuals(np.array([[-1]]), np.zeros((1, 1)))[0].force is None


def test_noise_of_the_cell_counts_as_noise_of_the_angle(driven: Recording) -> None:
    """Noise on the force moves the shaft: the floor holds it, for the right model leaves it."""
    noise = 0.2 * np.random.default_rng(3).standard_normal(driven.force.shape)
    noisy = replace(driven, force=driven.force + noise)
    study = Study([noisy], ideal_model(), (), time_step=STEP)
    left = study.residuals(np.array([[-1]]), np.zeros((1, 1)))[0].theta
    assert np.sqrt(np.mean(left[:, 90:] ** 2)) < 1.5 * study.noise.theta
    assert study.noise.theta > 5e-3


def test_recordings_with_and_without_commands_mix(driven: Recording) -> None:
    """A dataset may hold both; one rollout may not."""
    asked = commanded(steps_and_waves())
    out = replay([asked, driven], ideal_model(**ASLEEP), time_step=STEP)
    np.testing.assert_array_equal(out[1].motor_position[:, 0], theta_of(driven))
    with pytest.raises(InvalidRecording, match="all driven by one signal"):
        drive_of([asked, driven])


MASS, VISCOUS, DRY, OFFSET = 2.0, 12.0, 2.5, 0.8  # [kg], [N s/m], [N], [N]


def cart(seed: int) -> Recording:
    """A cart on a rail under a position loop; only its drive's force and its place are logged."""
    rng = np.random.default_rng(seed)
    step, rows, every = 2.0e-4, 1200, 25  # 200 rows a second
    waves = [(rng.uniform(0.15, 0.5), rng.uniform(0.0, 6.28)) for _ in range(3)]
    x, v, force = 0.12, 0.0, 0.0
    log = np.zeros((rows, 3))
    for k in range(rows * every):
        if k % every == 0:
            goal = 0.12 + sum(0.03 * np.sin(6.28 * f * step * k + at) for f, at in waves)
            force = 800.0 * (goal - x) - 80.0 * v
            log[k // every] = x, v, force
        push = force - OFFSET - VISCOUS * v
        sign = np.sign(v) if v != 0.0 else np.sign(push)
        free = v + step * (push - DRY * sign) / MASS
        v = 0.0 if (v == 0.0 and abs(push) < DRY) or free * v < 0.0 else free
        x += step * v
    count = 2.0 * np.pi / 4096.0
    numbers = BenchOverrides(mass=(MASS,), stiffness=(0.0,), damping=(0.0,), range=(0.4,))
    return recorded(
        np.linspace(0.0, step * every * (rows - 1), rows),
        count * np.round(log[:, 0] / RADIUS / count),
        name=f"cart_{seed}",
        bench="spring_weak",
        motor_velocity=log[:, 1] / RADIUS,
        force=log[:, 2] + 0.02 * rng.standard_normal(rows),
        bench_overrides=numbers,
    )


@pytest.mark.slow
def test_a_cart_s_friction_is_named_and_measured() -> None:
    """Dry and viscous friction and a constant offset, each within 2 %, of the whole catalogue.

    Each hides the others: with one alone in the model none of the rest passes, only two together.
    """
    logs = [cart(1), cart(2)]
    study = Study(logs, ideal_model(), tuple(EFFECTS), time_step=1e-3, in_segments=True)
    names = testable.testable_effects(study)
    found = find_causes(logs, study, ideal_model(), names)
    final = found.final
    frictions = {"viscous_friction": VISCOUS * RADIUS, "coulomb_friction": DRY}
    (third,) = set(final.effects) - set(frictions)
    fits = dict(found.classes[third]) | {third: final}
    assert set(fits) == {"load_cell_bias", "gravity_misalignment"}, "on a rail a tilt is an offset"
    numbers = fits["load_cell_bias"].values
    for name, value in (frictions | {"load_cell_bias": OFFSET}).items():
        assert numbers[study.table.columns(name)[0]] == pytest.approx(value, rel=0.02)
