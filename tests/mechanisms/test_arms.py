"""An arm of known mass between a joint and its load, against numbers worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.mechanisms.geometry.arms import with_arm, without_arm
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tests.effect_bench import commanded, simulate

LOAD, LENGTH, ARM = 0.5, 0.15, 0.12  # [kg], [m], [kg]


@pytest.mark.parametrize("space", [True, False])
def test_an_arm_can_be_taken_off_again(space: bool) -> None:
    """Two bodies in the plane or in space come back, to rounding (1e-15)."""
    centre = np.array([[0.1, 0.0, -0.2], [0.0, 0.05, -0.1]])
    inertia = np.array([2e-4 * np.eye(3), 1e-4 * np.eye(3)])
    load = (np.array([0.5, 0.2]), centre, inertia) if space else (
        np.array([0.5, 0.2]), centre[:, :2], np.array([2e-4, 1e-4])
    )  # fmt: skip
    arm = np.array([0.1, 0.3])
    for again, first in zip(without_arm(with_arm(load, arm), arm), load, strict=True):
        np.testing.assert_allclose(again, first, atol=1e-15, rtol=1e-12)


def test_half_an_arm_weighs_and_a_third_resists() -> None:
    """A point mass on an arm: m l + a l / 2 for gravity, m l^2 + a l^2 / 3 about the joint."""
    sizes = BenchOverrides(mass=(LOAD,), length=(LENGTH,), arm_mass=(ARM,))
    (joint,) = override_mechanism(load_mechanism("pendulum"), sizes).joints
    centre = float(np.linalg.norm(joint.center_of_mass - joint.child_position))
    assert joint.mass == pytest.approx(LOAD + ARM)
    assert joint.mass * centre == pytest.approx(LOAD * LENGTH + 0.5 * ARM * LENGTH)
    about = joint.inertia[1, 1] + joint.mass * centre**2
    assert about == pytest.approx((LOAD + ARM / 3.0) * LENGTH**2, rel=1e-6)


def test_an_arm_stays_where_a_log_states_another_load() -> None:
    """A model gives the arm, a log its load: both count, in either order, and once."""
    bench = load_mechanism("pendulum")
    arm, load = BenchOverrides(arm_mass=(ARM,)), BenchOverrides(mass=(LOAD,), length=(LENGTH,))
    both = override_mechanism(bench, replace(load, arm_mass=(ARM,)))
    for first, second in ((arm, load), (load, arm)):
        (one,), (other,) = override_mechanism(override_mechanism(bench, first), second).joints, (
            both.joints
        )  # fmt: skip
        assert one.mass == pytest.approx(other.mass)
        np.testing.assert_allclose(one.center_of_mass, other.center_of_mass, atol=1e-12)
        np.testing.assert_allclose(one.inertia, other.inertia, atol=1e-12)


def test_a_heavy_arm_sags_like_a_heavier_load() -> None:
    """At rest against an ideal servo's gain an arm counts as half its mass at the load."""
    recording = commanded(np.full(400, 1.0), "pendulum")
    angles = [
        simulate(
            replace(recording, bench_overrides=BenchOverrides(length=(LENGTH,), **sizes))
        ).motor_position[-1, 0]
        for sizes in (
            {"mass": (LOAD,), "arm_mass": (ARM,)},
            {"mass": (LOAD + 0.5 * ARM,)},
            {"mass": (LOAD,)},
        )
    ]
    assert angles[0] == pytest.approx(angles[1], abs=1e-4)
    assert abs(angles[0] - angles[2]) > 1e-3
