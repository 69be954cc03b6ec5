"""Export to Newton: the bench in USD with actuator prims, and a drive for what prims cannot say."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from textwrap import indent
from typing import Any

import numpy as np

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports import model_numbers
from tendon_newton.exports.bench_file import write_bench
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.linking import Linker
from tendon_newton.exports.model_law import ModelLaw
from tendon_newton.exports.network_export import NETWORK_FILE, exported_network
from tendon_newton.exports.newton import drive, drive_types
from tendon_newton.exports.newton.drive_numbers import (
    drive_numbers,
    longest_step,
    own_joints,
    path_of,
)
from tendon_newton.exports.newton.prims import write_actuators
from tendon_newton.exports.runtime import networks, rows
from tendon_newton.exports.written_program import load_program, rows_of, trajectory_of
from tendon_newton.mechanisms.authoring.correction import Correction, correct
from tendon_newton.mechanisms.authoring.mujoco_file import named_apart
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import moment_arms
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.model.parameter_table import spool_radius_of

# Modules of the program, in the order in which they are joined
MODULES = (drive_types, networks, drive, rows)
USE = """import newton, tendon_drive

tendon_drive.register()                     # lets add_usd know the drive
builder = newton.ModelBuilder()
newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
builder.add_usd("bench_drive.usda")
model = builder.finalize()                  # model.actuators has the drive
"""

DOCSTRING = (
    """An identified tendon servo as a drive for Newton's actuators.

Made by tendon-newton export. It needs newton 1.8 with MuJoCo and USD. The file `bench_drive.usda`
names the drive:

"""
    + indent(USE, "    ")
    + """
Write the desired motor angle [rad] of a tendon into `control.joint_target_q` of each joint that the
tendon drives. Each joint has one slot of the drive; slots of one tendon reckon the same force. In a
loop of your own:

    bench = tendon_drive.Simulation(worlds=4096)
    bench.reset([0.5])                            # desired motor angles [rad], one per tendon
    bench.command([1.0])
    bench.step(100)                               # of TIME_STEP
    print(bench.read())                           # angle [rad], speed [rad/s], force [N]

or: python tendon_drive.py commands.csv --out replay.csv     (columns t [s] and theta_d [rad])
"""
)


def loading_text(*, network: bool, stray: float) -> str:
    """Return how a user loads the files.

    A tendon's way in the drive strays from the bench's by `stray` [m] at most.
    """
    packages = '"newton[sim,importers]==1.8.*"' + (" onnxruntime" if network else "")
    return f"""```sh
pip install {packages}
python tendon_drive.py commands.csv --out replay.csv   # columns t [s] and theta_d [rad]
```

In a program of your own:

```python
{USE}```

