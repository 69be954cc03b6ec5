"""What every folder under assets/ must keep; a new one is tested unasked."""

from pathlib import Path

import newton
import numpy as np
import pytest
import warp as wp

from tendon_hardware.servos import SERVOS
from tendon_newton.cli import main
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.mechanisms.asset_library import asset_folder, asset_names
from tendon_newton.mechanisms.authoring.asset_plot import plot_asset
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.geometry.kinematics import posture, tip_position
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.parts import excursion, moment_arms
from tendon_newton.mechanisms.geometry.statics import closed_position, closing_path
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.rules.mechanism_rules import arm_errors, range_positions
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.hosts.rollout import Stepping, Trajectory
from tests.bad_input.damage import refusal
from tests.made import stated_model
from tests.physics.runs import run_of
from tests.proposed import proposed

FLOAT32 = 1e-6  # relative: Newton's arrays are float32, limits pass through degrees

every_asset = pytest.mark.parametrize("name", asset_names())


@every_asset
def test_asset_passes_usd_validation_and_our_rules(name: str) -> None:
    """Neither USD's validators nor our rules find an error or a warning."""
    assert [f for f in check_asset(name, SERVOS) if f.severity != "note"] == []


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


# a hand with a ball or a pen is the hand in every panel of the picture
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name.startswith("hand_") else [])
        for name in asset_names()
        if name != "hand"
    ],
)
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


DRIVE = {"kp": 4000.0, "kd": 0.0, "max_torque": 50.0, "armature": 1e-8, "spool_radius": 1.0}


def made(folder: Path, *words: str) -> str:
    """Write a bench, let it be checked, and return the file to open."""
    assert main(["asset", "new", words[0], "--folder", str(folder), *words[1:]]) == 0
    path = folder / words[0] / f"{words[0]}.usda"
    assert main(["asset", "check", str(path)]) == 0
    return str(path)


def pushed(path: str, goal: float, rows: int, drive: dict[str, float]) -> Trajectory:
    """Ask a bench for a far goal from rest at 0, 1 ms a row."""
    name = Path(path).stem
    run = run_of(np.full(rows, goal), bench=name, rate=1000.0, start="first_row")
    model = stated_model("pd_torque", drive)
    rollout = rollout_of(load_mechanism(path), [run], model, stepping=Stepping(time_step=2.5e-4))
    return rollout.run(rollout.base_vectors(model)[None])[0][0]


def test_a_cart_gains_force_over_mass(tmp_path: Path) -> None:
    """95 kg under 50 N move by F t^2 / (2 m), pushed either way; angles are metres."""
    path = made(tmp_path, "cart", "--kind", "slider", "--mass", "95", "--range", "2")
    for goal in (1.0, -1.0):
        out = pushed(path, goal, 400, DRIVE)
        expected = np.sign(goal) * 0.5 * 50.0 / 95.0 * out.time**2
        np.testing.assert_allclose(out.motor_position[:, 0], expected, atol=1e-6)


def test_a_cart_stops_at_the_ends_of_its_rail(tmp_path: Path) -> None:
    """Under its drive's full force it enters a stop by a thousandth of its range."""
    path = made(
        tmp_path, "cart", "--kind", "slider", "--mass", "5", "--range", "0.2", "--force-limit", "50"
    )
    out = pushed(path, 1.0, 2000, DRIVE)
    assert out.motor_position[-1, 0] == pytest.approx(0.1 + 1e-3 * 0.2, rel=1e-4)


def test_a_shaft_holds_its_weight(tmp_path: Path) -> None:
    """k_p (theta_d - theta) = m g l sin theta with the numbers that were given."""
    numbers = ("--mass", "0.969", "--length", "0.15", "--damping", "0.2")
    path = made(tmp_path, "arm", "--kind", "shaft", *numbers)
    drive = {**DRIVE, "kp": 5.0, "kd": 0.3}
    out = pushed(path, 1.0, 4000, drive)
    theta = out.motor_position[-1, 0]
    assert 5.0 * (1.0 - theta) == pytest.approx(0.969 * 9.81 * 0.15 * np.sin(theta), rel=1e-4)


