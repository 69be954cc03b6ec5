"""Export to mjlab: the bench as MJCF, and the configuration of an actuator at its tendon."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.base import Exported, ExportTarget
from tendon_newton.exports.configs.text import (
    CONFIG_FILE,
    PHYSICS_STEP,
    Expression,
    config_text,
    coverage_of,
    dry_friction,
    gravity_text,
    write_text,
)
from tendon_newton.exports.mjcf_servo import angle_shift, number, spool_of
from tendon_newton.exports.mujoco_target import change_mechanism, refuse_damaged, refuse_kinematic
from tendon_newton.exports.networks.files import write_torchscript
from tendon_newton.exports.networks.students import HISTORY, RATE, fit_mlp, lessons_of
from tendon_newton.exports.networks.target import MLP_STEPS
from tendon_newton.exports.newton.prims import command_lead
from tendon_newton.mechanisms.authoring.mujoco_file import (
    mujoco_spec,
    newton_s_mujoco,
    write_spec,
)
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon

BENCH_FILE, NETWORK_FILE = "bench.xml", "mlp.pt"
COVERAGE = coverage_of(
    (
        "gain_error",
        "force_saturation",
        "position_offset",
        "spool_radius_error",
        "joint_stiffness_error",
        "joint_damping_error",
        "joint_dry_friction",
        "inertia_error",
        "gravity_misalignment",
    ),
    (
        "command_delay",
        "tendon_slack",
        "viscous_friction",
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
    ),
)
"""Delays are whole steps of the physics, and a string pushes."""
IMPORTS = [
    "from pathlib import Path",
    "",
    "from mjlab.actuator import (",
    "    BuiltinDcMotorActuatorCfg,",
    "    BuiltinPositionActuatorCfg,",
    "    LearnedMlpActuatorCfg,",
    "    TransmissionType,",
    ")",
    "",
    "FOLDER = Path(__file__).resolve().parent",
]
TITLE = "The servo of the bench {bench} for mjlab 1.6, for physics steps of {step:g} s."
FAST = 1.0e6
"""A speed [m/s] that no tendon reaches."""


def write_mjlab_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `bench.xml` and `servo_cfg.py`, and the network of a learned servo.

    Raises:
        InvalidModelFile: The actuator has no force.
        InvalidOutput: A file cannot be written.
    """
    refuse_kinematic(model, "mjlab")
    refuse_damaged(model)
    signs, offsets = placed_tendons(mechanism)
    spec = mujoco_spec(mechanism)
    change_mechanism(spec, mechanism, model)
    write_spec(folder / BENCH_FILE, spec)
    files, note = [folder / BENCH_FILE, folder / CONFIG_FILE], ""
    learned: tuple[float, float, float] | None = None
    if find_actuator(model.actuator.name).held:
        if any(tendon.route is not None for tendon in mechanism.tendons):
            raise InvalidModelFile(
                "mjlab's network drives see a tendon's length and have no sign for one that "
                "shrinks as it is wound in; a routed tendon needs --to mujoco"
            )
        lessons = lessons_of(mechanism, model)
        network, error = fit_mlp(lessons, steps=MLP_STEPS)
        write_torchscript(folder / NETWORK_FILE, network)
        files.append(folder / NETWORK_FILE)
        learned = lessons.scales
        note = NETWORK_NOTE.format(rate=RATE, error=error)
    rows = list(zip(mechanism.tendons, signs, offsets, strict=True))
    entries = {t.name: entry(t, model, sign, learned) for t, sign, _ in rows}
    title = TITLE.format(bench=mechanism.name, step=PHYSICS_STEP)
    write_text(folder / CONFIG_FILE, config_text(title, IMPORTS, "ACTUATORS", entries))
    targets = "\n".join(
        f"    {tendon.name}: {target_text(tendon, model, sign, offset, entries[tendon.name][0])}"
        for tendon, sign, offset in rows
    )
    return Exported(
        files=tuple(files),
        loading=LOADING.format(
            targets=targets, note=note, gravity=gravity_text(spec.option.gravity)
        ),
        left_out={CONFIG_FILE: tuple(e.name for e in model.effects if COVERAGE[e.name] != "exact")},
        checked=CHECKED,
    )


