"""What every folder under assets/ must keep; a new one is tested unasked."""

import newton
import numpy as np
import pytest
import warp as wp

from tendon_newton.mechanisms.asset_library import asset_folder, asset_names
from tendon_newton.mechanisms.authoring.asset_plot import plot_asset
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.geometry.kinematics import posture, tip_position
from tendon_newton.mechanisms.geometry.parts import excursion, moment_arms
from tendon_newton.mechanisms.geometry.statics import closed_position, closing_path
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.rules.mechanism_rules import arm_errors, range_positions
from tendon_newton.mechanisms.worlds import build_model

every_asset = pytest.mark.parametrize("name", asset_names())


@every_asset
def test_asset_passes_usd_validation_and_our_rules(name: str) -> None:
    """Neither USD's validators nor our rules find an error or a warning."""
    assert [f for f in check_asset(name) if f.severity != "note"] == []


@every_asset
def test_links_have_positive_mass_and_inertia(name: str) -> None:
    """Mass > 0 and every inertia matrix is positive definite."""
    for joint in load_mechanism(name).joints:
        assert joint.mass > 0.0
        assert np.all(np.linalg.eigvalsh(joint.inertia) > 0.0)


@every_asset
def test_newton_places_the_links_where_our_kinematics_does(name: str) -> None:
    """``newton.eval_fk`` and our numpy agree on every link, bent halfway."""
    mechanism = load_mechanism(name)
    model = build_model(mechanism, 1, device="cpu")
    q = 0.5 * closed_position(mechanism)
    state = model.state()
    coordinates = state.joint_q.numpy()
    coordinates[: q.size] = q  # behind them stand those of a body that is free to move
    state.joint_q.assign(coordinates)
    newton.eval_fk(model, state.joint_q, state.joint_qd, state)
    frames = posture(mechanism, q)
    origins = state.body_q.numpy()[: q.size, :3]
    assert origins == pytest.approx(np.array(frames.position), abs=1e-6)  # float32 metres
    if mechanism.tip is not None:
        body = wp.transform(*state.body_q.numpy()[mechanism.tip.body])
        tip = wp.transform_point(body, wp.vec3(*mechanism.tip.point))
        assert np.array(tip) == pytest.approx(tip_position(mechanism, q), abs=1e-6)


@every_asset
def test_moment_arms_are_the_slope_of_the_excursion(name: str) -> None:
    """Arm = dl/dq over the whole range, by central differences in float64."""
    mechanism = load_mechanism(name)
    for tendon in mechanism.tendons:
        # an oblique axis comes as a float32 rotation, which turns by 1e-7 of an arm too much
        tolerance = 1e-9 if tendon.route is None else 1e-8
        assert np.max(np.abs(arm_errors(mechanism, tendon))) < tolerance


@every_asset
def test_excursion_grows_as_the_mechanism_closes(name: str) -> None:
    """Winding in closes: l rises strictly from open to closed; that of an opening tendon falls."""
    mechanism = load_mechanism(name)
    positions = range_positions(mechanism, 11)
    for tendon in mechanism.tendons:
        closes = 1.0 if np.all(moment_arms(tendon, positions) >= 0.0) else -1.0
        assert np.all(closes * np.diff(excursion(tendon, positions)) > 0.0)


@every_asset
def test_closing_path_needs_ever_more_force_and_winds_ever_more_tendon(name: str) -> None:
    """Along the friction-free equilibria tension and excursion rise together."""
    path = closing_path(load_mechanism(name), count=11)
    assert np.all(np.diff(path.tension) > 0.0)
    assert np.all(np.diff(path.excursion) > 0.0)


# a hand with a ball is the hand in every panel of the picture
@pytest.mark.parametrize("name", [name for name in asset_names() if name != "hand"])
def test_asset_has_a_picture(name: str, tmp_path) -> None:
    """``asset show`` writes a PNG of some size."""
    path = tmp_path / "picture.png"
    plot_asset(load_mechanism(name), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_size > 20_000


@pytest.mark.parametrize(
    "layer", sorted(asset_folder().rglob("*.usda")), ids=lambda p: f"{p.parent.name}/{p.name}"
)
def test_layer_states_its_units_and_root(layer) -> None:
    """Every layer, not only the interface, says metres, kilograms, z up and its root prim."""
    text = layer.read_text()
    for line in ("metersPerUnit = 1", "kilogramsPerUnit = 1", 'upAxis = "Z"', "defaultPrim = "):
        assert line in text
