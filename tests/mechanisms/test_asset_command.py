"""``tendon-newton asset``: what it prints, writes and returns."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.errors import InvalidAsset, InvalidOutput
from tendon_newton.mechanisms.authoring.asset_plan import STOP_DAMPING_RATIO, STOP_STIFFNESS
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign, write_foreign
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.mechanisms.loading import load_mechanism
from tests.mechanisms.broken.flat_assets import write_changed
from tests.physics.runs import GAIN, RADIUS, ROWS, ideal_model, run_of, simulate, stairs
from tests.proposed import proposed


def test_check_of_a_good_asset_says_so(capsys) -> None:
    """Exit code 0 and one line."""
    assert main(["asset", "check", "finger"]) == 0
    assert "finger: no errors, no warnings" in capsys.readouterr().out


def test_an_asset_is_named_by_its_folder_too(tmp_path: Path, monkeypatch, capsys) -> None:
    """As `asset new` makes it, from inside as well; a name of ours comes first."""
    assert main(["asset", "new", "my_finger", "--folder", str(tmp_path)]) == 0
    monkeypatch.chdir(tmp_path / "my_finger")
    for word in (str(tmp_path / "my_finger"), "."):
        assert main(["asset", "check", word]) == 0
    assert "no errors" in capsys.readouterr().out
    monkeypatch.chdir(tmp_path)
    (tmp_path / "finger").mkdir()
    assert main(["asset", "check", "finger"]) == 0
    assert main(["asset", "check", "no_finger"]) == 2


def test_check_of_a_broken_asset_lists_rule_and_remedy(tmp_path: Path, capsys) -> None:
    """Exit code 1; the finding names its prim, its rule and what to do."""
    path = write_changed(tmp_path, "finger", ("coef = [0.008, 0.0055]", "coef = [0.008]"))
    assert main(["asset", "check", str(path)]) == 1
    printed = capsys.readouterr().out
    assert "tendon_coef" in printed
    assert "/finger/tendons/flexor" in printed
    assert "Write one moment arm per joint" in printed


def test_an_edited_asset_is_read_anew(tmp_path: Path, capsys) -> None:
    """USD keeps layers in memory; a check after an edit must see the edit."""
    path = write_changed(tmp_path, "finger", ("coef = [0.008, 0.0055]", "coef = [0.008]"))
    assert main(["asset", "check", str(path)]) == 1
    write_changed(tmp_path, "finger")
    assert main(["asset", "check", str(path)]) == 0
    assert "no errors" in capsys.readouterr().out


def test_show_writes_a_picture_of_the_assets_name(tmp_path: Path, monkeypatch, capsys) -> None:
    """Without --out the picture lands in the current folder."""
    monkeypatch.chdir(tmp_path)
    assert main(["asset", "show", "spring_weak"]) == 0
    assert (tmp_path / "spring_weak.png").read_bytes().startswith(b"\x89PNG")
    assert "spring_weak.png" in capsys.readouterr().out


@pytest.mark.parametrize("out", ["picture.svg", "no_such_folder/picture.png"])
def test_picture_that_cannot_be_written_is_misuse(out: str, tmp_path: Path, capsys) -> None:
    """Another suffix or a missing folder gives exit code 2 and names the path."""
    assert main(["asset", "show", "finger", "--out", str(tmp_path / out)]) == 2
    assert Path(out).name in capsys.readouterr().err


FLOAT32 = 1e-6  # relative: Newton's arrays are float32
MJCF = """
<mujoco model="finger">
  <compiler angle="radian"/>
  <worldbody>
    <body name="middle">
      <joint name="pip" axis="0 1 0" range="0 1.75" stiffness="0.045" damping="5e-4"/>
      <inertial pos="0.015 0 0" mass="0.012" diaginertia="9.6e-8 9e-7 9e-7"/>
      <geom type="capsule" fromto="0 0 0 0.03 0 0" size="0.004"/>
      <body name="distal" pos="0.03 0 0">
        <joint name="dip" axis="0 1 0" range="0 1.40" stiffness="0.030" damping="3e-4"/>
        <inertial pos="0.0125 0 0" mass="0.008" diaginertia="4.9e-8 4.1666667e-7 4.1666667e-7"/>
        <site name="tip" pos="0.025 0 0" size="0.001"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
