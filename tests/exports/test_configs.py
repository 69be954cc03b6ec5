"""Configuration files for programs that pin other versions: their classes and fields."""

# The stubs of mujoco leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import dataclasses
import runpy
import sys
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np
import pytest
import torch

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.configs import students, text
from tendon_newton.exports.configs.isaaclab_target import write_isaaclab_target
from tendon_newton.exports.configs.mjlab_target import write_mjlab_target
from tendon_newton.exports.configs.text import CONFIG_FILE
from tendon_newton.mechanisms.asset_library import asset_folder
from tendon_newton.simulation.hosts.replay import bench_of
from tests.exports.models import PWM, model_of

ISAACLAB_BASE = {
    "class_type", "joint_names_expr", "actuator_effort_limit", "actuator_velocity_limit",
    "joint_effort_limit", "joint_velocity_limit", "stiffness", "damping", "armature", "friction",
    "dynamic_friction", "viscous_friction",
}  # fmt: skip
ISAACLAB = {
    "DelayedPDActuatorCfg": {*ISAACLAB_BASE, "min_delay", "max_delay"},
    "DCMotorCfg": {*ISAACLAB_BASE, "saturation_effort"},
    "ActuatorNetMLPCfg": {
        *ISAACLAB_BASE, "saturation_effort", "network_file", "pos_scale", "vel_scale",
        "torque_scale", "input_order", "input_idx",
    },
}  # fmt: skip
"""Fields of the classes of Isaac Lab 3.0.0, without those that it calls deprecated."""
MJLAB_BASE = {
    "target_names_expr", "transmission_type", "armature", "frictionloss", "viscous_damping",
    "delay_min_lag", "delay_max_lag", "delay_hold_prob", "delay_update_period",
    "delay_per_env_phase",
}  # fmt: skip
MJLAB = {
    "BuiltinPositionActuatorCfg": {*MJLAB_BASE, "stiffness", "damping", "effort_limit"},
    "BuiltinDcMotorActuatorCfg": {
        *MJLAB_BASE, "motor_params", "mode", "stiffness", "damping", "voltage_limit",
        "integral_gain", "integral_limit", "slew_rate", "effort_limit", "gear", "inductance",
        "electrical_time_constant", "thermal", "cogging", "lugre",
    },
    "LearnedMlpActuatorCfg": {
        *MJLAB_BASE, "network_file", "pos_scale", "vel_scale", "torque_scale", "input_order",
        "history_length", "stiffness", "damping", "effort_limit", "saturation_effort",
        "velocity_limit",
    },
    "DcMotorPhysicalParams": {"kt", "ke", "resistance"},
}  # fmt: skip
"""Fields of the classes of mjlab 1.6.0."""
REQUIRED = {
    "DelayedPDActuatorCfg": {"joint_names_expr", "stiffness", "damping"},
    "DCMotorCfg": {"joint_names_expr", "stiffness", "damping", "saturation_effort"},
    "ActuatorNetMLPCfg": {
        "joint_names_expr", "saturation_effort", "network_file", "pos_scale", "vel_scale",
        "torque_scale", "input_order", "input_idx",
    },
    "BuiltinPositionActuatorCfg": {"target_names_expr", "stiffness", "damping"},
    "BuiltinDcMotorActuatorCfg": {"target_names_expr", "motor_params"},
    "DcMotorPhysicalParams": {"kt", "ke", "resistance"},
    "LearnedMlpActuatorCfg": {
        "target_names_expr", "saturation_effort", "velocity_limit", "network_file", "pos_scale",
        "vel_scale", "torque_scale",
    },
}  # fmt: skip
"""Fields without a default."""


def configured(path: Path, classes: dict[str, set[str]]) -> tuple[str, dict[str, Any]]:
    """Run a file as its program would, and return the class that it configures and the numbers.

    Stubs stand in for the program's module. They take the fields of its classes, demand those
    without a default, and refuse any other.
    """
    module: Any = ModuleType("stub")
    for name, fields in classes.items():
        needed = [(field, Any) for field in REQUIRED.get(name, set())]
        others = [
            (f, Any, dataclasses.field(default=None)) for f in fields - REQUIRED.get(name, set())
        ]
        setattr(module, name, dataclasses.make_dataclass(name, [*needed, *others], kw_only=True))
    module.DcMotorInputMode = Enum("DcMotorInputMode", ["VOLTAGE", "POSITION", "VELOCITY"])
    inner: Any = ModuleType("inner")
    inner.TransmissionType = Enum("TransmissionType", ["JOINT", "TENDON", "SITE"])
    names = ("isaaclab", "isaaclab.actuators", "mjlab", "mjlab.actuator")
    stubs = {**dict.fromkeys(names, module), "mjlab.actuator.actuator": inner}
    with patch.dict(sys.modules, stubs):
        (config,) = runpy.run_path(str(path))["ACTUATORS"].values()
    given = {name: value for name, value in vars(config).items() if value is not None}
    return type(config).__name__, given


LATE = ("command_delay", "coulomb_friction")


