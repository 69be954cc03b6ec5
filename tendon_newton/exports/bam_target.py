"""Export to Rhoban/bam: their parameter file, which their program runs in MuJoCo and mjlab."""

import csv
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from importlib.resources import files
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidModelFile, InvalidOutput
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.model_numbers import (
    coverage_of,
    nearly,
    not_exact,
    number,
    refuse_damaged,
    spool_of,
)
from tendon_newton.exports.mujoco.mjcf_servo import set_friction
from tendon_newton.exports.mujoco.mujoco_target import change_mechanism
from tendon_newton.mechanisms.authoring.mujoco_file import mujoco_spec, newton_s_mujoco, write_spec
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon
from tendon_newton.safe_path import safe_children
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Trajectory

PARAMETER_FILE, MODEL_FILE, PROGRAM_FILE = "servo.json", "model.xml", "bam_servo.py"
# Environment variable with a Python that has better-actuator-models, if this one has not
PYTHON_VARIABLE = "TENDON_NEWTON_BAM_PYTHON"
# Duty [1/rad] of an XL330 at its gain of 400, at which their files mean it: 4096 counts a turn, 885
# counts of full duty (ROBOTIS e-manual), and 256 by its own load register
DUTY_PER_RAD = 400.0 * (4096.0 / (2.0 * pi)) / (256.0 * 885.0)
SERVO, SPOOL = "servo", "spool"
DRAWN_MASS = 1.0e-6  # Mass [kg] of a spool that is drawn: its inertia is nothing beside its rotor's
# Time constant [s] and damping [1] with which a string catches its spool
STRING_STOP = (5.0e-4, 1.0)
# MuJoCo's `solimp` of that string, which stretches by half a micrometre at 5 N. A stiffer one comes
# loose for single steps, and the load cell reads nothing then.
STRING_SHAPE = (0.98, 0.98, 1.0e-4, 0.5, 2.0)

# What their program says of each effect
COVERAGE = coverage_of(
    (
        "gain_error",
        "position_offset",
        "spool_radius_error",
        "tendon_slack",
        "coulomb_friction",
        "stribeck_friction",
        "gear_load_friction",
        "load_stribeck_friction",
        "viscous_friction",
        "joint_stiffness_error",
        "load_dependent_friction",
        "joint_damping_error",
        "joint_dry_friction",
        "inertia_error",
        "gravity_misalignment",
    ),
    (),
)


def write_bam_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `servo.json`, `model.xml` and the program that joins them.

    Raises:
        InvalidModelFile: The servo is no DC motor behind a position loop, or its string is routed.
        InvalidOutput: A file cannot be written.
    """
    tendon = the_tendon(mechanism, model)
    refuse_damaged(model)
    write_spec(folder / MODEL_FILE, bench_spec(mechanism, model, tendon))
    program = files("tendon_newton.exports").joinpath("bam_servo.template").read_text("utf-8")
    parameters = json.dumps(parameter_table(model, tendon), indent=2) + "\n"
    write_text(folder / PROGRAM_FILE, program)
    write_text(folder / PARAMETER_FILE, parameters)
    python = os.environ.get(PYTHON_VARIABLE)
    if not python and importlib.util.find_spec("bam"):
        python = sys.executable
    return Exported(
        files=tuple(folder / name for name in (PARAMETER_FILE, MODEL_FILE, PROGRAM_FILE)),
        loading=LOADING,
        replays=(
            {PROGRAM_FILE: lambda run: replay_bam(folder, python, mechanism, model, run)}
            if python
            else {}
        ),
        left_out={PROGRAM_FILE: not_exact(model, COVERAGE)},
        nearly={PROGRAM_FILE: nearly(model, COVERAGE)},
    )


def the_tendon(mechanism: Mechanism, model: Model) -> Tendon:
    """Return the only tendon of a bench that bam can turn."""
    if model.actuator.name != "pwm_servo":
        raise InvalidModelFile(
            "bam needs a pwm_servo, a DC motor behind a position loop; the actuator is "
            f"{model.actuator.name!r}"
        )
    if len(mechanism.tendons) != 1 or mechanism.tendons[0].route is not None:
        raise InvalidModelFile(
            f"bam turns one joint: it needs a bench with one tendon whose moment arms are "
            f"constant; {mechanism.name!r} has {len(mechanism.tendons)}"
            f"{', routed' if mechanism.tendons[0].route is not None else ''}"
        )
    return mechanism.tendons[0]


def parameter_table(model: Model, tendon: Tendon) -> dict[str, Any]:
    """Return the keys of a parameter file: theirs, and `loop` with what theirs has no keys for."""
    values = {k: v for k, v in model.actuator.values.items() if isinstance(v, float)}
    radius = spool_of(tendon, model)
    duty = values["duty_per_rad"] * number(model, "gain_error", "scale")
    out: dict[str, Any] = {
        "model": variant(model),
        "actuator": "xl330",
        "kt": values["torque_constant"],
        "R": values["resistance"],
        "armature": values["armature"],
        "q_offset": -number(model, "position_offset", "angle"),
        "error_gain_ratio": duty / DUTY_PER_RAD,
        **frictions(model, radius),
    }
    out["loop"] = {
        "duty_per_rad": duty,
        "supply": values["supply_voltage"],
        "max_duty": values["max_duty"],
        "radius": radius,
        "direct": tendon.direct,
        "offset": number(model, "position_offset", "angle"),
        "command_shift": values.get("duty_offset", 0.0) / duty,
    }
    return out


def variant(model: Model) -> str:
    """Return the least of their models that has all the frictions."""
    names = {effect.name for effect in model.effects}
    if "load_dependent_friction" in names:
        return "m5"
    load = names & {"gear_load_friction", "load_stribeck_friction"}
    curved = names & {"stribeck_friction", "load_stribeck_friction"}
    return {(False, False): "m1", (False, True): "m2", (True, False): "m3", (True, True): "m4"}[
        (bool(load), bool(curved))
    ]


def frictions(model: Model, radius: float) -> dict[str, float]:
    """Return their friction numbers; torques are forces times the spool's radius [m]."""
    coulomb = number(model, "stribeck_friction", "coulomb_force")
    static = number(model, "stribeck_friction", "static_force")
    gear = number(model, "load_stribeck_friction", "coefficient")
    breakaway = number(model, "load_stribeck_friction", "static_coefficient")
    names = {effect.name for effect in model.effects}
    curve = "load_stribeck_friction" if "load_stribeck_friction" in names else "stribeck_friction"
    return {
        "friction_base": radius * (number(model, "coulomb_friction", "force") + coulomb),
        "friction_stribeck": radius * (static - coulomb),
        "friction_viscous": radius * number(model, "viscous_friction", "coefficient"),
        "load_friction_base": gear + number(model, "gear_load_friction", "coefficient"),
        "load_friction_stribeck": breakaway - gear,
        "load_friction_motor": 0.0,
        "load_friction_external": number(model, "load_dependent_friction", "coefficient"),
        "load_friction_motor_stribeck": 0.0,
        "load_friction_external_stribeck": 0.0,
        "dtheta_stribeck": number(model, curve, "stribeck_velocity"),
        "alpha": 2.0,
    }


