"""Every packaged bench and every actuator goes to every program, or is refused in words."""

# The stubs of mujoco leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import contextlib
import io
from pathlib import Path

import mujoco
import newton
import numpy as np
import pytest

from examples.studies.exports import ACTUATORS as TYPICAL
from examples.studies.exports import model_of
from tendon_newton.actuators import ACTUATORS, find_actuator
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.errors import TendonNewtonError
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import command_range
from tendon_newton.exports.mujoco.mjcf_spool import tension_name
from tendon_newton.exports.written_program import load_program
from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.authoring.mujoco_file import named_apart
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of

# A network takes a minute to be taught to the targets with a network of their own
SERVOS = [name for name in ACTUATORS if name != "learned"]
# Targets whose files another servo changes; Newton's drive has tests of its own for each
OF_THE_SERVO = ("mujoco", "isaaclab", "mjlab", "bam")
ROUND_OFF = 1.0e-6  # N: what MuJoCo's solver leaves of a force that is none


def model_for(bench: str, servo: str) -> Model:
    """Return a servo with usual numbers."""
    if servo in TYPICAL:
        return model_of(bench, servo)
    values = {p.name: p.nominal for p in find_actuator(servo).parameters}
    return Model(actuator=NamedValues(name=servo, values=values))


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
        if target == "networks":
            continue  # trains
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