@pytest.mark.parametrize(
    ("bench", "actuator", "effects", "kind"),
    [
        ("spring_weak", "ideal", (), "DelayedPDActuatorCfg"),
        ("spring_weak", "pd_torque", LATE, "DelayedPDActuatorCfg"),
        ("spring_weak", "pwm_servo", ("stribeck_friction",), "DCMotorCfg"),
        ("spring_weak", "pwm_servo", ("command_delay",), "DelayedPDActuatorCfg"),
        ("finger", "ideal", LATE, "BuiltinPositionActuatorCfg"),
        ("thumb", "pd_torque", LATE, "BuiltinPositionActuatorCfg"),
        ("finger", "pwm_servo", LATE, "BuiltinDcMotorActuatorCfg"),
    ],
)
def test_a_program_has_the_fields_of_the_file(bench, actuator, effects, kind, tmp_path) -> None:
    """The file runs: the class takes every number in it, and has all that it needs."""
    model, of_mjlab = model_of(bench, actuator, *effects), kind in MJLAB
    write = write_mjlab_target if of_mjlab else write_isaaclab_target
    write(tmp_path, bench_of(bench, model), model)
    name, _ = configured(tmp_path / CONFIG_FILE, MJLAB if of_mjlab else ISAACLAB)
    assert name == kind


def test_isaac_lab_s_numbers_are_those_of_the_servo_at_its_joint(tmp_path: Path) -> None:
    """Gains at a joint are those at the spool over its radius squared; six steps are 30 ms."""
    model = model_of("spring_weak", "pwm_servo", "command_delay", "coulomb_friction")
    exported = write_isaaclab_target(tmp_path, bench_of("spring_weak", model), model)
    _, numbers = configured(tmp_path / CONFIG_FILE, ISAACLAB)
    radius, ohms, constant = PWM["spool_radius"], PWM["resistance"], PWM["torque_constant"]
    gain = PWM["duty_per_rad"] * PWM["supply_voltage"] * constant / ohms
    assert numbers["stiffness"] == pytest.approx(gain / radius**2)
    assert numbers["damping"] == pytest.approx(constant**2 / ohms / radius**2)
    assert numbers["armature"] == pytest.approx(PWM["armature"] / radius**2)
    assert numbers["dynamic_friction"] == pytest.approx(0.6)
    assert numbers["max_delay"] == 6
    assert exported.left_out[CONFIG_FILE] == ("command_delay", "coulomb_friction")


def test_isaac_lab_drives_no_tendon_over_several_joints(tmp_path: Path) -> None:
    """The message says which target can; no file is written."""
    model = model_of("finger", "ideal")
    with pytest.raises(InvalidModelFile, match="--to newton"):
        write_isaaclab_target(tmp_path, bench_of("finger", model), model)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("bench", ["finger", "thumb"])
def test_mjlab_s_motor_at_the_tendon_rests_where_the_servo_does(bench: str, tmp_path: Path) -> None:
    """The file's numbers, given to MuJoCo as mjlab does, hold the servo's force at an error."""
    model = model_of(bench, "pwm_servo")
    mechanism = bench_of(bench, model)
    write_mjlab_target(tmp_path, mechanism, model)
    _, plain = configured(tmp_path / CONFIG_FILE, MJLAB)
    spec = mujoco.MjSpec.from_file(str(tmp_path / "bench.xml"))
    (target,) = plain["target_names_expr"]
    motor = spec.add_actuator(name="motor", target=target, trntype=mujoco.mjtTrn.mjTRN_TENDON)
    motor.gear[0] = plain["gear"]
    given = plain["motor_params"]
    ampere = given.kt / given.resistance  # MuJoCo 3.17 takes torques where mjlab's 3.11 took volts
    loop = [ampere * plain["stiffness"], ampere * (plain["damping"] + given.ke)]
    controller = [loop[0], 0.0, loop[1], 0.0, 0.0, plain["voltage_limit"]]
    motor.set_to_dcmotor([given.kt, given.ke], given.resistance, controller=controller, ctrlspec=1)
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    length = data.ten_length[compiled.tendon(target).id]
    data.ctrl[0] = plain["gear"] * length + 0.3  # motor angle and error [rad]
    mujoco.mj_forward(compiled, data)
    torque = PWM["torque_constant"] * 0.3 * PWM["duty_per_rad"] * PWM["supply_voltage"]
    torque /= PWM["resistance"]
    force = plain["gear"] * data.actuator_force[0]
    assert force == pytest.approx(torque / PWM["spool_radius"], rel=1e-6)
    assert np.isfinite(data.qacc).all()


def test_an_mlp_learns_the_force_of_a_servo() -> None:
    """An ideal servo is P times the error, cut at zero: the network finds it on unseen runs.

    A fifth of an export's training leaves less than a fifth of the forces' spread.
    """
    model = model_of("finger", "ideal")
    lessons = students.lessons_of(bench_of("finger", model), model)
    _, error = students.fit_mlp(lessons, steps=300)
    assert error < 0.2 * float(lessons.force[-students.HELD_OUT :].std())


def test_a_force_network_becomes_a_file_and_its_scales(tmp_path: Path, monkeypatch) -> None:
    """The program is told what to multiply by; the file takes errors, newest first, and speeds."""
    monkeypatch.setattr(text, "MLP_STEPS", 1)
    file = asset_folder() / "networks" / "transformer-simulation-paper-0.safetensors"
    values = {"file": str(file), "spool_radius": 0.0125}
    model = Model(actuator=NamedValues(name="learned", values=values))
    write_mjlab_target(tmp_path, bench_of("finger", model), model)
    name, numbers = configured(tmp_path / CONFIG_FILE, MJLAB)
    assert (name, numbers["history_length"]) == ("LearnedMlpActuatorCfg", students.HISTORY)
    assert all(numbers[scale] > 0.0 for scale in ("pos_scale", "vel_scale", "torque_scale"))
    with pytest.warns(DeprecationWarning, match="torch.jit.load"):  # what mjlab calls
        loaded = torch.jit.load(tmp_path / text.NETWORK_FILE)
    assert loaded(torch.zeros(3, 2 * students.HISTORY)).shape == (3, 1)
