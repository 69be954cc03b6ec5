"""An identified arm in plain MuJoCo: a file that runs alone, and a program that has its servos."""

from pathlib import Path
from textwrap import indent
from typing import Any

import numpy as np

from tendon_newton.actuators.ideal_position import IdealPosition
from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.arms.arm_file import IdentifiedArm
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.effects import find_effect
from tendon_newton.exports.arms.arm_target import ArmTarget, ArmWay
from tendon_newton.exports.arms.replaying import angles_of, motion_rows
from tendon_newton.exports.linking import Linker
from tendon_newton.exports.model_law import ModelLaw
from tendon_newton.exports.model_numbers import coverage_of, number
from tendon_newton.exports.mujoco.mjcf_servo import add_delay, set_affine, set_friction
from tendon_newton.exports.runtime import arm_stepping, commands, jets, rows
from tendon_newton.exports.written_program import load_program
from tendon_newton.mechanisms.authoring import mujoco_file
from tendon_newton.simulation.kernels.position_kernels import POSITION_EFFECTS, POSITION_STEP

FILE, PROGRAM = "arm.xml", "arm_step.py"
# Modules of the program, in the order in which they are joined
RUNTIME = (jets, commands, arm_stepping, rows)
# What MJCF alone says of each effect
IN_THE_FILE = coverage_of(
    (), ("command_delay", "actuator_lag", "position_offset", "deadband", "backlash")
)
# What the program says of each effect; the clock of a log is no part of an arm
COVERAGE = coverage_of(tuple({*POSITION_EFFECTS} - {"sample_period_error"}), ())
# Compliance of a servo [rad/(N m)] whose own is not known, in the file alone
USUAL = IdealPosition.parameters[0].nominal
# How far the program's own commands go to either side of the middle of a joint's range [rad]
SWING = 0.3
TIP_RADIUS = 1.0e-3  # Of the ball at the tip that meets the floor [m]


def write_arm(folder: Path, arm: IdentifiedArm) -> tuple[Path, Path]:
    """Write `arm.xml` and `arm_step.py`, and return their paths.

    Raises:
        InvalidOutput: A file cannot be written.
    """
    file, program = folder / FILE, folder / PROGRAM
    mujoco_file.write_spec(file, arm_spec(arm))
    write_text(program, arm_program(arm))
    return file, program


def arm_spec(arm: IdentifiedArm) -> Any:
    """Return an arm as MuJoCo's editable model, with a position actuator on each joint.

    The control is what the servo is told [rad], as the servo counts.
    """
    mechanism = arm.arm.mechanism
    template = mechanism.template
    last = mujoco_file.last
    names = mujoco_file.told_apart(template.shape_label, last)
    names |= mujoco_file.told_apart(template.body_label, last)
    names |= {prim: last(prim) for prim in mujoco_file.named_prims(mechanism)}
    spec = mujoco_file.scene_spec(mechanism, names)
    for tendon in list(spec.tendons):  # a servo sits on its joint
        spec.delete(tendon)
    spec.option.gravity = arm.arm.gravity
    add_floor(spec, arm.arm)
    for joint, model, sign, zero in zip(
        mechanism.joints, arm.models, arm.arm.sign, arm.arm.zero, strict=True
    ):
        actuator = spec.add_actuator(
            name=joint.name,
            trntype=mujoco_file.newton_s_mujoco().mjtTrn.mjTRN_JOINT,
            target=joint.name,
        )
        actuator.gear[0] = sign
        lag = number(model, "actuator_lag", "time_constant")
        gain = 1.0 / (float(model.actuator.values.get("compliance", 0.0)) or USUAL)
        offset = number(model, "position_offset", "angle")
        set_affine(actuator, gain, -float(offset + sign * zero), gain * lag)
        if lag == 0.0:
            actuator.biasprm[2] = 1.0  # critically damped
        # dry friction holds a spring that pulls at a joint in just such a band
        band = number(model, "deadband", "width") + 0.5 * number(model, "backlash", "width")
        set_friction(spec.joint(joint.name), gain * band)
        add_delay(actuator, number(model, "command_delay", "delay"), spec.option.timestep)
    return spec


def add_floor(spec: Any, arm: Arm) -> None:
    """Add what the tip may rest on; nothing else of the arm meets it."""
    tip = arm.mechanism.tip
    if arm.floor is None or tip is None:
        return
    mujoco = mujoco_file.newton_s_mujoco()
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    up = -arm.gravity / np.linalg.norm(arm.gravity)
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1],
        pos=(arm.floor - TIP_RADIUS) * up, zaxis=up, contype=0, conaffinity=0,
    )  # fmt: skip
    link = spec.joint(arm.mechanism.joints[tip.body].name).parent.name
    spec.body(link).add_geom(
        name="tip", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[TIP_RADIUS, 0.0, 0.0],
        pos=tip.point, mass=0.0, contype=0, conaffinity=0,
    )  # fmt: skip
    spec.add_pair(geomname1="floor", geomname2="tip", condim=1)