def bench_spec(mechanism: Mechanism, model: Model, tendon: Tendon) -> Any:
    """Return the bench for MuJoCo with a motor; a string gets a spool that turns on its own."""
    mujoco = newton_s_mujoco()
    spec = mujoco_spec(mechanism)
    spec.option.timestep = 1.0e-4
    change_mechanism(spec, mechanism, model)
    row = spec.tendon(tendon.name)
    turned = mechanism.joints[0].name
    if tendon.direct:
        spec.delete(row)
    else:
        turned = SPOOL
        radius = spool_of(tendon, model)
        body = spec.worldbody.add_body(name=SPOOL, pos=[-0.05, 0.0, 0.0], quat=[1, 0, 0, 0])
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0.0, 0.0],
            mass=DRAWN_MASS,
            contype=0,
            conaffinity=0,
        )
        body.add_joint(name=SPOOL, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 1.0, 0.0])
        row.wrap_joint(SPOOL, -radius)
        slack = number(model, "tendon_slack", "length")
        row.limited, row.range = True, [-tendon.excursion_offset - slack, 1.0e3]
        row.solref_limit, row.solimp_limit = STRING_STOP, STRING_SHAPE
    set_friction(spec.joint(turned), 1.0e-9)  # bam writes its own in every step
    motor = spec.add_actuator(name=SERVO, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=turned)
    motor.gear[0] = 1.0
    return spec


def replay_bam(
    folder: Path, python: str, mechanism: Mechanism, model: Model, recording: Recording
) -> Trajectory:
    """Replay a recording with bam's own program, from where our simulation starts."""
    if recording.command is None:
        raise InvalidModelFile(f"{recording.name} has no commands to replay")
    first = replay([recording], model)[0]
    with tempfile.TemporaryDirectory() as draft:
        commands, out = Path(draft) / "commands.csv", Path(draft) / "replay.csv"
        table = np.column_stack([recording.time, recording.command[:, 0]])
        with commands.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([["t", "theta_d"], *table.tolist()])
        offset = number(model, "position_offset", "angle")
        start = [*first.joint_position[0]]
        if not mechanism.tendons[0].direct:
            start.append(first.motor_position[0, 0] - offset)
        program = str(folder / PROGRAM_FILE)
        with safe_children():  # others' files may lie beside the program
            run = subprocess.run(
                [python, program, str(commands), "--out", str(out), "--start", *map(str, start)],
                capture_output=True,
                text=True,
                check=False,
            )
        if run.returncode:
            raise InvalidOutput(f"bam's program failed: {run.stderr.strip().splitlines()[-1]}")
        columns: Array = np.loadtxt(out, delimiter=",", skiprows=1)
    return Trajectory(
        time=recording.time,
        motor_position=columns[:, 1:2],
        motor_velocity=columns[:, 2:3],
        force=columns[:, 3:4],
        joint_position=columns[:, 4 : 4 + len(mechanism.joints)],
    )


LOADING = """```sh
pip install "better-actuator-models[mujoco]"
python bam_servo.py commands.csv --out replay.csv     # columns t [s] and theta_d [rad]
```

`servo.json` is a parameter file of Rhoban/bam, with one key more: `loop` holds the gain, supply and
greatest duty, which their program keeps in its own classes. `bam_servo.py` sets them there:

```python
import mujoco, bam_servo

model = mujoco.MjModel.from_xml_path("model.xml")
data = mujoco.MjData(model)
controller = bam_servo.make_controller(model, data)
controller.set_q_target("servo", 1.0)      # desired motor angle [rad]
controller.update()
mujoco.mj_step(model, data)
```

In mjlab, give `bam.mjlab.BamActuatorCfg` the file `servo.json`, and set the loop in the same way.
"""

BAM = ExportTarget(coverage=COVERAGE, write=write_bam_target)
