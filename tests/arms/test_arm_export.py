"""An identified arm in plain MuJoCo: its servos, its weight and its floor go along."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from newton.solvers import SolverMuJoCo

from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.arms.arm_file import IdentifiedArm
from tendon_newton.arms.arm_simulation import simulate_arm
from tendon_newton.cli import main
from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms
from tendon_newton.exports.arms import ARM_EXPORTS
from tendon_newton.exports.arms.arm_export import export_arm, seconds_of, swings
from tendon_newton.exports.arms.mujoco_arm import (
    PROGRAM,
    replay_arm_file,
    replay_arm_program,
    write_arm,
)
from tendon_newton.exports.arms.servo_springs import driven_builder
from tendon_newton.mechanisms.authoring.mujoco_file import TIME_STEP
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tests.arms import planted_arm
from tests.bad_input.damage import refusal
from tests.made import recorded

COUNT = 1.5e-3  # rad: one of an encoder of 4096 counts
EFFECTS = (
    ("command_delay", {"delay": 0.013}),
    ("acceleration_limit", {"limit": 39.0, "speed": 5.0}),
    ("deadband", {"width": 0.01}),
    ("actuator_lag", {"time_constant": 0.04}),
    ("speed_limit", {"limit": 3.0}),
    ("backlash", {"width": 0.02}),
    ("position_offset", {"angle": 0.03}),
)


@pytest.fixture(scope="module")
def mechanism(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """The planted arm, imported."""
    return planted_arm.planted_mechanism(tmp_path_factory.mktemp("arm"))


def servo(*effects: str, compliance: float = 0.08) -> Model:
    """Return a servo that gives way to its load, with some of the effects."""
    chosen = [NamedValues(name=n, values=v) for n, v in EFFECTS if n in effects]
    actuator = NamedValues(name="ideal_position", values={"compliance": compliance})
    return Model(actuator=actuator, effects=tuple(chosen))


def stands(mechanism: Mechanism, *models: Model, floor: float | None = None) -> IdentifiedArm:
    """Return the arm with its elbow turned round, zeros and a tilt."""
    return IdentifiedArm(
        arm=Arm(
            mechanism=mechanism, sign=planted_arm.SIGNS, zero=np.array([0.05, -0.04]),
            gravity=np.array([0.4, -0.3, -9.8]), floor=floor,
        ),
        models=models,
    )  # fmt: skip


def steps(arm: IdentifiedArm) -> ArmMotion:
    """Return swings upon which the command jumps, of an arm that starts where it was measured."""
    motion = swings(arm.arm)
    jumps = 0.2 * (np.floor(2.0 * motion.time) % 2.0)
    return ArmMotion(
        recordings=tuple(
            replace(r, command=r.command + jumps[:, None], motor_position=r.motor_position + 0.02,
                    start="first_row")
            for r in motion.recordings if r.command is not None
        )
    )  # fmt: skip


every_file = pytest.mark.parametrize(
    ("to", "way"),
    [(to, way) for to, target in ARM_EXPORTS.items() for way in target.ways if way != PROGRAM],
)


def replayed(to: str, way: str, folder: Path, arm: IdentifiedArm, motion: ArmMotion) -> Array:
    """Write an arm, and replay a motion of it in one way."""
    ARM_EXPORTS[to].write(folder, arm)
    return ARM_EXPORTS[to].ways[way].replay(folder, arm, motion)


def ours(arm: IdentifiedArm, motion: ArmMotion) -> Array:
    """Simulate a motion here."""
    return simulate_arm(arm.arm, dict(enumerate(arm.models)), [motion])[0].angles


@pytest.mark.parametrize("effects", [(), ("actuator_lag",), tuple(name for name, _ in EFFECTS)])
def test_the_program_moves_an_arm_as_we_do(mechanism, effects, tmp_path) -> None:
    """Every effect of a servo under gravity; the other servo has none of them."""
    arm = stands(mechanism, servo(*effects), servo(compliance=0.05))
    write_arm(tmp_path, arm)
    motion = steps(arm)
    missed = replay_arm_program(tmp_path, arm, motion) - ours(arm, motion)
    assert np.sqrt(np.mean(missed**2)) < COUNT


def test_the_program_rests_its_tip_on_the_floor(mechanism: Mechanism, tmp_path: Path) -> None:
    """A tip that is told to go through the floor lies on it, and both servos give way."""
    arm = stands(mechanism, servo("actuator_lag"), servo("actuator_lag"), floor=-0.1)
    write_arm(tmp_path, arm)
    motion = swings(arm.arm)
    there, here = replay_arm_program(tmp_path, arm, motion), ours(arm, motion)
    free = ours(stands(mechanism, *arm.models), motion)
    lowest = [arm.arm.tip_height(angles)[0].min() for angles in (free, here, there)]
    assert lowest[0] < -0.15
    assert min(lowest[1:]) > -0.105  # m: MuJoCo's contact gives way, and our rounds end
    assert np.sqrt(np.mean((there - here) ** 2)) < 0.3 * np.sqrt(np.mean((free - here) ** 2))


@every_file
def test_a_file_alone_hangs_where_the_servos_do(to, way, mechanism, tmp_path) -> None:
    """At rest signs, zeros, tilt, offset and compliance are all that counts."""
    arm = stands(mechanism, servo("position_offset", "actuator_lag"), servo())
    held = swings(arm.arm)
    held = ArmMotion(
        recordings=tuple(
            replace(r, command=np.full_like(r.motor_position, 0.2)) for r in held.recordings
        )
    )
    missed = replayed(to, way, tmp_path, arm, held) - ours(arm, held)
    assert np.abs(missed[-1]).max() < 0.1 * COUNT


@every_file
def test_a_file_alone_moves_as_the_servos_do(to, way, mechanism, tmp_path) -> None:
    """Springs and dampers stand for compliance and lag: a tenth is left of what they do."""
    arm = stands(mechanism, servo("actuator_lag"), servo("actuator_lag", "position_offset"))
    motion = swings(arm.arm)
    here, there = ours(arm, motion), replayed(to, way, tmp_path, arm, motion)
    exact = rms(motion.commands - here)
    assert rms(there - here) < 0.1 * exact


def test_newton_steps_the_file_as_the_replay_does(mechanism: Mechanism, tmp_path: Path) -> None:
    """The replay takes MuJoCo's model from Newton's solver: the solver's own steps agree."""
    arm = stands(mechanism, servo("actuator_lag", "deadband"), servo("actuator_lag"))
    (path,) = ARM_EXPORTS["usd"].write(tmp_path, arm)
    motion = swings(arm.arm)
    told = replayed("usd", "arm.usda in Newton", tmp_path, arm, motion)
    builder = driven_builder()
    builder.add_usd(str(path), collapse_fixed_joints=True)
    model = builder.finalize(device="cpu")
    solver = SolverMuJoCo(model, disable_contacts=True, use_mujoco_cpu=True)
    here, there, control = model.state(), model.state(), model.control()
    here.joint_q.assign(motion.commands[0].astype(np.float32))
    at, rows = 0.0, 20
    for row in range(rows):
        control.joint_target_q.assign(motion.commands[row].astype(np.float32))
        while at < motion.time[row + 1] - motion.time[0] - 0.5 * TIME_STEP:
            solver.step(here, there, control, None, TIME_STEP)
            here, there, at = there, here, at + TIME_STEP
    assert np.abs(here.joint_q.numpy() - told[rows]).max() < 1e-4  # rad: float32