def placed_tendons(mechanism: Mechanism) -> tuple[list[float], list[float]]:
    """Return whether each tendon of MuJoCo grows when it is wound in, and l at no length [m]."""
    mujoco = newton_s_mujoco()
    compiled = mujoco_spec(mechanism).compile()
    state = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, state)
    signs = [1.0 if tendon.route is None else -1.0 for tendon in mechanism.tendons]
    lengths = [float(state.ten_length[compiled.tendon(t.name).id]) for t in mechanism.tendons]
    rows = zip(mechanism.tendons, signs, lengths, strict=True)
    return signs, [t.excursion_offset - sign * length for t, sign, length in rows]


def target_text(tendon: Tendon, model: Model, sign: float, offset: float, kind: str) -> str:
    """Return a tendon's target of a desired motor angle [rad]: a length, or a geared one."""
    shift = angle_shift(tendon, model, offset) - command_lead(model)
    if kind == "BuiltinDcMotorActuatorCfg":
        return f"angle - {shift:.8g}"
    return f"(angle - {shift:.8g}) * {sign * spool_of(tendon, model):.8g}"


def entry(
    tendon: Tendon, model: Model, sign: float, learned: tuple[float, float, float] | None
) -> tuple[str, dict[str, Any]]:
    """Return the class of an actuator's configuration, and its numbers by field."""
    radius = spool_of(tendon, model)
    values = {k: v for k, v in model.actuator.values.items() if isinstance(v, float)}
    scale = number(model, "gain_error", "scale")
    lost = number(model, "viscous_friction", "coefficient") / radius  # [N s/m]
    limit = min(tendon.force_limit, number(model, "force_saturation", "limit"))
    late = round(number(model, "command_delay", "delay") / PHYSICS_STEP)
    numbers: dict[str, Any] = {
        "target_names_expr": (tendon.name,),
        "transmission_type": Expression("TransmissionType.TENDON"),
        "armature": values.get("armature", 0.0) / radius**2,
        "frictionloss": dry_friction(model)[0],
        "viscous_damping": lost,
        "delay_min_lag": late,
        "delay_max_lag": late,
    }
    if learned is not None:
        pos, vel, effort = learned
        return "LearnedMlpActuatorCfg", {
            **numbers,
            "network_file": Expression(f'str(FOLDER / "{NETWORK_FILE}")'),
            "pos_scale": pos / radius,
            "vel_scale": vel / radius,
            "torque_scale": effort,
            "input_order": "pos_vel",
            "history_length": HISTORY,
            "saturation_effort": limit,
            "effort_limit": limit,
            "velocity_limit": FAST,
        }
    if model.actuator.name == "pwm_servo":
        constant, resistance = values["torque_constant"], values["resistance"]
        supply = values["supply_voltage"]
        return "BuiltinDcMotorActuatorCfg", {
            **numbers,
            "mode": "position",
            "motor_const": (constant, constant),
            "resistance": resistance,
            "stiffness": values["duty_per_rad"] * scale * supply * constant / resistance,
            "damping": constant**2 / resistance,
            "voltage_limit": values["max_duty"] * supply,
            "gear": sign / radius,
            "effort_limit": limit * radius,
        }
    if model.actuator.name == "ideal":
        gains = {"stiffness": values["gain"] * scale / radius, "damping": 0.0}
    else:
        gains = {
            "stiffness": values["kp"] * scale / radius**2,
            "damping": values["kd"] / radius**2,
        }
        limit = min(limit, values["max_torque"] / radius)
    return "BuiltinPositionActuatorCfg", {**numbers, **gains, "effort_limit": limit}


CHECKED = """It was not run by mjlab, which needs another version of MuJoCo. The names of all
fields are checked against its classes (mjlab 1.6). A test gives the numbers of a motor to MuJoCo as
mjlab does, and finds the servo's force."""
NETWORK_NOTE = """
The network sees error and speed at {rate:g} Hz: take physics steps of that length. On runs of the
model that it has not seen its force strays by {error:.4f} N.
"""
LOADING = """```python
import mujoco
from mjlab.entity import EntityArticulationInfoCfg, EntityCfg
from servo_cfg import ACTUATORS

BENCH_CFG = EntityCfg(
    spec_fn=lambda: mujoco.MjSpec.from_file("bench.xml"),
    articulation=EntityArticulationInfoCfg(actuators=tuple(ACTUATORS.values())),
)
```

Give the scene this `gravity` [m/s2]: `{gravity}`. An entity's own is not read.

The target is a tendon's (`tendon_len_target`). Of a desired motor angle [rad] it is:

{targets}
{note}
A string pushes there too.
"""

MJLAB = ExportTarget(
    summary="MJCF, and a configuration file for mjlab with the servo at its tendon",
    coverage=COVERAGE,
    write=write_mjlab_target,
)