URDF = """
<robot name="finger">
  <link name="base"/>
  <link name="middle">
    <inertial><origin xyz="0.015 0 0"/><mass value="0.012"/>
      <inertia ixx="9.6e-8" iyy="9e-7" izz="9e-7" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="distal">
    <inertial><origin xyz="0.0125 0 0"/><mass value="0.008"/>
      <inertia ixx="4.9e-8" iyy="4.1666667e-7" izz="4.1666667e-7" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="pip" type="revolute"><parent link="base"/><child link="middle"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="1.75" effort="1" velocity="10"/>
    <dynamics damping="5e-4"/></joint>
  <joint name="dip" type="revolute"><parent link="middle"/><child link="distal"/>
    <origin xyz="0.03 0 0"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="1.40" effort="1" velocity="10"/><dynamics damping="3e-4"/></joint>
</robot>
"""
ARMS = (0.008, 0.0055)
SPRINGS = (0.045, 0.030)
TIP = (0.025, 0.0, 0.0)


def imported(folder: Path, ending: str, text: str, **more: object) -> Path:
    """Import a text as an asset named ``mine``."""
    source = folder / f"finger.{ending}"
    source.write_text(text, encoding="utf-8")
    values: dict = {"moment_arm": ARMS, "spool_radius": 0.0125, "force_limit": 21.0, **more}
    return write_foreign(folder, plan_foreign("mine", read_foreign(source), **values))


def import_either(folder: Path, ending: str) -> Path:
    """Import the nominal finger from MJCF, or from URDF, which has neither springs nor sites."""
    if ending == "xml":
        return imported(folder, "xml", MJCF)
    return imported(folder, "urdf", URDF, stiffness=SPRINGS, tip=TIP)


@pytest.mark.parametrize("ending", ["xml", "urdf"])
def test_the_nominal_finger_comes_in_with_its_numbers(ending: str, tmp_path: Path) -> None:
    """Every number of the bench, from the file or from the layer on top; the check is content."""
    path = import_either(tmp_path, ending)
    found, nominal = load_mechanism(path), load_mechanism("finger")
    for own, other in zip(found.joints, nominal.joints, strict=True):
        assert own.name == other.name
        for key in ("limits", "stiffness", "damping", "friction", "rest", "mass", "length"):
            assert getattr(own, key) == pytest.approx(getattr(other, key), rel=FLOAT32), key
        for key in ("center_of_mass", "inertia", "parent_position", "child_position"):
            value, expected = getattr(own, key), getattr(other, key)
            assert value == pytest.approx(expected, rel=FLOAT32, abs=1e-12), key
        turned = own.parent_rotation @ own.axis
        assert turned == pytest.approx(other.parent_rotation @ other.axis, abs=FLOAT32)
    assert found.tip.point == pytest.approx(TIP, rel=FLOAT32)
    assert found.tendons[0].moment_arm == pytest.approx(ARMS)
    assert [f for f in check_asset(path) if f.severity != "note"] == []


def test_an_imported_finger_moves_as_the_nominal_one(tmp_path: Path) -> None:
    """Off the stops, whose damping is chosen anew, to 1e-4 of the motion: the files' digits."""
    path = imported(tmp_path, "xml", MJCF)
    run = run_of(stairs(np.random.default_rng(0), 80, 0.6, 2.0, 20))
    (ours,), (theirs,) = (
        simulate([run], ideal_model(), time_step=1e-3, mechanism=load_mechanism(name))
        for name in ("finger", path)
    )
    moved = np.ptp(ours.joint_position, axis=0)
    assert np.max(np.abs(ours.joint_position - theirs.joint_position) / moved) < 1e-4


def test_oblique_frames_and_strange_names_come_in(tmp_path: Path) -> None:
    """An axis along no coordinate, a turned body and a name that no prim can have."""
    text = MJCF.replace('name="dip" axis="0 1 0"', 'name="d.i.p" axis="0.6 0.8 0"')
    text = text.replace('name="distal" pos', 'name="joints" euler="0.3 0.2 0.1" pos')
    mechanism = load_mechanism(imported(tmp_path, "xml", text))
    assert mechanism.joint_names == ("pip", "d_i_p")
    source = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(source)
    mujoco.mj_forward(source, data)
    joint = mechanism.joints[1]
    # the middle link is not turned at rest, so that its frame is MuJoCo's world
    assert joint.parent_rotation @ joint.axis == pytest.approx(data.xaxis[1], abs=1e-6)
    # the same equilibrium under 3 N in plain MuJoCo, by its own arithmetic
    rest = equilibrium(mechanism, np.array([3.0]))
    data.qpos[:] = rest
    mujoco.mj_forward(source, data)
    pull = 3.0 * np.array(ARMS)
    assert data.qfrc_passive - data.qfrc_bias + pull == pytest.approx([0.0, 0.0], abs=1e-6)


