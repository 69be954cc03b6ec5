"""Every packaged bench and every actuator goes to every program, or is refused in words."""

# The stubs of mujoco leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import contextlib
import io
import json
from dataclasses import replace
from pathlib import Path

import mujoco
import newton
import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.errors import TendonNewtonError
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import Departure, command_range, departure, sines
from tendon_newton.exports.export_page import Fidelity, told_lines, write_page
from tendon_newton.exports.export_target import Exported
from tendon_newton.exports.mujoco.mjcf_spool import tension_name
from tendon_newton.exports.written_program import load_program
from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.authoring.mujoco_file import named_apart
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import bench_of, replay
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.model.parameter_table import spool_radius_of
from tests.exports.loops import WAVES, told_and_found
from tests.exports.models import SERVOS, model_for, model_of
from tests.physics.runs import run_of

# Targets whose files another servo changes; Newton's drive has tests of its own for each
OF_THE_SERVO = ("mujoco",)
ROUND_OFF = 1.0e-6  # N: what MuJoCo's solver leaves of a force that is none


def opens(file: Path) -> None:
    """Open a file with the program that it is for."""
    if file.suffix in (".xml", ".urdf"):
        mujoco.MjModel.from_xml_path(str(file))
    elif file.suffix == ".usda":
        from pxr import Usd

        assert Usd.Stage.Open(str(file)).GetDefaultPrim()
    elif file.suffix == ".py":
        compile(file.read_text(encoding="utf-8"), file.name, "exec")
    if file.name == "bench.usda":
        with contextlib.redirect_stdout(io.StringIO()):
            assert newton.ModelBuilder().add_usd(str(file))["path_joint_map"]


@pytest.mark.filterwarnings("ignore::UserWarning")  # Newton's reader says what it passes over
@pytest.mark.parametrize("servo", SERVOS)
@pytest.mark.parametrize("bench", asset_names())
def test_a_bench_goes_to_every_program(bench: str, servo: str, tmp_path: Path) -> None:
    """Each file opens where it is to run, or one line says why there is none."""
    model = model_for(bench, servo)
    mechanism = bench_of(bench, model)
    refused: list[str] = []
    for target in EXPORTS if servo == "ideal" else OF_THE_SERVO:
        folder = tmp_path / target
        folder.mkdir()
        try:
            exported = EXPORTS[target].write(folder, mechanism, model)
        except TendonNewtonError as error:
            refused.append(str(error))
            assert not list(folder.iterdir())
            continue
        for file in exported.files:
            opens(file)
        if target == "mujoco":
            only_pulls(folder, named_apart(mechanism), model)
    assert not any("\n" in line for line in refused)


def only_pulls(folder: Path, mechanism: Mechanism, model: Model) -> None:
    """Ask every servo to pay out a turn and more: no string pushes, by the file or the program."""
    file = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    data = mujoco.MjData(file)
    hook = load_program(folder / "tendon_step.py").make()
    _, high = command_range(mechanism, spool_radius_of(model))
    hook.reset([high] * len(mechanism.tendons))
    strings = [tendon.name for tendon in mechanism.tendons if not tendon.direct]
    for command in (high, -1.0, -10.0):
        data.ctrl[:] = hook.command[:] = command
        hook.step()
        shown = zip(mechanism.tendons, hook.read().force, strict=True)
        assert all(force >= 0.0 for tendon, force in shown if not tendon.direct)
        for _ in range(300):
            mujoco.mj_step(file, data)
            pulls = [pull_of(file, data, name) for name in strings]
            assert min(pulls, default=0.0) >= -ROUND_OFF
    assert np.isfinite(data.qpos).all()


def pull_of(file: mujoco.MjModel, data: mujoco.MjData, string: str) -> float:
    """Return what a string pulls with [N]: by its sensor, or its actuator where it has none."""
    name = tension_name(string)
    if mujoco.mj_name2id(file, mujoco.mjtObj.mjOBJ_SENSOR, name) >= 0:
        return float(data.sensor(name).data[0])
    number = file.actuator(string).id
    return float(data.actuator_force[number] * abs(file.actuator_gear[number, 0]))