def test_dry_friction_holds_a_servo_in_its_band_in_the_file_alone(mechanism, tmp_path) -> None:
    """Deadband and play: less than half of the band is left, and without them most of it."""
    bands = (servo("deadband", "actuator_lag"), servo("backlash", "actuator_lag"))
    arm = stands(mechanism, *bands)
    write_arm(tmp_path, arm)
    motion = swings(arm.arm)
    here, there = ours(arm, motion), replay_arm_file(tmp_path, arm, motion)
    assert np.sqrt(np.mean((there - here) ** 2)) < 0.5 * 0.01
    bare = ours(stands(mechanism, servo("actuator_lag"), servo("actuator_lag")), motion)
    assert np.sqrt(np.mean((bare - here) ** 2)) > 0.8 * 0.01


def test_an_arm_of_a_diagnosis_goes_to_mujoco(mechanism, tmp_path, capsys) -> None:
    """Files, page and numbers come from arm.json and the models beside it; others are refused."""
    arm = stands(mechanism, servo("deadband", "actuator_lag"), servo("actuator_lag"))
    folder, out = tmp_path / "found", tmp_path / "out"
    place = {
        name: {"sign": int(sign), "zero": zero, "diagnosed": True}
        for name, sign, zero in zip(
            mechanism.joint_names, arm.arm.sign, arm.arm.zero.tolist(), strict=True
        )
    }
    table = {"asset": str(mechanism.asset), "joints": place, "tilt": [0.03, 0.04], "floor": None}
    for joint, model, recording in zip(
        mechanism.joint_names, arm.models, steps(arm).recordings, strict=True
    ):
        write_dataset(tmp_path / "logs" / joint, [], [replace(recording, name="motion.csv")])
        (folder / joint).mkdir(parents=True)
        write_model(folder / joint / "model.toml", model)
    (folder / "arm.json").write_text(json.dumps(table))
    words = ["export", str(folder), "--out", str(out), "--dataset", str(tmp_path / "logs")]
    assert main([*words, "--to", "mujoco", "--seconds", "2"]) == 0
    said = capsys.readouterr().out
    assert "arm.xml alone has in another form: actuator_lag, deadband" in said
    assert "It was not run" not in said  # how far both ways stray stands there
    page = (out / "README.md").read_text()
    assert "| elbow | -1 | -40 mrad | compliance 0.08 rad/(N m); actuator_lag 0.04 s |" in page
    assert json.loads((out / "replay.json").read_text())["replay"]["arm_step.py"]["angle"] < COUNT
    run = [sys.executable, "arm_step.py", "--step", "0.01"]
    subprocess.run(run, cwd=out, check=True, capture_output=True)
    assert main([*words, "--to", "usd", "--seconds", "2"]) == 0
    assert "wrote arm.usda, README.md" in capsys.readouterr().out
    assert main([*words, "--to", "newton"]) == 2
    assert "--to of a whole arm must be mujoco, usd, urdf" in capsys.readouterr().err
    (folder / "arm.json").write_text(json.dumps({**table, "joints": {"elbow": place["elbow"]}}))
    assert "joints must be those of" in refusal([*words, "--to", "mujoco"], capsys)