def test_stops_of_an_imported_finger_damp_all_that_swings_beyond_them(tmp_path: Path) -> None:
    """By the diagonal of MuJoCo's mass matrix; a joint beside its link's origin is drawn there."""
    text = MJCF.replace('name="dip" axis', 'name="dip" pos="0.004 0 0.002" axis')
    path = imported(tmp_path, "xml", text)
    source = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(source)
    mujoco.mj_forward(source, data)
    mobility = np.zeros((2, 2))
    mujoco.mj_solveM(source, data, mobility, np.eye(2))
    swinging = np.diag(np.linalg.inv(mobility))
    damping = [joint.stop_damping for joint in load_mechanism(path).joints]
    expected = 2.0 * STOP_DAMPING_RATIO * np.sqrt(STOP_STIFFNESS * swinging)
    assert damping == pytest.approx(expected, rel=FLOAT32)
    assert not [finding for finding in check_asset(path) if finding.rule == "joint_frame"]


EQUAL = '<equality><joint joint1="pip" joint2="dip" polycoef="0 0.8 0 0 0"/></equality>'


@pytest.mark.parametrize(
    ("text", "more", "message"),
    [
        ("<mujoco", {}, "Newton cannot read .*finger.xml"),
        ("<mujoco><worldbody/></mujoco>", {}, "finger.xml: a finger has joints"),
        (MJCF, {"moment_arm": (8.0, 5.5)}, r"moment_arm must lie in \[-0.1, 0.1\] m; it is 8"),
        (MJCF, {"stiffness": (1.0, 1.0, 1.0)}, "stiffness needs one value, or one per joint: 2"),
        (MJCF.replace('name="tip"', 'name="top"'), {}, "name a site of the file 'tip'"),
        (MJCF.replace('axis="0 1 0" range="0 1.75"', 'type="ball"'), {}, "ball joint"),
        (MJCF.replace("</mujoco>", f"{EQUAL}</mujoco>"), {}, r"couples them by <joint joint1="),
        (MJCF.replace("</mujoco>", f"{EQUAL.replace('joint', 'weld')}</mujoco>"), {}, "by <weld"),
    ],
)
def test_a_file_that_is_no_finger_is_refused(text, more, message, tmp_path) -> None:
    """Each with what is missing."""
    with pytest.raises(InvalidAsset, match=message):
        imported(tmp_path, "xml", text, **more)


def test_a_joint_that_mimics_another_is_refused(tmp_path: Path) -> None:
    """Else two joints would move freely that are one; a coupling that is off or told of is none."""
    with pytest.raises(InvalidAsset, match=r"couples '\w+' by <mimic joint=.pip."):
        imported(tmp_path, "urdf", URDF.replace("</joint>", '<mimic joint="pip"/></joint>'))
    for text in (EQUAL.replace("/>", ' active="false"/>'), f"<!-- {EQUAL} -->"):
        folder = tmp_path / str(len(text))
        folder.mkdir()
        imported(folder, "xml", MJCF.replace("</mujoco>", f"{text}</mujoco>"))


def test_places_that_are_taken_or_missing_are_refused(tmp_path: Path) -> None:
    """The folder of an asset is new; the file is there and of a kind that is read."""
    imported(tmp_path, "xml", MJCF)
    with pytest.raises(InvalidOutput, match="it is there already"):
        imported(tmp_path, "xml", MJCF)
    with pytest.raises(InvalidAsset, match="there is none"):
        read_foreign(tmp_path / "nothing.urdf")
    with pytest.raises(InvalidAsset, match=r"ends with \.xml, \.mjcf, \.urdf"):
        read_foreign(tmp_path / "finger.usda")
    with pytest.raises(InvalidAsset, match="'2nd finger' is none"):
        plan_foreign(
            "2nd finger",
            read_foreign(tmp_path / "finger.xml"),
            moment_arm=ARMS,
            spool_radius=0.0125,
            force_limit=21.0,
        )