Write a tendon's desired motor angle [rad] into `control.joint_target_q` of each joint that the
tendon drives, then call `model.actuators[0].step` and the solver with steps of 0.1 ms or less.
`model.actuators[0].drive.report` has the motor's `angle` [rad]: joints do not tell it of a loose
string.
`tendon_drive.Simulation(worlds)` does all that for many worlds.
{ROUTED.format(1e6 * stray) if stray else ""}"""


ROUTED = """
The drive has the way of a routed tendon as a polynomial of the joints, which strays by {:.1f} um at
most inside the joints' range.
"""

BENCH_FILE, DRIVE_FILE = "bench.usda", "bench_drive.usda"
PROGRAM_FILE = "tendon_drive.py"
SENSORS = (
    "load_cell_delay",
    "load_cell_lag",
    "load_cell_gain",
    "load_cell_bias",
    "load_cell_drift",
    *model_numbers.FURTHER_SENSORS,
)
# A rotor in its play meets its edges in the middle of a step, which nothing divides
NEARLY = ("backlash",)
# What the drive says of each effect; nobody has a load cell or an encoder on a joint
COVERAGE = model_numbers.coverage_of(tuple({*EFFECTS} - {*NEARLY, *SENSORS}), NEARLY)


def write_newton_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write the bench, its actuator prims, and the drive.

    Raises:
        InvalidAsset: Two joints or tendons would have the same name.
        InvalidModelFile: Newton cannot hold the bench or its servo.
        InvalidOutput: A file cannot be written.
    """
    model_numbers.refuse_damaged(model, "Newton")
    refuse_shared_joints(mechanism)
    mechanism.refuse_moving_obstacle("a bench for Newton's drive")
    mechanism = named_apart(mechanism)
    correction = corrected_bench(mechanism, model)
    network, held = exported_network(folder, model)
    write_bench(folder / BENCH_FILE, correction, model)
    step = longest_step(correction.corrected, held)
    joints = own_joints(mechanism, model)
    write_actuators(folder / DRIVE_FILE, folder / BENCH_FILE, mechanism, joints)
    paths = [path_of(mechanism, tendon) for tendon in mechanism.tendons]
    law, facts = drive_numbers(mechanism, correction.corrected, held, paths, network, step)
    write_text(folder / PROGRAM_FILE, drive_text(law, facts))
    files = [folder / name for name in (BENCH_FILE, DRIVE_FILE, PROGRAM_FILE)]
    if network is not None:
        files.append(folder / NETWORK_FILE)
    return Exported(
        files=tuple(files),
        loading=loading_text(network=network is not None, stray=max(path.stray for path in paths)),
        replays={PROGRAM_FILE: lambda run: replay_drive(folder, mechanism, model, run)},
        left_out={PROGRAM_FILE: model_numbers.not_exact(model, COVERAGE)},
        nearly={PROGRAM_FILE: model_numbers.nearly(model, COVERAGE)},
    )


def refuse_shared_joints(mechanism: Mechanism) -> None:
    """Refuse a bench with a joint that no tendon drives, or several."""
    arms = np.array([tendon.moment_arm for tendon in mechanism.tendons])
    for joint, count in zip(mechanism.joints, np.count_nonzero(arms, axis=0), strict=True):
        if count != 1:
            raise InvalidModelFile(
                f"Newton's actuators have one command per joint, so that one tendon must drive "
                f"joint {joint.name!r} of {mechanism.name!r}; it has {count}"
            )


def corrected_bench(mechanism: Mechanism, model: Model) -> Correction:
    """Return a bench with what USD has numbers for, links that only resist more included."""
    correction = correct(mechanism, replace(model, bench_overrides={}))
    heavier = model_numbers.number(model, "inertia_error", "scale")
    plain = correction.corrected
    corrected = replace(
        plain,
        joints=tuple(
            replace(j, mass=j.mass * heavier, inertia=j.inertia * heavier) for j in plain.joints
        ),
        gravity=plain.gravity / heavier,
    )
    return replace(correction, asset=load_mechanism(mechanism.asset), corrected=corrected)


def replay_drive(
    folder: Path, mechanism: Mechanism, model: Model, recording: Recording
) -> Trajectory:
    """Replay a recording with the written drive, from where our own simulation begins."""
    program = load_program(folder / PROGRAM_FILE)
    rows = started_rows(mechanism, model, recording)
    found = program.replay(program.Simulation(device="cpu"), rows)
    return trajectory_of(recording, found)


def started_rows(mechanism: Mechanism, model: Model, recording: Recording) -> dict[str, Any]:
    """Return what a program needs of a recording, with where it begins."""
    rows = rows_of(recording, model)
    rows["joints"] = replay([recording], model)[0].joint_position[0]
    if "start" in rows:
        _, rate = rows.pop("start")
        rates = np.zeros(len(mechanism.joints))
        for tendon, speed in zip(mechanism.tendons, rate, strict=True):
            arm = moment_arms(tendon, rows["joints"])
            radius = spool_radius_of(model) or tendon.spool_radius
            rates += arm * (speed * radius / (arm @ arm))
        rows["rates"] = rates
    return rows


NEWTON = ExportTarget(coverage=COVERAGE, write=write_newton_target)


def drive_text(law: ModelLaw, known: Mapping[str, Any]) -> str:
    """Return the Python file of a drive that knows some facts."""
    return Linker(law, device=True).program(DOCSTRING, known, MODULES, last="run(Simulation)")
