"""The nominal bench, number by number, read back from the built Newton model."""

import numpy as np
import pytest

from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model

FLOAT32 = 1e-6  # relative: Newton's arrays are float32, limits pass through degrees

SLIDER = {
    "body_mass": [0.05],
    "joint_damping": [5.0],
    "joint_rest_q": [0.0],
    "joint_friction": [0.0],
    "joint_limit_lower": [0.0],
    "joint_limit_upper": [0.08],
    "joint_limit_ke": [1.5e5],
    "joint_limit_kd": [80.0],
    "joint_axis": [[1.0, 0.0, 0.0]],
}
NUMBERS: dict[str, dict[str, list]] = {
    "finger": {
        "body_mass": [0.012, 0.008],
        "body_com": [[0.015, 0.0, 0.0], [0.0125, 0.0, 0.0]],
        "joint_stiffness": [0.045, 0.030],
        "joint_rest_q": [0.0, 0.0],
        "joint_damping": [5e-4, 3e-4],
        "joint_friction": [0.0, 0.0],
        "joint_armature": [0.0, 0.0],
        "joint_limit_lower": [0.0, 0.0],
        "joint_limit_upper": [1.75, 1.40],
        "joint_limit_ke": [30.0, 30.0],
        "joint_limit_kd": [0.02, 0.004],
        "joint_axis": [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        "joint_parent": [-1, 0],
        "gravity": [[0.0, 0.0, -9.81]],
    },
    "spring_weak": {**SLIDER, "joint_stiffness": [200.0]},
    "spring_strong": {**SLIDER, "joint_stiffness": [800.0]},
    "pendulum": {
        "body_mass": [0.49],
        "body_com": [[0.0, 0.0, -0.10]],
        "joint_stiffness": [0.0],
        "joint_damping": [0.0],
        "joint_friction": [0.0],
        "joint_axis": [[0.0, 1.0, 0.0]],
    },
}
TENDONS: dict[str, dict[str, list]] = {
    "finger": {
        "arm_coef": [0.0080, 0.0055],
        "spool_radius": [0.0125],
        "force_limit": [21.0],
        "excursion_offset": [0.0],
        "direct": [0],
        "tip_body": [1],
        "tip_point": [[0.025, 0.0, 0.0]],
    },
    "spring_weak": {"arm_coef": [1.0], "spool_radius": [0.0125], "force_limit": [21.0]},
    "spring_strong": {"arm_coef": [1.0], "spool_radius": [0.0125], "direct": [0]},
    "pendulum": {"arm_coef": [1.0], "spool_radius": [1.0], "direct": [1], "tip_body": [0]},
}


def cases(table: dict[str, dict[str, list]]) -> list[tuple[str, str]]:
    """List (asset, array) pairs of a table."""
    return [(asset, array) for asset, arrays in table.items() for array in arrays]


@pytest.mark.parametrize(("asset", "array"), cases(NUMBERS))
def test_newton_model_holds_the_nominal_number(asset: str, array: str) -> None:
    """Each array of the one-world model equals the nominal bench."""
    values = getattr(build_model(load_mechanism(asset), 1, device="cpu"), array).numpy()
    expected = np.array(NUMBERS[asset][array])
    assert values[: len(expected)] == pytest.approx(expected, rel=FLOAT32)


@pytest.mark.parametrize(("asset", "array"), cases(TENDONS))
def test_tendon_rows_hold_the_nominal_number(asset: str, array: str) -> None:
    """Each array under ``model.tendon`` equals the nominal bench."""
    rows = build_model(load_mechanism(asset), 1, device="cpu").tendon
    assert getattr(rows, array).numpy() == pytest.approx(
        np.array(TENDONS[asset][array]), rel=FLOAT32
    )


def test_phalanges_are_slender_rods_across() -> None:
    """Inertia about the centre of mass, across the bone, is m L^2 / 12."""
    mechanism = load_mechanism("finger")
    assert mechanism.link_lengths == pytest.approx((0.030, 0.025), rel=FLOAT32)
    for joint in mechanism.joints:
        assert joint.length is not None
        assert joint.inertia[1, 1] == pytest.approx(joint.mass * joint.length**2 / 12.0, rel=1e-6)


def test_inertia_of_the_point_mass_does_not_matter() -> None:
    """What the solvers need beside m L^2 changes the pendulum's frequency by less than 1e-6."""
    (joint,) = load_mechanism("pendulum").joints
    assert joint.inertia[1, 1] / (joint.mass * 0.10**2) < 1e-6


def test_springs_share_everything_but_stiffness() -> None:
    """The two sliders differ in one number."""
    weak, strong = load_mechanism("spring_weak"), load_mechanism("spring_strong")
    differing = [
        name
        for name, value in vars(weak.joints[0]).items()
        if name != "prim" and not np.array_equal(value, vars(strong.joints[0])[name])
    ]
    assert differing == ["stiffness"]
