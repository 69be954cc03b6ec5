"""Where a mechanism comes to rest under its servos, friction left out."""

# Numbers are Python's own here, where the law says `real` and vectors.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportReturnType=false

from __future__ import annotations

from typing import Any

import numpy as np

from tendon_newton.device_code.placeholders import HAS_ROTOR
from tendon_newton.exports.runtime.engine import mujoco
from tendon_newton.exports.runtime.facts import PARAMETERS
from tendon_newton.exports.runtime.servos import ExportedServo, Now
from tendon_newton.law.bristles import BENDING_SWEEPS
from tendon_newton.law.joint import spring_torque
from tendon_newton.law.spool import SETTLED

SETTLING_STEPS = 400  # Most steps towards rest
STRIDE = 0.3  # Longest of them [rad, m]
STILL = 1.0e-11  # A step that is shorter has arrived [rad, m]
GUIDE_STIFFNESS = 1.0e6  # Stiffness [N/m] of the guide that brings a tendon to a measured angle
HALVINGS = 60  # Bisections of a balance between two forces


def balance(excess: Any, low: float, high: float) -> float:
    """Return where a function that falls from above zero to below it is zero."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if excess(middle) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def resting_spool(servo: ExportedServo, now: Now) -> tuple[float, float]:
    """Return the tension [N] of a rotor's string at rest, and by how much its spool leads [m]."""

    def net(lead: float) -> float:
        moved = now._replace(lead=lead)
        return servo.motor_flow(moved).motor_force[0] - servo.loose_tension(moved)

    if not servo.elastic and (servo.numbers["direct"] or net(0.0) >= 0.0):
        return net(0.0), 0.0
    span = 10.0 * servo.radius
    lead = balance(net, -span, span)
    return servo.loose_tension(now._replace(lead=lead)), lead


