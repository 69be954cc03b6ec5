"""Many worlds of one bench, each with its own numbers."""

import numpy as np
import pytest

from tendon_newton.data.recording import BenchOverrides
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model

FLOAT32 = 1e-6
NOMINAL = BenchOverrides()


def test_indices_point_into_their_own_world() -> None:
    """World w's moment arms name joints 2w and 2w + 1, tendon w and tip body 2w + 1."""
    rows = build_model(load_mechanism("finger"), 3, device="cpu").tendon
    assert rows.arm_joint.numpy().tolist() == [0, 1, 2, 3, 4, 5]
    assert rows.arm_dof.numpy().tolist() == [0, 1, 2, 3, 4, 5]
    assert rows.arm_tendon.numpy().tolist() == [0, 0, 1, 1, 2, 2]
    assert rows.world.numpy().tolist() == [0, 1, 2]
    assert rows.tip_body.numpy().tolist() == [1, 3, 5]
    assert rows.tip_world.numpy().tolist() == [0, 1, 2]


def test_overrides_change_one_world_and_leave_the_others() -> None:
    """Stiffness, damping, range and moment arm of world 1 are its own."""
    own = BenchOverrides(
        stiffness=(0.09, 0.06), damping=(1e-3, 2e-3), range=(1.0, 0.9), moment_arm=(0.01, 0.004)
    )
    model = build_model(
        load_mechanism("finger"), 3, overrides=[NOMINAL, own, NOMINAL], device="cpu"
    )
    for array, nominal, changed in (
        (model.joint_stiffness, (0.045, 0.030), (0.09, 0.06)),
        (model.joint_damping, (5e-4, 3e-4), (1e-3, 2e-3)),
        (model.joint_limit_upper, (1.75, 1.40), (1.0, 0.9)),
        (model.joint_limit_lower, (0.0, 0.0), (0.0, 0.0)),
        (model.tendon.arm_coef, (0.0080, 0.0055), (0.01, 0.004)),
        (model.mujoco.tendon_coef, (0.0080, 0.0055), (0.01, 0.004)),
    ):
        expected = np.array([nominal, changed, nominal])
        assert array.numpy().reshape(3, 2) == pytest.approx(expected, rel=FLOAT32)


def test_mass_scales_inertia_and_both_inverses() -> None:
    """A heavier link of the same shape has proportionally more inertia."""
    own = BenchOverrides(mass=(0.024, 0.016))
    model = build_model(load_mechanism("finger"), 2, overrides=[NOMINAL, own], device="cpu")
    mass, inertia = model.body_mass.numpy(), model.body_inertia.numpy()
    assert mass[2:] == pytest.approx([0.024, 0.016], rel=FLOAT32)
    assert inertia[2:] == pytest.approx(2.0 * inertia[:2], rel=FLOAT32)
    assert mass * model.body_inv_mass.numpy() == pytest.approx(np.ones(4), rel=FLOAT32)
    unit = np.broadcast_to(np.eye(3), (4, 3, 3))
    assert inertia @ model.body_inv_inertia.numpy() == pytest.approx(unit, abs=1e-5)


def test_length_moves_centre_of_mass_next_joint_and_tip() -> None:
    """A stretched link keeps its proportions; its inertia grows with the square."""
    own = BenchOverrides(length=(0.045, 0.050))
    model = build_model(load_mechanism("finger"), 2, overrides=[NOMINAL, own], device="cpu")
    assert model.body_com.numpy()[2:, 0] == pytest.approx([0.0225, 0.025], rel=FLOAT32)
    assert model.joint_X_p.numpy()[3, :3] == pytest.approx([0.045, 0.0, 0.0], rel=FLOAT32)
    assert model.tendon.tip_point.numpy()[1] == pytest.approx([0.050, 0.0, 0.0], rel=FLOAT32)
    inertia = model.body_inertia.numpy()[:, 1, 1]
    assert inertia[2:] / inertia[:2] == pytest.approx([1.5**2, 2.0**2], rel=FLOAT32)


def test_pendulum_takes_mass_and_arm_from_its_recording() -> None:
    """Two recordings with two loads are two worlds."""
    loads = [BenchOverrides(mass=(m,), length=(L,)) for m, L in ((0.49, 0.10), (0.2, 0.15))]
    model = build_model(load_mechanism("pendulum"), 2, overrides=loads, device="cpu")
    assert model.body_mass.numpy() == pytest.approx([0.49, 0.2], rel=FLOAT32)
    assert model.body_com.numpy()[:, 2] == pytest.approx([-0.10, -0.15], rel=FLOAT32)


def test_empty_overrides_are_the_nominal_model() -> None:
    """An entry that overrides nothing writes back what was there."""
    finger = load_mechanism("finger")
    plain, written = (
        build_model(finger, 2, device="cpu"),
        build_model(finger, 2, overrides=[NOMINAL, NOMINAL], device="cpu"),
    )
    for name in ("body_mass", "body_com", "body_inertia", "joint_X_p", "joint_limit_upper"):
        expected = getattr(plain, name).numpy()
        assert getattr(written, name).numpy() == pytest.approx(expected, rel=FLOAT32, abs=1e-12)


def test_gradients_are_kept_where_asked_for() -> None:
    """``requires_grad`` reaches Newton's arrays and ours, and survives the overrides."""
    own = BenchOverrides(mass=(0.02, 0.01))
    model = build_model(
        load_mechanism("finger"), 1, overrides=[own], requires_grad=True, device="cpu"
    )
    assert model.body_mass.requires_grad
    assert model.joint_stiffness.requires_grad
    assert model.tendon.arm_coef.requires_grad


@pytest.mark.parametrize(
    ("name", "overrides", "message"),
    [
        ("finger", [BenchOverrides(mass=(0.012,))], "one value per joint"),
        ("finger", [NOMINAL, NOMINAL], "one entry per world"),
        ("spring_weak", [BenchOverrides(length=(0.1,))], "has no length"),
    ],
)
def test_overrides_that_do_not_fit_are_refused(name: str, overrides: list, message: str) -> None:
    """The error says what does not fit."""
    with pytest.raises(InvalidParameter, match=message):
        build_model(load_mechanism(name), 1, overrides=overrides, device="cpu")


def test_a_model_needs_a_world() -> None:
    """Zero worlds are refused."""
    with pytest.raises(InvalidParameter, match="at least one world"):
        build_model(load_mechanism("finger"), 0, device="cpu")
