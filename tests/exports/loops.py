"""Loops of a user's own around exported files, as the page beside them says; no replay of ours.

Each holds a command until the next one, and gives the motor angles [rad] in every row.
"""

# The stubs of mujoco leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import contextlib
import io
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import newton
import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.exports import EXPORTS, model_numbers
from tendon_newton.exports.departure import departure, sines
from tendon_newton.exports.mujoco.mjcf_spool import spool_name
from tendon_newton.exports.written_program import load_program
from tendon_newton.mechanisms.authoring.mujoco_file import named_apart
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.simulation.hosts.replay import bench_of, replay
from tendon_newton.simulation.model.parameter_table import spool_radius_of

Loop = Callable[[Path, Mechanism, Model, Recording, Array], Array]
"""Folder, bench, model, commands, and joint positions at rest under the first -> angles (T, D)."""
STEP = 1.0e-4  # [s] that the pages name
REST = 2.0  # [s] in which a bench comes to rest under its first command


def mujoco_file(
    folder: Path, mechanism: Mechanism, model: Model, run: Recording, start: Array
) -> Array:
    """Step `model.xml` as MuJoCo does."""
    file = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    data, rows = mujoco.MjData(file), []
    spools = [
        mujoco.mj_name2id(file, mujoco.mjtObj.mjOBJ_JOINT, spool_name(t.name))
        for t in mechanism.tendons
    ]
    drives = [file.actuator(tendon.name).id for tendon in mechanism.tendons]
    places = [file.joint(joint.name).qposadr[0] for joint in mechanism.joints]
    data.ctrl[drives], data.qpos[places] = run.command[0], start
    for tendon, spool in zip(mechanism.tendons, spools, strict=True):
        if spool >= 0:
            data.qpos[file.jnt_qposadr[spool]] = float(excursion(tendon, start))
    mujoco.mj_step(file, data, nstep=round(REST / file.opt.timestep))
    data.time = 0.0
    for time, command in zip(run.time, run.command, strict=True):
        mujoco.mj_step(file, data, nstep=max(round((time - data.time) / file.opt.timestep), 0))
        rows.append([
            float(excursion(tendon, data.qpos[places]) if spool < 0
                  else data.qpos[file.jnt_qposadr[spool]])
            / model_numbers.spool_of(tendon, model)
            for tendon, spool in zip(mechanism.tendons, spools, strict=True)
        ])  # fmt: skip
        data.ctrl[drives] = command
    return np.array(rows)


def tendon_step(
    folder: Path, mechanism: Mechanism, model: Model, run: Recording, start: Array
) -> Array:
    """Step MuJoCo with the hook of `tendon_step.py`."""
    program = load_program(folder / "tendon_step.py")
    file = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    file.opt.timestep = STEP
    hook = program.make_hook(file, mujoco.MjData(file))
    hook.reset(run.command[0])
    rows, taken = [], 0
    for time, command in zip(run.time - run.time[0], run.command, strict=True):
        while taken < round(time / STEP):
            hook.step()
            taken += 1
        rows.append(np.array(hook.read().angle))
        hook.command[:] = command
    return np.array(rows)


def newton_drive(
    folder: Path, mechanism: Mechanism, model: Model, run: Recording, start: Array
) -> Array:
    """Step `bench_drive.usda` with the drive of `tendon_drive.py`, of which the reader is told."""
    load_program(folder / "tendon_drive.py").register()
    return newton_loop(folder / "bench_drive.usda", mechanism, model, run, start, run.command)


def newton_loop(
    path: Path, mechanism: Mechanism, model: Model, run: Recording, start: Array, aims: Array
) -> Array:
    """Step a bench of USD by Newton's solver, with what its file says of actuators.

    `aims` (T, D) is written to each joint that a tendon drives.
    """
    builder = newton.ModelBuilder()
    SolverMuJoCo.register_custom_attributes(builder)
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a chain of one link, which is no articulation
        builder.add_usd(str(path))
        built: Any = builder.finalize(device="cpu")
        solver = SolverMuJoCo(built, disable_contacts=True, use_mujoco_cpu=True)
    states: list[Any] = [built.state(), built.state()]
    kept = [[a.state(), a.state()] for a in built.actuators]
    control: Any = built.control()
    states[0].joint_q.assign(start.astype(np.float32))
    newton.eval_fk(built, states[0].joint_q, states[0].joint_qd, states[0])
    arms = np.array([tendon.moment_arm for tendon in mechanism.tendons])
    drives = np.argmax(arms != 0.0, axis=0)  # the tendon of each joint
    (actuator,), (own,) = built.actuators, kept
    slots = [int(np.argmax(actuator.drive.tendon_of.numpy() == d)) for d in range(len(arms))]
    control.joint_target_q.assign(aims[0, drives].astype(np.float32))
    rows, taken, here = [], 0, 0
    with wp.ScopedDevice("cpu"):
        for time, aim in zip(run.time - run.time[0], aims, strict=True):
            while taken < round(time / STEP):
                control.joint_f.zero_()
                actuator.step(states[here], control, own[here], own[1 - here], STEP)
                solver.step(states[here], states[1 - here], control, None, STEP)
                here, taken = 1 - here, taken + 1
            # a loose string does not tell where its motor is
            actuator.step(states[here], control, own[here], own[1 - here], STEP)
            rows.append(actuator.drive.report.numpy()["angle"][slots])
            control.joint_target_q.assign(aim[drives].astype(np.float32))
    return np.array(rows)


LOOPS: Mapping[tuple[str, str], Loop] = {
    ("mujoco", "model.xml alone"): mujoco_file,
    ("mujoco", "tendon_step.py"): tendon_step,
    ("newton", "tendon_drive.py"): newton_drive,
}
"""Program and way of running its files -> the user's loop."""


WAVES = ("0.5 Hz", "2 Hz", "8 Hz")
SHARE, LEAST = 0.1, 1.0e-4  # A told error is true within a tenth, or 0.1 mrad


@dataclass(frozen=True, kw_only=True)
class Told:
    """What a page tells of one sine, and what a user's loop finds [rad]."""

    wave: str
    told: float
    found: float

    @property
    def true(self) -> bool:
        """Whether both agree."""
        return abs(self.told - self.found) <= max(SHARE * self.told, LEAST)

    @property
    def text(self) -> str:
        """Say both [mrad]."""
        return f"{1e3 * self.told:.2f}|{1e3 * self.found:.2f}{'' if self.true else ' NOT TRUE'}"


def told_and_found(
    folder: Path, target: str, bench: str, model: Model, waves: Sequence[str] = WAVES
) -> Iterator[tuple[str, list[Told]]]:
    """Yield each way of running a target's files, with its sines.

    Raises:
        TendonNewtonError: The target cannot hold the bench or the servo.
    """
    mechanism = named_apart(bench_of(bench, model))
    exported = EXPORTS[target].write(folder, mechanism, model)
    runs = [sines(mechanism, spool_radius_of(model))[name] for name in waves]
    own = replay(runs, model)
    for way, replayed in exported.replays.items():
        out = []
        for name, run, ours in zip(waves, runs, own, strict=True):
            told = departure(mechanism, [replayed(run)], [ours]).angle
            angle = LOOPS[target, way](folder, mechanism, model, run, ours.joint_position[0])
            out.append(Told(wave=name, told=told, found=rms(angle - ours.motor_position)))
        yield way, out
