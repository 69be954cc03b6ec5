"""Export to plain MuJoCo: an MJCF file that runs alone, and a hook for what MJCF cannot say."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile, InvalidOutput
from tendon_newton.exports.base import Coverage, Exported, ExportTarget
from tendon_newton.exports.mjcf_servo import (
    FRICTION_SHAPE,
    FRICTION_TIME,
    add_servo,
    number,
    replay_file,
)
from tendon_newton.exports.network_export import NETWORK_FILE, exported_network
from tendon_newton.exports.program import NetworkFacts, program_text, servo_numbers
from tendon_newton.mechanisms.authoring.mujoco_file import (
    mujoco_spec,
    newton_s_mujoco,
    write_spec,
)
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.hosts.timeline import make_timeline
from tendon_newton.simulation.model.parameter_table import ParameterTable, spool_radius_of
from tendon_newton.simulation.model.structure import in_catalogue_order

MODEL_FILE = "model.xml"
PROGRAM_FILE = "tendon_step.py"

IN_THE_FILE: dict[str, Coverage] = {
    **dict.fromkeys(EFFECTS, "none"),
    **dict.fromkeys(
        (
            "gain_error",
            "force_saturation",
            "spool_radius_error",
            "joint_stiffness_error",
            "joint_damping_error",
            "joint_dry_friction",
            "inertia_error",
            "gravity_misalignment",
        ),
        "exact",
    ),
    **dict.fromkeys(
        (
            "command_delay",
            "position_offset",
            "tendon_slack",
            "viscous_friction",
            "coulomb_friction",
            "asymmetric_friction",
            "stribeck_friction",
        ),
        "approximate",
    ),
}
"""What MJCF alone says of each effect; the program beside it says all of them."""


def write_mujoco_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `model.xml`, `tendon_step.py` and the ONNX file of a force network.

    Raises:
        InvalidModelFile: The model has no force that MuJoCo could apply.
        InvalidOutput: A file cannot be written.
    """
    refuse_kinematic(model, "MuJoCo")
    refuse_damaged(model)
    network, model = exported_network(folder, model)
    path = folder / MODEL_FILE
    signs, offsets = write_model_file(path, mechanism, model)
    program = folder / PROGRAM_FILE
    text = program_text(
        mechanism,
        model,
        servo_numbers(mechanism, model, signs, offsets),
        title=f"The bench {mechanism.name} with its identified servo, stepped in MuJoCo.",
        span=command_span(mechanism, model),
        network=network,
    )
    try:
        program.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidOutput(f"{program}: {error.strerror or error}") from error
    alone = () if network is not None else tuple(e.name for e in model.effects)
    left_out = tuple(name for name in alone if IN_THE_FILE[name] != "exact")
    replays: dict[str, Any] = {PROGRAM_FILE: lambda run: replay_program(folder, run)}
    if network is None:
        placed = list(zip(signs, offsets, strict=True))
        replays[f"{MODEL_FILE} alone"] = lambda run: replay_alone(
            path, mechanism, model, placed, run
        )
    return Exported(
        files=(path, program, *((folder / NETWORK_FILE,) if network else ())),
        loading=loading_text(network),
        replays=replays,
        left_out={f"{MODEL_FILE} alone": left_out},
    )


def refuse_kinematic(model: Model, target: str) -> None:
    """Refuse an actuator that has no force."""
    if find_actuator(model.actuator.name).kinematic:
        raise InvalidModelFile(
            f"{target} needs an actuator that gives a force; {model.actuator.name!r} only moves "
            "its shaft"
        )


def refuse_damaged(model: Model) -> None:
    """Refuse a number that is missing or out of range, before anything is written."""
    names = in_catalogue_order(tuple(effect.name for effect in model.effects))
    table = ParameterTable(actuator=model.actuator.name, effects=names)
    if not find_actuator(model.actuator.name).held:  # a network's card fills in what is missing
        table.vector(model)
    spool_radius_of(model)


def write_model_file(
    path: Path, mechanism: Mechanism, model: Model
) -> tuple[list[float], list[float]]:
    """Write the MJCF file; return its tendons' signs, and their excursions at no length [m]."""
    mujoco = newton_s_mujoco()
    spec = mujoco_spec(mechanism)
    compiled = spec.compile()
    state = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, state)
    signs, offsets = [], []
    for tendon in mechanism.tendons:
        sign = 1.0 if tendon.route is None else -1.0
        length = float(state.ten_length[compiled.tendon(tendon.name).id])
        signs.append(sign)
        offsets.append(tendon.excursion_offset - sign * length)
    change_mechanism(spec, mechanism, model)
    for tendon, sign, offset in zip(mechanism.tendons, signs, offsets, strict=True):
        add_servo(spec, tendon, model, sign, offset)
    write_spec(path, spec)
    return signs, offsets