def test_the_page_tells_what_the_replays_show(tmp_path: Path) -> None:
    """A way that leaves no effect out and strays is not told as if nothing were missing."""
    mechanism = load_mechanism("finger")
    low, high = command_range(mechanism)
    *inside, sweep = sines(mechanism).values()
    assert all(low <= run.command.min() <= run.command.max() <= high for run in inside)
    assert sweep.command.min() < 0.0
    assert sweep.command.max() * 0.0125 > 0.0217  # m, all that the joints take when closed
    far = Departure(angle=0.157, force=3.9, tip=None)
    fidelity = Fidelity(runs=("a",), replays={"file": far}, costs={}, sines={"file": {"8 Hz": far}})
    exported = Exported(files=(), loading="", replays={"file": lambda run: run})
    write_page(tmp_path, "finger", exported, fidelity)
    page = (tmp_path / "README.md").read_text()
    assert f"| file | sine of 8 Hz | {far.text} |" in page
    assert "How its servo, its string and its steps differ is in the table above" in page
    assert f"  {'file':24s} {far.text}, sine of 8 Hz" in told_lines(fidelity, exported)
    near = Departure(angle=0.001, force=0.001, tip=None)
    close = Fidelity(runs=("a",), replays={"file": near}, costs={}, sines={})
    write_page(tmp_path, "finger", exported, close)
    assert (tmp_path / "README.md").read_text().endswith("file: no effect of this model.\n")


def test_a_run_with_numbers_of_its_own_is_not_of_the_files(tmp_path: Path) -> None:
    """It is replayed in files with its numbers: the page says so, and replay.json."""
    times = np.arange(81) / 80.0
    asked = np.where(times < 0.5, 0.5, 1.0)[:, None]
    still = np.zeros_like(asked)
    plain = Recording(name="plain.csv", bench="finger", time=times, command=asked,
                      motor_position=still, motor_velocity=still)  # fmt: skip
    heavy = replace(plain, name="heavy.csv", bench_overrides=BenchOverrides(mass=(0.05, 0.02)))
    write_model(tmp_path / "model.toml", model_of("finger", "ideal"))
    write_dataset(tmp_path / "data", [plain], [heavy])
    words = ["--to", "usd", "--dataset", str(tmp_path / "data"), "--out", str(tmp_path / "out")]
    assert main(["export", str(tmp_path / "model.toml"), *words]) == 0
    told = "heavy.csv states numbers of its own"
    page = (tmp_path / "out" / "README.md").read_text()
    assert told in page
    assert "plain.csv states" not in page
    assert json.loads((tmp_path / "out" / "replay.json").read_text())["stated"] == ["heavy.csv"]


@pytest.mark.parametrize(("bench", "unit"), [("pendulum", "N m"), ("thumb", "N")])
def test_what_turns_a_shaft_is_told_as_a_torque(bench: str, unit: str) -> None:
    """A string pulls in newtons."""
    mechanism = load_mechanism(bench)
    still = np.zeros((2, len(mechanism.tendons)))
    run = Trajectory(
        time=np.arange(2.0), motor_position=still, motor_velocity=still, force=still,
        joint_position=np.zeros((2, len(mechanism.joints))),
    )  # fmt: skip
    assert f"| 0.0000 {unit} |" in departure(mechanism, [run], [run]).text


@pytest.mark.parametrize(
    ("target", "bench", "servo", "waves"),
    [
        ("mujoco", "finger", "pwm_servo", WAVES),
        ("mujoco", "finger_antagonist", "ideal", WAVES[2:]),
        ("mujoco", "pendulum", "pd_torque", WAVES[2:]),
        ("newton", "spring_weak", "ideal", WAVES[2:]),
    ],
)
def test_what_the_page_tells_of_a_sine_is_what_a_user_finds(
    target, bench, servo, waves, tmp_path
) -> None:
    """A user's own loop strays from our simulation as far as the page tells that a replay does."""
    found = dict(told_and_found(tmp_path, target, bench, model_for(bench, servo), waves))
    assert found
    assert [one.text for way in found.values() for one in way if not one.true] == []


@pytest.mark.parametrize("way", ["model.xml alone", "tendon_step.py"])
def test_a_string_that_pushes_is_told_with_its_force(way, tmp_path) -> None:
    """In the file alone that of a servo that pays out pushes with up to twice its friction."""
    model = model_of("spring_weak", "ideal", "coulomb_friction")
    mechanism = bench_of("spring_weak", model)
    exported = EXPORTS["mujoco"].write(tmp_path, mechanism, model)
    run = run_of(np.r_[np.full(8, 0.8), np.full(8, -1.0), np.full(8, 0.8)], bench="spring_weak")
    far = departure(mechanism, [exported.replays[way](run)], replay([run], model))
    fidelity = Fidelity(runs=("a",), replays={way: far}, costs={}, sines={})
    told = [line for line in told_lines(fidelity, exported) if "pushes" in line]
    assert far.push <= 2.0 * 0.6 + ROUND_OFF
    pushes = f"  {way}: a string pushes with up to {far.push:.2g} N in the runs."
    assert told == [pushes] * (way == "model.xml alone")
