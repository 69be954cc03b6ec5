"""A bench driven by Newton's own actuators alone, read from its prims."""

import math
from pathlib import Path
from typing import Any

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.exports.export_target import Coverage
from tendon_newton.exports.model_numbers import dry_friction, number
from tendon_newton.exports.mujoco.mujoco_target import IN_THE_FILE
from tendon_newton.exports.newton.drive import one_world
from tendon_newton.exports.newton.prims import LONGEST_STEP, gearing_of
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

# What Newton's own prims say of each effect, where a tendon drives one joint
IN_THE_PRIMS: dict[str, Coverage] = {
    **IN_THE_FILE,
    "command_delay": "exact",
    "tendon_slack": "approximate",
    "joint_dry_friction": "approximate",
}


def plain_joints(mechanism: Mechanism, model: Model) -> dict[str, dict[str, float]]:
    """Return what servos add to the joints that they drive: rotor and dry friction."""
    dry, _ = dry_friction(model)
    armature = model.actuator.values.get("armature", 0.0)
    out = {}
    for tendon in mechanism.tendons:
        (j,) = np.flatnonzero(tendon.moment_arm)
        joint = mechanism.joints[j]
        friction = joint.friction + dry * abs(float(tendon.moment_arm[j]))
        if math.isfinite(joint.limits[1]):
            share = number(model, "joint_dry_friction", "fraction")
            friction += share * joint.stiffness * (joint.limits[1] - joint.rest)
        out[joint.prim] = {
            "newton:armature": float(armature) * gearing_of(tendon, model).ratio ** 2,
            "newton:friction": friction,
        }
    return out


def plain_replay(
    path: Path, mechanism: Mechanism, model: Model, rows: dict[str, Any]
) -> dict[str, Array]:
    """Replay commands by the prims alone.

    `rows` has commands, and the joint positions [rad, m] at which it begins.
    """
    bench = PlainBench(path)
    bench.place(rows["joints"])
    columns = [int(np.flatnonzero(t.moment_arm)[0]) for t in mechanism.tendons]
    gears = [gearing_of(tendon, model) for tendon in mechanism.tendons]
    seen = [
        (g.ratio, g.shift, t.moment_arm[j])
        for g, t, j in zip(gears, mechanism.tendons, columns, strict=True)
    ]
    ratio, shift, arms = np.array(seen, dtype=np.float32).T  # as Newton reckons
    out: dict[str, list[Array]] = {"angle": [], "rate": [], "force": [], "joints": []}
    time = np.asarray(rows["t"])
    steps = np.diff(time, append=time[-1] + LONGEST_STEP)
    for command, interval in zip(np.asarray(rows["theta_d"]), steps, strict=True):
        target = np.zeros(len(mechanism.joints), dtype=np.float32)
        target[columns] = [g.target(x) for g, x in zip(gears, np.atleast_1d(command), strict=True)]
        bench.control.joint_target_q.assign(target)
        count = max(1, math.ceil(interval / LONGEST_STEP - 1.0e-6))
        for k in range(count):
            bench.step(interval / count)
            if k == 0:
                joints, rate, effort = bench.before()
                out["angle"].append(ratio * joints[columns] + shift)
                out["rate"].append(ratio * rate[columns])
                out["force"].append(effort[columns] / arms)
                out["joints"].append(joints)
    return {name: np.array(values) for name, values in out.items()}


class PlainBench:
    """A file's bench, stepped by SolverMuJoCo under the file's own actuators."""

    def __init__(self, path: Path) -> None:
        self.model: Any = one_world(path).finalize(device="cpu")
        self.solver: Any = SolverMuJoCo(self.model, disable_contacts=True)
        self.states = [self.model.state(), self.model.state()]
        self.control: Any = self.model.control()
        self.kept = [[a.state(), a.state()] for a in self.model.actuators]
        self.graphs: dict[tuple[int, float], Any] = {}
        self.at, self.dt = 0, LONGEST_STEP

    def place(self, joint_position: Array) -> None:
        """Put the joints somewhere [rad, m], at rest."""
        state = self.states[0]
        state.joint_q.assign(np.asarray(joint_position, dtype=np.float32))
        newton.eval_fk(self.model, state.joint_q, state.joint_qd, state)

    def advance(self) -> None:
        """Step from the present state into the other."""
        here, there = self.at, 1 - self.at
        self.control.joint_f.zero_()
        for actuator, own in zip(self.model.actuators, self.kept, strict=True):
            actuator.step(self.states[here], self.control, own[here], own[there], self.dt)
        self.solver.step(self.states[here], self.states[there], self.control, None, self.dt)

    def step(self, dt: float) -> None:
        """Advance by a step [s]."""
        key = (self.at, round(dt, 12))
        self.dt = dt
        if key not in self.graphs:
            self.advance()  # compiles and allocates before the capture
            with wp.ScopedCapture(device="cpu") as capture:
                self.advance()
            self.graphs[key] = capture.graph
        wp.capture_launch(self.graphs[key])
        self.at = 1 - self.at

    def before(self) -> tuple[Array, Array, Array]:
        """Return joint positions and rates before the last step, and the motors' efforts in it."""
        past, now = self.states[1 - self.at], self.states[self.at]
        rate = past.joint_qd.numpy().copy()
        change = (now.joint_qd.numpy() - rate) / self.dt
        effort = self.control.joint_f.numpy() - self.model.joint_armature.numpy() * change
        return past.joint_q.numpy().copy(), rate, effort