def change_mechanism(spec: Any, mechanism: Mechanism, model: Model) -> None:
    """Put those effects into the joints and links that MJCF has numbers for."""
    heavier = number(model, "inertia_error", "scale")
    tilt = number(model, "gravity_misalignment", "angle")
    gravity = np.array(spec.option.gravity)
    spec.option.gravity = (
        np.array(
            [
                gravity[0] * math.cos(tilt) - gravity[2] * math.sin(tilt),
                gravity[1],
                gravity[0] * math.sin(tilt) + gravity[2] * math.cos(tilt),
            ]
        )
        / heavier
    )
    for joint in mechanism.joints:
        row = spec.joint(joint.name)
        row.stiffness[0] = joint.stiffness * number(model, "joint_stiffness_error", "scale")
        row.damping[0] = joint.damping * number(model, "joint_damping_error", "scale")
        dry = joint.friction
        if math.isfinite(joint.limits[1]):
            share = number(model, "joint_dry_friction", "fraction")
            dry += share * joint.stiffness * (joint.limits[1] - joint.rest)
        row.frictionloss = dry
        row.solimp_friction = FRICTION_SHAPE
        row.solref_friction = (FRICTION_TIME, 1.0)
        body = row.parent
        body.mass = body.mass * heavier
        body.inertia = body.inertia * heavier


def command_span(mechanism: Mechanism, model: Model) -> tuple[float, float]:
    """Return motor angles [rad] between which a bench moves without leaning on its stops."""
    tendon = mechanism.tendons[0]
    if not all(math.isfinite(joint.limits[1]) for joint in mechanism.joints):
        return (-0.5, 0.5)
    upper = np.array([joint.limits[1] for joint in mechanism.joints])
    reach = float(np.abs(tendon.moment_arm) @ upper)
    return (0.0, 1.5 * reach / tendon.spool_radius)


def replay_program(folder: Path, recording: Recording) -> Trajectory:
    """Replay a recording with the written program, as its user would."""
    program = load_program(folder / PROGRAM_FILE)
    mujoco = newton_s_mujoco()
    mj_model = mujoco.MjModel.from_xml_path(str(folder / MODEL_FILE))
    hook = program.make_hook(mj_model, mujoco.MjData(mj_model))
    return trajectory_of(recording, program.replay(hook, rows_of(recording)))


def replay_alone(
    path: Path,
    mechanism: Mechanism,
    model: Model,
    placed: list[tuple[float, float]],
    recording: Recording,
) -> Trajectory:
    """Replay a recording by the MJCF file alone, from where the program would start."""
    program = load_program(path.parent / PROGRAM_FILE)
    mujoco = newton_s_mujoco()
    mj_model = mujoco.MjModel.from_xml_path(str(path))
    hook = program.make_hook(mj_model, mujoco.MjData(mj_model))
    rows = rows_of(recording)
    hook.reset(rows["theta_d"][0], *rows.get("start", (None, None)))
    start = hook.data.qpos[hook.places].copy()
    return replay_file(path, mechanism, model, placed, recording, start)


def load_program(path: Path) -> Any:
    """Return the written program as a module."""
    spec: Any = importlib.util.spec_from_file_location("tendon_step", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rows_of(recording: Recording) -> dict[str, Any]:
    """Return what a program needs of a recording."""
    timeline = make_timeline(recording)
    rows: dict[str, Any] = {
        "t": timeline.time,
        "theta_d": timeline.command,
        "measured": timeline.measured,
        "enabled": np.interp(timeline.time, recording.time, recording.enabled) > 0.5,
    }
    if recording.voltage is not None:
        rows["voltage"] = np.interp(timeline.time, recording.time, recording.voltage)
    if recording.start == "first_row":
        rows["start"] = (recording.motor_position[0], recording.motor_velocity[0])
    return rows


def trajectory_of(recording: Recording, result: dict[str, Any]) -> Trajectory:
    """Return what a program reported, in the recording's own rows."""
    rows = make_timeline(recording).measured
    return Trajectory(
        time=recording.time,
        motor_position=result["theta"][rows],
        motor_velocity=result["theta_dot"][rows],
        force=result["force"][rows],
        joint_position=result["joints"][rows],
    )


def loading_text(network: NetworkFacts | None) -> str:
    """Return how a user loads the files."""
    packages = "mujoco" if network is None else "mujoco onnxruntime"
    alone = "" if network is not None else ALONE
    return f"""```sh
pip install {packages}
python tendon_step.py                     # some steps and ramps
python tendon_step.py commands.csv --out replay.csv   # columns t [s] and theta_d [rad]
```

In a program of your own:

```python
import mujoco, tendon_step

model = mujoco.MjModel.from_xml_path("model.xml")
model.opt.timestep = 1.0e-4
hook = tendon_step.make_hook(model, mujoco.MjData(model))
hook.reset([0.5])      # desired motor angle [rad], one per tendon
hook.command[:] = 1.0
hook.step()            # in place of mujoco.mj_step
print(hook.read())     # angle [rad], speed [rad/s], force [N]
```
{alone}"""


ALONE = """
`model.xml` also runs alone, in MuJoCo and mujoco_warp: its control is the desired motor angle
[rad]. What it leaves out then stands below.
"""

MUJOCO = ExportTarget(
    summary="MJCF, and a Python file that steps it with what MJCF cannot say",
    coverage=dict.fromkeys(EFFECTS, "exact"),
    write=write_mujoco_target,
)
