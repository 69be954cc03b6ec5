"""An arm of many servos: where it hangs tells how it stands, and its servos move together."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from tendon_newton.arms.arm import Arm, ArmMotion, motions_of
from tendon_newton.arms.arm_simulation import simulate_arm
from tendon_newton.arms.known_arm import KnownArm, know_arm
from tendon_newton.arms.placement import find_placement
from tendon_newton.data.model_file import NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidModelFile, InvalidRecording, UnknownName
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tests.arms import planted_arm
from tests.made import stated_model

TOLD = stated_model("ideal_position")
FLOOR = -0.02  # m
FREE = -10.0  # m: too far below to be met


def test_a_servo_of_which_nothing_is_named_keeps_its_plain_model() -> None:
    """Another has the model of its diagnosis."""
    plain, written = TOLD, replace(TOLD, effects=(NamedValues(name="deadband", values={}),))
    nothing: Any = SimpleNamespace(effects=(), model=written)
    none: Any = None
    known = KnownArm(placement=none, arm=none, starts=(plain,), plain=(plain,))
    assert known.servo(0, nothing) is plain
    named: Any = SimpleNamespace(effects=("deadband",), model=written)
    assert known.servo(0, named) is written


@pytest.fixture(scope="module")
def mechanism(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """The planted arm, imported."""
    return planted_arm.planted_mechanism(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def motions() -> list[ArmMotion]:
    """Motions further and further down; in the last two the tip would go through the floor."""
    rng = np.random.default_rng(3)
    lows = {"high": -0.9, "middle": -0.7, "low": -0.5, "other": -0.35}
    return [planted_arm.planted_motion(name, rng, low, FLOOR) for name, low in lows.items()]


@pytest.fixture(scope="module")
def known(mechanism: Mechanism, motions: list[ArmMotion]) -> KnownArm:
    """What three of them tell."""
    return know_arm(mechanism, motions[:3], [TOLD, TOLD])


def test_an_arm_comes_in_with_a_servo_on_each_joint(mechanism: Mechanism, tmp_path: Path) -> None:
    """Each joint has a drive of its own, and the asset breaks no rule."""
    assert [tendon.name for tendon in mechanism.tendons] == ["shoulder", "elbow"]
    assert all(tendon.direct for tendon in mechanism.tendons)
    np.testing.assert_array_equal([t.moment_arm for t in mechanism.tendons], np.eye(2))
    path = planted_arm.planted_mechanism(tmp_path).asset
    assert not check_asset(path)
    with pytest.raises(UnknownName, match=r"No link of arm\.urdf named 'hand'"):
        plan_foreign(
            "arm", read_foreign(tmp_path / "arm.urdf"), tip=(0.0, 0.0, 0.0), tip_link="hand",
            spool_radius=0.01, force_limit=3.0,
        )  # fmt: skip


def test_weight_and_tip_are_those_of_two_rods(mechanism: Mechanism) -> None:
    """Against the equations of the plant, at many postures at once (float32 assets: 1e-5)."""
    arm = Arm(mechanism=mechanism, sign=planted_arm.SIGNS, zero=np.array([0.1, -0.2]),
              gravity=mechanism.gravity)  # fmt: skip
    angles = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 2))
    q = planted_arm.SIGNS * angles + arm.zero
    expected = planted_arm.SIGNS * [planted_arm.weight(row) for row in q]
    np.testing.assert_allclose(arm.weight(angles), expected, rtol=1e-5, atol=1e-6)
    height, slopes = arm.tip_height(angles)
    np.testing.assert_allclose(height, [planted_arm.tip(row) for row in q], atol=1e-6)
    way = np.array([0.0, 1e-5])
    moved = arm.tip_height(angles + way)[0] - arm.tip_height(angles - way)[0]
    np.testing.assert_allclose(slopes[:, 1], moved / 2e-5, atol=1e-6)


def test_plain_mujoco_feels_the_same_weight(mechanism: Mechanism, tmp_path: Path) -> None:
    """The exported arm has an actuator on each joint, and the same torque of gravity (float32)."""
    write_mujoco(tmp_path / "arm.xml", mechanism)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    data = mujoco.MjData(model)
    data.qpos[:] = q = np.array([0.3, -0.5])
    mujoco.mj_forward(model, data)
    assert model.nu == 2
    np.testing.assert_allclose(-data.qfrc_bias, planted_arm.weight(q), rtol=1e-5)


def test_a_servo_that_counts_the_other_way_is_found(known: KnownArm) -> None:
    """By where the arm hangs; zeros of 0 lie in the interval (two standard deviations)."""
    np.testing.assert_array_equal(known.arm.sign, planted_arm.SIGNS)
    assert known.placement.sign_told.all()
    assert (np.abs(known.arm.zero) < 2.0 * known.placement.zero_sd).all()


def test_a_base_that_is_tipped_is_found_to_be(mechanism: Mechanism) -> None:
    """By 0.05 rad about +y, of which it keeps what a zero of its shoulder might be instead."""
    rng = np.random.default_rng(3)
    motions = [planted_arm.planted_motion("", rng, low, FREE, tilt=0.05) for low in (-0.9, -0.4)]
    found = find_placement(mechanism, motions)
    assert 0.005 < found.tilt[1] < 0.05
    assert abs(found.tilt[0]) < 0.005


def test_an_arm_whose_servos_stand_still_tells_nothing(mechanism, motions) -> None:
    """Each servo keeps its model and the file's count; no library's error."""
    commands, angles = motions[0].commands[[0]], motions[0].angles[[0]]
    rows = np.zeros(len(motions[0].time), dtype=int)
    still = [otherwise(motions[0], commands[rows], angles[rows])] * 2
    known = know_arm(mechanism, still, [TOLD, TOLD])
    assert known.plain == (TOLD, TOLD)
    assert not known.placement.sign_told.any()
    np.testing.assert_array_equal(known.arm.sign, 1.0)


def test_what_a_model_file_states_of_a_servo_is_added_once(mechanism, motions) -> None:
    """A compliance to be fitted and a lag stay one each; another actuator is refused."""
    lag = NamedValues(name="actuator_lag", values={"time_constant": 0.02})
    stated = replace(TOLD, effects=(lag,), fit=("compliance",))
    known = know_arm(mechanism, motions[:1], [stated, stated])
    for model in known.starts:
        assert model.fit == ("compliance",)
        assert [e for e in model.effects if e.name == "actuator_lag"] == [lag]
    pulling = stated_model("ideal", {"gain": 4.2})
    with pytest.raises(InvalidModelFile, match=r"elbow.*'ideal_position'.* it is 'ideal'"):
        know_arm(mechanism, motions[:1], [TOLD, pulling])


def test_the_floor_and_the_servos_numbers_are_found(known: KnownArm) -> None:
    """Compliance within a fifth, bands within 5 mrad; the floor within what zeros leave of it."""
    assert known.arm.floor == pytest.approx(FLOOR, abs=0.4 * 0.05)  # m: reach times a zero's sd
    for model, band in zip(known.plain, planted_arm.BANDS, strict=True):
        assert model.actuator.values["compliance"] == pytest.approx(planted_arm.COMPLIANCE, rel=0.2)
        (width,) = (e.values["width"] for e in model.effects if e.name == "deadband")
        assert width == pytest.approx(band, abs=0.005)


def test_servos_move_together_under_commands_alone(known, motions) -> None:
    """In a motion that was not seen the floor takes away more than two thirds of the error."""
    models, unseen = dict(enumerate(known.plain)), motions[3:]
    (with_floor,) = simulate_arm(known.arm, models, unseen)
    (without,) = simulate_arm(replace(known.arm, floor=None), models, unseen)
    missed, free = (
        np.sqrt(np.mean((state.angles - unseen[0].angles) ** 2)) for state in (with_floor, without)
    )
    assert missed < 0.01  # rad: half of the smaller band
    assert missed < free / 3.0
    assert known.arm.tip_height(with_floor.angles)[0].min() > known.arm.floor - 0.005  # m
    assert with_floor.force.max() > 0.5  # N
    assert with_floor.depth < 0.001  # m


def test_a_floor_does_not_push_what_no_servo_gives_way_by(known, motions) -> None:
    """Servos a thousand times stiffer than planted feel no force, where they would feel 700 N."""
    values = {"compliance": 1e-3 * planted_arm.COMPLIANCE}
    stiff = stated_model("ideal_position", values)
    (state,) = simulate_arm(known.arm, {0: stiff, 1: stiff}, motions[3:])
    np.testing.assert_array_equal(state.force, 0.0)
    assert state.depth == 0.0


def test_recordings_that_are_no_arms_are_refused(mechanism, motions) -> None:
    """Other servos than joints, other motions, other stamps, and an arm that hangs up."""
    first, second = motions[0].recordings
    with pytest.raises(InvalidRecording, match=r"2 joints \(shoulder, elbow\).* of 1 servos"):
        find_placement(mechanism, [ArmMotion(recordings=(first,))])
    hanging = replace(mechanism, gravity=np.array([planted_arm.GRAVITY, 0.0, 0.0]))
    down = planted_arm.planted_motion("down", np.random.default_rng(3), 0.0, FREE, tilt=np.pi / 2)
    upwards = otherwise(down, down.commands, 2.0 * down.commands - down.angles)
    with pytest.raises(InvalidRecording, match="hang the other way whatever their signs"):
        find_placement(hanging, [upwards])
    columns = ("command", "motor_position", "motor_velocity")
    pair = {name: np.repeat(getattr(first, name), 2, axis=1) for name in columns}
    with pytest.raises(InvalidRecording, match="each servo's own log; it has 2 servos"):
        ArmMotion(recordings=(replace(first, **pair), second))
    with pytest.raises(InvalidRecording, match="have the same recordings; there are a 2, b 1"):
        motions_of({"a": [first, first], "b": [second]}, ("a", "b"))
    with pytest.raises(InvalidRecording, match="its time stamps are not those of shoulder_high"):
        motions_of({"a": [first], "b": [replace(second, time=second.time + 0.001)]}, ("a", "b"))


def otherwise(motion: ArmMotion, commands: Array, angles: Array) -> ArmMotion:
    """A motion with other commands and angles [rad], both of shape (T, J)."""
    return ArmMotion(
        recordings=tuple(
            replace(recording, command=commands[:, [j]], motor_position=angles[:, [j]])
            for j, recording in enumerate(motion.recordings)
        )
    )