def pulled(mechanism: Mechanism, path: Path, tension: np.ndarray) -> np.ndarray:
    """Return the joint angles [rad] that plain MuJoCo gives under tensions [N] held for 10 ms."""
    write_mujoco(path, mechanism)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    rows = []
    for pull in tension:
        data.ctrl[:] = pull
        for _ in range(round(0.01 / model.opt.timestep)):
            mujoco.mj_step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


@pytest.mark.parametrize("name", ["finger", "spring_weak"])
def test_plain_mujoco_comes_to_rest_where_statics_says(name: str, tmp_path: Path) -> None:
    """The export with half a newton on its tendon's motor, then three."""
    mechanism = load_mechanism(name)
    for tension in (0.5, 3.0):
        reached = pulled(mechanism, tmp_path / "out.xml", np.full(300, tension))[-1]
        # 1e-5 rad: what is left of the motion after 3 s, and float32 in the export
        assert reached == pytest.approx(equilibrium(mechanism, np.array([tension])), abs=1e-5)


def test_plain_mujoco_moves_as_we_do(tmp_path: Path) -> None:
    """The ideal source on its motor follows stairs off the stops, to 0.5 % of the motion (RMS).

    Its steps of 0.5 ms are of first order, and the source is explicit: at a jump they leave 1.2 %,
    over the run 0.2 %.
    """
    mechanism = load_mechanism("finger")
    run = run_of(stairs(np.random.default_rng(1), 120, 0.5, 2.5, 40))
    (ours,) = simulate([run], ideal_model(), time_step=5e-4, mechanism=mechanism)
    write_mujoco(tmp_path / "out.xml", mechanism)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    data = mujoco.MjData(model)
    data.qpos[:] = ours.joint_position[0]
    mujoco.mj_forward(model, data)
    rows = []
    for command in run.command[:, 0]:
        rows.append(data.qpos.copy())
        for _ in range(round(1.0 / ROWS / model.opt.timestep)):
            data.ctrl[0] = GAIN * (command - data.ten_length[0] / RADIUS)
            mujoco.mj_step(model, data)
    moved = np.ptp(ours.joint_position, axis=0)
    apart = ours.joint_position - np.array(rows)
    assert np.max(np.sqrt(np.mean(apart**2, axis=0)) / moved) < 0.005


def test_the_export_has_short_names_shapes_and_the_servos_limit(tmp_path: Path) -> None:
    """What a person looks for in the file."""
    write_mujoco(tmp_path / "out.xml", load_mechanism("finger"))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    assert [model.joint(j).name for j in range(model.njnt)] == ["pip", "dip"]
    assert model.actuator("flexor").ctrlrange.tolist() == [0.0, 21.0]
    assert model.site("tip").bodyid[0] == model.body("distal_phalanx").id
    assert model.ngeom == 3
    assert model.body_mass[1:].tolist() == pytest.approx([0.012, 0.008])
    with pytest.raises(InvalidOutput, match="nowhere"):
        write_mujoco(tmp_path / "nowhere" / "out.xml", load_mechanism("finger"))


def test_the_command_imports_and_exports(tmp_path, capsys, monkeypatch) -> None:
    """What it prints names the files; a name that is taken is refused."""
    source = tmp_path / "finger.xml"
    source.write_text(MJCF, encoding="utf-8")
    words = ["asset", "import", str(source), "mine", "--folder", str(tmp_path)]
    assert main([*words, "--moment-arm", "0.008", "0.0055"]) == 0
    asset = tmp_path / "mine" / "mine.usda"
    monkeypatch.chdir(tmp_path)
    assert [main(words) for words in proposed(capsys.readouterr().out)] == [0, 0]
    out = tmp_path / "out.xml"
    assert main(["asset", "export", str(asset), "--out", str(out)]) == 0
    assert str(out) in capsys.readouterr().out
    assert mujoco.MjModel.from_xml_path(str(out)).nu == 1
    assert main(["asset", "import", str(source), "finger", "--moment-arm", "0.008"]) == 2
    assert "an asset's name is its own" in capsys.readouterr().err