class Rest:
    """The search for the rest of a hook's model.

    With a target its tendons are held at motor angles [rad] by stiff guides, else by its own
    servos.
    """

    def __init__(self, hook: Any, target: Any = None) -> None:
        self.hook, self.target = hook, target

    def nows(self) -> list[Now]:
        """Return the present of each tendon after everything has come to rest."""
        return [now._replace(elapsed=SETTLED, velocity=0.0) for now in self.hook.now_of(0.0)]

    def torque(self, q: Any) -> Any:
        """Return what moves the joints at a place [N m]."""
        hook = self.hook
        hook.data.qpos[hook.places] = q
        hook.data.qvel[hook.dofs] = 0.0
        mujoco.mj_step1(hook.model, hook.data)
        out = -hook.data.qfrc_bias.copy()
        for joint, place, dof in zip(hook.joints, hook.places, hook.dofs, strict=True):
            joint.position, joint.velocity = float(hook.data.qpos[place]), 0.0
            joint.elapsed = SETTLED
            over = max(joint.position - joint.upper, 0.0) + min(joint.position - joint.lower, 0.0)
            out[dof] += spring_torque(joint, PARAMETERS)[0] - joint.stop_stiffness * over
        for d, (servo, now) in enumerate(zip(hook.servos, self.nows(), strict=True)):
            out += hook.arms()[d] * self.pull(d, servo, now)
        return out[hook.dofs]

    def pull(self, d: int, servo: ExportedServo, now: Now) -> float:
        """Return the pull [N] of a tendon at rest."""
        if self.target is not None and HAS_ROTOR and servo.elastic:
            stretched = now._replace(lead=self.measured_lead(d, servo, now))
            return servo.guided(servo.loose_tension(stretched), now, 0.0)
        if self.target is not None:
            angle = servo.motor_flow(now).angle
            radius = servo.numbers["spool_radius"]
            guide = GUIDE_STIFFNESS * radius * (self.target[d] - angle[0])
            return guide if servo.numbers["direct"] else max(guide, 0.0)
        if HAS_ROTOR:
            return servo.guided(resting_spool(servo, now)[0], now, 0.0)
        return servo.flow(now, 0.0).pull[0]

    def slope(self, q: Any, torque: Any, width: float = 1.0e-7) -> Any:
        """Return how the torques change with the joints [N m/rad]."""
        columns = []
        for j in range(len(q)):
            moved = q.copy()
            moved[j] += width
            columns.append((self.torque(moved) - torque) / width)
        return np.array(columns).T

    def find(self) -> None:
        """Bring the model to rest, and every memory with it."""
        hook = self.hook
        q = np.array([min(max(j.rest, j.lower), j.upper) for j in hook.joints])
        pace = 3.0e-3
        here = self.torque(q)
        for _ in range(SETTLING_STEPS):
            mass = self.mass()
            move = np.linalg.solve(mass / pace**2 - self.slope(q, here), here)
            move *= min(1.0, STRIDE / max(float(np.abs(move).max()), STRIDE))
            there = self.not_through_stops(q, q + move)
            if np.abs(there - q).max() <= STILL and pace > 1.0:
                break
            ahead = self.torque(there)
            work = here @ (there - q)
            if work > 0.0 and ahead @ (there - q) >= -0.5 * work:
                q, pace = there, min(2.0 * pace, 10.0)
                self.relax()
                here = self.torque(q)
            elif np.abs(there - q).max() <= STILL:
                break
            else:
                pace *= 0.4
        self.torque(q)
        self.relax()
        self.bend()

    def bend(self) -> None:
        """Bend the bristles of each tendon as far as it takes to rest there."""
        for d, (servo, now) in enumerate(zip(self.hook.servos, self.nows(), strict=True)):
            if not servo.numbers["bristles"]:
                continue
            asked = hold = self.pull(d, servo, now)
            least, most = (servo.taut_pull(now, side) for side in (1.0, -1.0))
            ends = [servo.renewed(now, side) for side in (1.0, -1.0)]
            for _ in range(BENDING_SWEEPS):
                hold = min(max(hold, least), most)
                share = (hold - least) / (most - least) if most > least else 0.5
                servo.memory = [a + share * (b - a) for a, b in zip(*ends, strict=True)]
                hold += asked - servo.taut_pull(now._replace(elapsed=0.0), 1.0)

    def mass(self) -> Any:
        """Return the mass matrix of the joints [kg m2]."""
        model, data = self.hook.model, self.hook.data
        answer = np.zeros((model.nv, model.nv))
        mujoco.mj_solveM(model, data, answer, np.eye(model.nv))
        return np.linalg.inv(answer)[np.ix_(self.hook.dofs, self.hook.dofs)]

    def not_through_stops(self, q: Any, there: Any) -> Any:
        """Return where a step leads that is cut at the end stops that it would meet."""
        for j, joint in enumerate(self.hook.joints):
            if q[j] <= joint.upper < there[j]:
                there[j] = joint.upper + 1.0e-6
            if q[j] >= joint.lower > there[j]:
                there[j] = joint.lower - 1.0e-6
        return there

    def relax(self) -> None:
        """Let every memory and every spool follow to where the mechanism is."""
        hook = self.hook
        for d, servo in enumerate(hook.servos):
            loose = HAS_ROTOR and not servo.numbers["direct"]
            if loose and self.target is not None:
                lead = self.measured_lead(d, servo, self.nows()[d])
                self.let_out(d, lead if servo.elastic else min(lead, 0.0))
            now = self.nows()[d]
            servo.memory = servo.renewed(now, 0.0)
            if loose and self.target is None:
                self.let_out(d, resting_spool(servo, now)[1])
        for joint in hook.joints:
            hook.renew_strain(joint)

    def measured_lead(self, d: int, servo: ExportedServo, now: Now) -> float:
        """Return how far a spool leads its mechanism [m] where its motor is as was measured."""
        away = float(self.target[d]) - servo.motor_flow(now).angle[0]
        return now.lead + away * servo.radius

    def let_out(self, d: int, lead: float) -> None:
        """Let a rotor's spool lead its mechanism by some string [m]."""
        self.hook.lead[d] = lead
        self.hook.slack[d] = self.hook.servos[d].elastic or lead < 0.0
