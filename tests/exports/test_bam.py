"""An identified servo as a parameter file of Rhoban/bam."""

import json
from pathlib import Path

import mujoco
import pytest

from examples.studies.exports import PWM, model_of
from tendon_lab.foreign_logs.bam.bam_parameters import read_parameters
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.bam_target import (
    COVERAGE,
    PARAMETER_FILE,
    PROGRAM_FILE,
    write_bam_target,
)
from tendon_newton.simulation.hosts.replay import bench_of

FRICTIONS = ("coulomb_friction", "stribeck_friction", "gear_load_friction",
             "load_stribeck_friction", "load_dependent_friction", "viscous_friction")  # fmt: skip
WHOLE = 1.0e-9  # relative: nothing but the rounding of one division lies between


@pytest.mark.parametrize("friction", FRICTIONS)
def test_a_servo_comes_back_as_it_was(friction: str, tmp_path: Path) -> None:
    """Our own importer reads motor and friction out of the file again, on a shaft."""
    model = model_of("pendulum", "pwm_servo", friction)
    write_bam_target(tmp_path, bench_of("pendulum", model), model)
    back = read_parameters(tmp_path / PARAMETER_FILE)
    assert back.left_out == ()
    found = {effect.name: dict(effect.values) for effect in back.model.effects}
    (given,) = model.effects
    assert found.pop(given.name) == pytest.approx(dict(given.values), rel=WHOLE)
    values = back.model.actuator.values
    gain = found.pop("gain_error")["scale"] * float(values["duty_per_rad"])
    assert gain == pytest.approx(PWM["duty_per_rad"], rel=WHOLE)
    assert found == {}
    for name in ("torque_constant", "resistance"):
        assert values[name] == pytest.approx(PWM[name], rel=WHOLE)


def test_friction_at_a_spool_is_a_torque_there(tmp_path: Path) -> None:
    """What is a force at the string is that force times the spool's radius in the file."""
    model = model_of("finger", "pwm_servo", "coulomb_friction", "viscous_friction")
    write_bam_target(tmp_path, bench_of("finger", model), model)
    table = json.loads((tmp_path / PARAMETER_FILE).read_text(encoding="utf-8"))
    assert table["friction_base"] == pytest.approx(0.6 * 0.0125)  # [N m]
    assert table["friction_viscous"] == pytest.approx(0.8 * 0.0125)  # [N m s/rad]
    assert table["model"] == "m1"


def test_a_string_can_pull_its_spool_and_not_push_it(tmp_path: Path) -> None:
    """A spool that unwinds leaves the finger where it is; one that winds takes it along."""
    model = model_of("finger", "pwm_servo")
    write_bam_target(tmp_path, bench_of("finger", model), model)
    bench = mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml"))
    data = mujoco.MjData(bench)
    for torque, taken in ((0.05, True), (-0.05, False)):
        mujoco.mj_resetData(bench, data)
        bench.opt.gravity[:] = 0.0
        bench.dof_armature[-1] = 2.0e-4
        for _ in range(400):
            data.ctrl[0] = torque
            mujoco.mj_step(bench, data)
        assert (data.qpos[0] > 0.05) == taken
        assert abs(data.qpos[-1]) > 0.05


@pytest.mark.parametrize(
    ("bench", "actuator", "words"),
    [
        ("finger", "ideal", "needs a pwm_servo"),
        ("finger", "learned", "needs a pwm_servo"),
        ("thumb", "pwm_servo", "routed"),
    ],
)
def test_what_bam_cannot_turn_is_refused(
    bench: str, actuator: str, words: str, tmp_path: Path
) -> None:
    """The message says what it needs; no file is written."""
    model = model_of(bench, actuator)
    with pytest.raises(InvalidModelFile, match=words):
        write_bam_target(tmp_path, bench_of(bench, model), model)
    assert not list(tmp_path.iterdir())


def test_the_list_says_what_a_file_of_bam_leaves_out(tmp_path: Path) -> None:
    """A delay has no key there."""
    model = model_of("finger", "pwm_servo", "command_delay", "gear_load_friction", "gain_error")
    exported = write_bam_target(tmp_path, bench_of("finger", model), model)
    assert exported.left_out == {PROGRAM_FILE: ("command_delay",)}
    assert COVERAGE["command_delay"] == "none"