@pytest.mark.parametrize("to", ARM_EXPORTS)
def test_a_servo_alone_goes_where_arms_go(to, tmp_path, capsys) -> None:
    """What a diagnosis of positions gives: a joint of its own, with its offset."""
    model = servo("actuator_lag", "position_offset", compliance=0.0)
    write_model(tmp_path / "model.toml", model)
    time = 0.02 * np.arange(200)
    command = 0.3 * np.sin(2.0 * time)[:, None]
    run = recorded(time, command, name="sine.csv", command=command, start="first_row")
    write_dataset(tmp_path / "logs", [run], [])
    words = ["export", str(tmp_path / "model.toml"), "--dataset", str(tmp_path / "logs")]
    assert main([*words, "--to", to, "--out", str(tmp_path / "out")]) == 0
    assert "replaying 4 s" in capsys.readouterr().out
    told = json.loads((tmp_path / "out" / "replay.json").read_text())
    assert told["runs"] == ["sine.csv"]
    for way, far in told["replay"].items():
        assert far["angle"] < (COUNT if way == PROGRAM else 10.0 * COUNT)  # offset is 20 counts
    assert main([*words, "--to", "newton", "--out", str(tmp_path / "out")]) == 2
    assert "go to mujoco, usd, urdf" in capsys.readouterr().err


@pytest.mark.parametrize("to", ["usd", pytest.param("urdf", marks=pytest.mark.slow)])
def test_what_a_format_cannot_hold_is_told_with_its_worth(to, mechanism, tmp_path) -> None:
    """Delay and floor have no place in USD and URDF; what each way strays by is a replay of it."""
    delayed = (servo("actuator_lag", "command_delay"), servo("actuator_lag"))
    arm = stands(mechanism, *delayed, floor=-0.1)
    motions, parts = [swings(arm.arm)], []
    exported, lines = export_arm(tmp_path, arm, to, motions, parts.append)
    told = json.loads((tmp_path / "replay.json").read_text())
    assert [path.name for path in exported.files] == [f"arm.{to.replace('usd', 'usda')}"]
    for way in ARM_EXPORTS[to].ways:
        assert f"  {way} leaves out: command_delay, floor" in lines
        missed = replayed(to, way, tmp_path, arm, motions[0]) - ours(arm, motions[0])
        assert told["replay"][way]["angle"] == pytest.approx(rms(missed))
        assert told["left_out"][way]["floor"]["angle"] > COUNT
    assert sum(parts) == pytest.approx(seconds_of(motions) * len(told["replay"]))
