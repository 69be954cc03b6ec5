"""MJCF out: the same finger in plain MuJoCo."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.errors import InvalidOutput
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.mechanisms.loading import load_mechanism
from tests.physics.runs import GAIN, RADIUS, ROWS, ideal_model, run_of, simulate, stairs


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
    assert run.command is not None
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


def test_the_command_exports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What it prints names the file, which MuJoCo takes."""
    out = tmp_path / "out.xml"
    assert main(["asset", "export", "finger", "--out", str(out)]) == 0
    assert str(out) in capsys.readouterr().out
    assert mujoco.MjModel.from_xml_path(str(out)).nu == 1