def arm_program(arm: IdentifiedArm) -> str:
    """Return the Python file that steps an exported arm."""
    effects = dict.fromkeys(effect.name for model in arm.models for effect in model.effects)
    actuator = NamedValues(name=IdealPosition.name, values={})
    of_all = Model(
        actuator=actuator, effects=tuple(NamedValues(name=name, values={}) for name in effects)
    )
    law = ModelLaw(of_all, free_spool=False)
    servos = [
        {"name": name, "sign": float(sign), "zero": float(zero),
         "numbers": [float(x) for x in law.table.vector(model)]}
        for name, sign, zero, model in zip(
            arm.arm.mechanism.joint_names, arm.arm.sign, arm.arm.zero, arm.models, strict=True
        )
    ]  # fmt: skip
    middle = middle_of(arm.arm)
    known = {
        "SERVO_ROWS": servos,
        "SPAN": ((middle - SWING).tolist(), (middle + SWING).tolist()),
        "PERIOD": 1.0,
        "TIME_STEP": POSITION_STEP,
    }
    title = f"The arm {arm.arm.mechanism.name} with its identified servos, stepped in MuJoCo."
    linker = Linker(law, device=False)
    return linker.program(f"{title}\n\n{PREFACE}", known, RUNTIME, last="run(make)")


USE = """import mujoco, arm_step

model = mujoco.MjModel.from_xml_path("arm.xml")
model.opt.timestep = 2.0e-3
hook = arm_step.make_hook(model, mujoco.MjData(model))
hook.reset(angles)          # [rad] as the servos count, one per joint
hook.command[:] = command   # the same
hook.step()                 # in place of mujoco.mj_step
print(hook.read())          # what the encoders report [rad]
"""

PREFACE = (
    "Made by tendon-newton export. It needs mujoco and numpy. In a program of your own:\n\n"
    + indent(USE, "    ")
    + "\nor: python arm_step.py commands.csv --out replay.csv\n"
)


def middle_of(arm: Arm) -> Array:
    """Return the middle of each joint's range [rad], as its servo counts; 0 where it has no end."""
    ends = np.array(arm.mechanism.joint_limits)
    middle = np.where(np.isfinite(ends).all(axis=1, keepdims=True), ends, 0.0).mean(axis=1)
    return arm.sign * (middle - arm.zero)


def replay_arm_program(folder: Path, arm: IdentifiedArm, motion: ArmMotion) -> Array:
    """Replay a motion with the written program, as its user would; angles [rad], shape (T, J)."""
    program, told = load_program(folder / PROGRAM), motion_rows(motion)
    return program.replay(program.make(), told)["angle"][told["measured"]]


def replay_arm_file(folder: Path, arm: IdentifiedArm, motion: ArmMotion) -> Array:
    """Replay a motion by the MJCF file alone; angles [rad], shape (T, J)."""
    model = mujoco_file.newton_s_mujoco().MjModel.from_xml_path(str(folder / FILE))
    return angles_of(model, motion, arm.arm.mechanism.joint_names, arm.arm.sign, arm.arm.zero)


def loading_text(arm: IdentifiedArm) -> str:
    """Return how a user loads the files, and which servo has what."""
    rows = [
        f"| {joint} | {sign:+.0f} | {1e3 * zero:.0f} mrad | {model_text(model)} |"
        for joint, sign, zero, model in zip(
            arm.arm.mechanism.joint_names, arm.arm.sign, arm.arm.zero, arm.models, strict=True
        )
    ]
    return "\n".join([LOADING, "| joint | counts | zero | servo |", "|---|---|---|---|", *rows])


def model_text(model: Model) -> str:
    """Return a servo's causes with their numbers."""
    compliance = model.actuator.values.get("compliance", 0.0)
    told = [f"compliance {compliance:.3g} rad/(N m)"] if compliance else []
    for effect in model.effects:
        units = {p.name: p.unit for p in find_effect(effect.name).parameters}
        numbers = ", ".join(f"{v:.3g} {units[k]}" for k, v in effect.values.items())
        told.append(f"{effect.name} {numbers}")
    return "; ".join(told) or "none"


LOADING = f"""```sh
pip install mujoco
python arm_step.py                                     # some steps and ramps
python arm_step.py commands.csv --out replay.csv       # columns t [s] and theta_d_0, theta_d_1 ...
```

In a program of your own:

```python
{USE}```

`arm.xml` also runs alone, in MuJoCo and mujoco_warp: its controls are what the servos are told. A
servo is then a spring as soft as its compliance with the damping of its lag, and dry friction that
holds it within its deadband. A joint's angle is
that of its servo, turned round where it counts the other way, and the zero. Shapes of the arm
neither weigh nor touch, but for the tip on its floor.
"""

MUJOCO_ARM = ArmTarget(
    write=write_arm,
    ways={
        PROGRAM: ArmWay(coverage=COVERAGE, replay=replay_arm_program, floor=True),
        f"{FILE} alone": ArmWay(coverage=IN_THE_FILE, replay=replay_arm_file, floor=True),
    },
    loading=loading_text,
)
