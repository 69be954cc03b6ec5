"""Export to plain MuJoCo: an MJCF file that runs alone, and a hook for what MJCF cannot say."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.effects import EFFECTS
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.model_numbers import (
    FURTHER_SENSORS,
    command_span,
    coverage_of,
    nearly,
    not_exact,
    number,
    refuse_damaged,
)
from tendon_newton.exports.mujoco.mjcf_servo import add_servo, replay_file, set_friction
from tendon_newton.exports.mujoco.mujoco_program import USE, program_text, servo_numbers
from tendon_newton.exports.network_export import NETWORK_FILE, exported_network
from tendon_newton.exports.written_program import load_program, rows_of, trajectory_of
from tendon_newton.mechanisms.authoring.correction import correct
from tendon_newton.mechanisms.authoring.mujoco_file import (
    mujoco_spec,
    named_apart,
    newton_s_mujoco,
    write_spec,
)
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import Trajectory

MODEL_FILE = "model.xml"
PROGRAM_FILE = "tendon_step.py"

# What MJCF alone says of each effect
IN_THE_FILE = coverage_of(
    (
        "gain_error",
        "spool_radius_error",
        "joint_stiffness_error",
        "joint_damping_error",
        "joint_dry_friction",
        "inertia_error",
        "gravity_misalignment",
    ),
    (
        "command_delay",
        "force_saturation",
        "position_offset",
        "tendon_slack",
        "viscous_friction",
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
    ),
)
# A rotor in its play meets its edges in the middle of a step, which nothing divides. A servo
# without inertia switches its least duty in every step.
NEARLY = ("backlash", "starting_duty")
# What the program says of each effect
COVERAGE = coverage_of(tuple({*EFFECTS} - {*NEARLY, *FURTHER_SENSORS}), NEARLY)


def write_mujoco_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `model.xml`, `tendon_step.py` and the ONNX file of a force network.

    Raises:
        InvalidModelFile: The model has no force that MuJoCo could apply.
        InvalidOutput: A file cannot be written.
    """
    refuse_damaged(model, "MuJoCo")
    mechanism = named_apart(mechanism)
    network, model = exported_network(folder, model)
    path = folder / MODEL_FILE
    signs, offsets = write_model_file(path, mechanism, model)
    program = folder / PROGRAM_FILE
    text = program_text(
        mechanism,
        model,
        servo_numbers(mechanism, model, signs, offsets),
        title=f"The bench {mechanism.name} with its identified servo, stepped in MuJoCo.",
        span=command_span(mechanism),
        network=network,
    )
    write_text(program, text)
    ways = {PROGRAM_FILE: COVERAGE}
    replays: dict[str, Any] = {PROGRAM_FILE: lambda run: replay_program(folder, run, model)}
    if network is None:
        ways[f"{MODEL_FILE} alone"] = IN_THE_FILE
        placed = list(zip(signs, offsets, strict=True))
        replays[f"{MODEL_FILE} alone"] = lambda run: replay_file(
            path, program, mechanism, model, placed, run
        )
    return Exported(
        files=(path, program, *((folder / NETWORK_FILE,) if network else ())),
        loading=loading_text(learned=network is not None),
        replays=replays,
        left_out={way: not_exact(model, coverage) for way, coverage in ways.items()},
        nearly={way: nearly(model, coverage) for way, coverage in ways.items()},
    )


def write_model_file(
    path: Path, mechanism: Mechanism, model: Model
) -> tuple[list[float], list[float]]:
    """Write the MJCF file; return its tendons' signs, and their excursions at no length [m]."""
    spec = mujoco_spec(mechanism)
    signs, offsets = placed_tendons(mechanism)
    change_mechanism(spec, mechanism, model)
    for tendon, sign, offset in zip(mechanism.tendons, signs, offsets, strict=True):
        add_servo(spec, tendon, model, sign, offset)
    write_spec(path, spec)
    return signs, offsets


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


def change_mechanism(spec: Any, mechanism: Mechanism, model: Model) -> None:
    """Put those effects into the joints and links that MJCF has numbers for."""
    own = replace(mechanism, gravity=np.array(spec.option.gravity))  # with the file's digits
    corrected = correct(own, replace(model, bench_overrides={})).corrected
    heavier = number(model, "inertia_error", "scale")
    spec.option.gravity = corrected.gravity / heavier
    for joint in corrected.joints:
        row = spec.joint(joint.name)
        row.stiffness[0], row.damping[0] = joint.stiffness, joint.damping
        set_friction(row, joint.friction)
        body = row.parent
        body.mass = body.mass * heavier
        body.inertia = body.inertia * heavier


def replay_program(folder: Path, recording: Recording, model: Model) -> Trajectory:
    """Replay a recording with the written program, as its user would."""
    program = load_program(folder / PROGRAM_FILE)
    found = program.replay(program.make(), rows_of(recording, model))
    return trajectory_of(recording, found)


def loading_text(*, learned: bool) -> str:
    """Return how a user loads the files."""
    packages = "mujoco onnxruntime" if learned else "mujoco"
    alone = "" if learned else ALONE
    return f"""```sh
pip install {packages}
python tendon_step.py                     # some steps and ramps
python tendon_step.py commands.csv --out replay.csv   # columns t [s] and theta_d [rad]
```

In a program of your own:

```python
{USE}```
{alone}"""


ALONE = """
`model.xml` also runs alone, in MuJoCo and mujoco_warp: its control is the desired motor angle
[rad]. What it leaves out then stands below.
"""

MUJOCO = ExportTarget(coverage=COVERAGE, write=write_mujoco_target)