def test_a_recording_may_state_another_arm_of_a_shaft(tmp_path: Path) -> None:
    """The arm that `asset new` was told can be overridden as that of the pendulum."""
    path = made(tmp_path, "arm", "--kind", "shaft", "--length", "0.15")
    shaft = override_mechanism(load_mechanism(path), BenchOverrides(length=(0.3,)))
    assert shaft.joints[0].center_of_mass == pytest.approx([0.0, 0.0, -0.3], abs=FLOAT32)


def test_a_string_pulls_a_cart_from_its_open_end(tmp_path: Path) -> None:
    """From 0, k x / r at the spool; nothing is found against it, and it is no direct drive."""
    numbers = ("--mass", "0.6", "--stiffness", "150", "--range", "0.12", "--spool-radius", "0.015")
    path = made(tmp_path, "cart", "--kind", "cart", *numbers)
    assert not check_asset(path)
    cart = load_mechanism(path)
    assert not cart.tendons[0].direct
    closing = closing_path(cart)
    assert closing.tension[-1] == pytest.approx(150.0 * 0.12, rel=1e-3)
    assert cart.tendons[0].spool_radius == pytest.approx(0.015)
    assert cart.joints[0].limits == pytest.approx((0.0, 0.12))


@pytest.mark.parametrize("kind", ["finger", "slider", "shaft", "cart"])
def test_what_a_new_asset_proposes_can_be_typed(kind, tmp_path, monkeypatch, capsys) -> None:
    """It is checked and shown as it was made, in a folder whose name has a space."""
    monkeypatch.chdir(tmp_path)
    assert main(["asset", "new", "mine", "--kind", kind, "--folder", str(tmp_path / "a b")]) == 0
    commands = proposed(capsys.readouterr().out)
    assert [words[1] for words in commands] == ["check", "show"]
    assert [main(words) for words in commands] == [0, 0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--kind", "slider", "--mass", "0"), "mass of a slider must lie in"),
        (("--kind", "shaft", "--mass", "1", "2"), "mass of a shaft is one number; there are 2"),
        (("--kind", "shaft", "--moment-arm", "0.01"), "moment_arm belongs to a finger"),
        (("--kind", "slider", "--spool-radius", "0.02"), "spool_radius belongs to a finger"),
        (("--kind", "cart", "--length", "0.1"), "length is of a finger's links or a shaft's arm"),
    ],
)
def test_numbers_of_no_such_bench_are_refused(words, said, tmp_path, capsys) -> None:
    """One line says what was expected."""
    assert said in refusal(["asset", "new", "bench", "--folder", str(tmp_path), *words], capsys)


SLIDER = {
    "body_mass": [0.05], "joint_damping": [5.0], "joint_rest_q": [0.0], "joint_friction": [0.0],
    "joint_limit_lower": [0.0], "joint_limit_upper": [0.08], "joint_limit_ke": [1.5e5],
    "joint_limit_kd": [80.0], "joint_axis": [[1.0, 0.0, 0.0]],
}  # fmt: skip
NUMBERS: dict[str, dict[str, list]] = {
    "finger": {"body_mass": [0.012, 0.008], "body_com": [[0.015, 0.0, 0.0], [0.0125, 0.0, 0.0]],
        "joint_stiffness": [0.045, 0.030], "joint_rest_q": [0.0, 0.0],
        "joint_damping": [5e-4, 3e-4], "joint_friction": [0.0, 0.0], "joint_armature": [0.0, 0.0],
        "joint_limit_lower": [0.0, 0.0], "joint_limit_upper": [1.75, 1.40],
        "joint_limit_ke": [30.0, 30.0], "joint_limit_kd": [0.02, 0.004],
        "joint_axis": [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]], "joint_parent": [-1, 0],
        "gravity": [[0.0, 0.0, -9.81]]},
    "spring_weak": {**SLIDER, "joint_stiffness": [200.0]},
    "spring_strong": {**SLIDER, "joint_stiffness": [800.0]},
    "pendulum": {"body_mass": [0.49], "body_com": [[0.0, 0.0, -0.10]], "joint_stiffness": [0.0],
        "joint_damping": [0.0], "joint_friction": [0.0], "joint_axis": [[0.0, 1.0, 0.0]]},
}  # fmt: skip
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
    lengths = [joint.length for joint in mechanism.joints]
    assert lengths == pytest.approx([0.030, 0.025], rel=FLOAT32)
    for joint in mechanism.joints:
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
