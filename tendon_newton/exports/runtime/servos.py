"""From a command to the pull on a tendon, and back to what encoder and load cell report.

The equations are those of the simulation that the model was identified with; the effects' own code
stands below, as it is there.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, NamedTuple

from tendon_newton.exports.runtime.jets import Jet, Piece, clip, renew, staged

HOLDING = 4.0
"""What a motor at its greatest speed holds against, in shares of its greatest force [1]."""
LEAST_ROTOR = 1.0e-8
"""Inertia [kg m2] of the smallest rotor."""
SETTLED = 1.0e9
"""Time [s] after which every internal state has come to rest."""
UNBOUNDED = 1.0e30


class Flow(NamedTuple):
    """What flows along a tendon on one side of its motion."""

    angle: Jet
    """Of the motor [rad]."""
    motor: Jet
    """Force of the motor [N]."""
    tension: Jet
    """At the load cell [N]."""
    pull: Jet
    """On the mechanism [N]."""
    tension_gain: float = 0.0
    """How much of a rotor's inertia the load cell feels [1]."""
    pull_gain: float = 0.0
    """How much of it the mechanism feels [1]."""


class Now(NamedTuple):
    """The instant and the motion at which a flow is asked for."""

    time: float
    command: float
    """Desired angle of the motor [rad]."""
    length: float
    """Excursion l [m]."""
    velocity: float
    """Its rate [m/s]."""
    acceleration: float = 0.0
    """Its acceleration over the last step [m/s2]."""
    elapsed: float = 0.0
    """Time since the memory was true [s]."""
    lead: float = 0.0
    """How far a rotor's spool leads its mechanism [m]."""
    lead_rate: float = 0.0
    carried: float = 0.0
    """What a shaft carries [N m], where it is known."""
    voltage: float = 0.0
    """Supply [V]; zero stands for the model's own."""
    enabled: float = 1.0


class Servo:
    """One motor with its spool, string and load cell.

    Args:
        numbers: What the model says of it.
        stages: Effects of each stage.
        force: The actuator's own function.
        duty: Its functions to a duty cycle and from it; None of one without a duty.
        hold: By how much a force network's force answers to the shaft; None of an equation.
    """

    def __init__(
        self, numbers: Any, stages: dict[str, list[Piece]], force: Any, duty: Any, hold: Any
    ) -> None:
        self.numbers = numbers
        self.stages = stages
        self.force = force
        self.duty = duty
        self.hold = hold
        self.p = list(numbers["actuator"]["values"])
        self.radius = staged(numbers["spool_radius"], stages["radius"])
        self.least = -UNBOUNDED if numbers["direct"] else 0.0
        self.limit = numbers["force_limit"]
        self.holding = HOLDING * self.limit
        self.rotor = numbers["actuator"]["rotor"]
        inertia = max(numbers["actuator"]["armature"], LEAST_ROTOR)
        self.inertia = inertia / self.radius**2 if self.rotor else 0.0
        self.string = staged(UNBOUNDED, stages["string"])
        self.elastic = self.rotor and self.string < UNBOUNDED and not numbers["direct"]
        self.greatest_speed = staged(math.inf, stages["speed"]) * self.radius
        self.dry = numbers["dry"]
        self.memory = [0.0] * numbers["memories"]
        self.held = [0.0, 0.0]

    def clock(self, time: float) -> float:
        """Return the instant [s] whose command acts at a time."""
        return staged(time, self.stages["clock"])

    def tendon_at(self, now: Now, side: float) -> Any:
        """Describe the tendon to the effects; a side of +1 slides in, -1 out, 0 has no friction."""
        velocity = now.velocity + now.lead_rate
        return SimpleNamespace(
            index=0,
            time=now.time,
            elapsed=now.elapsed,
            memory=self.held,
            voltage=now.voltage,
            enabled=now.enabled,
            command=now.command,
            nominal_radius=self.numbers["spool_radius"],
            spool_radius=self.radius,
            length=now.length,
            rate=now.velocity,
            wound=now.length + now.lead,
            velocity=velocity,
            acceleration=now.acceleration,
            side=side,
            direction=min(max(side, -1.0), 1.0),
            inverse_radius=1.0 / self.radius,
            angle_rate=Jet(velocity, 0.0, 1.0) * (1.0 / self.radius),
            force_limit=self.limit,
            least_tension=self.least,
            motor_force=Jet(0.0),
            error=0.0,
            tension=0.0,
            carried=now.carried,
        )

    def motor_flow(self, tendon: Any) -> tuple[Jet, Jet]:
        """Return the motor's angle [rad] and its force [N]."""
        signals = self.motor_signals(tendon)
        return signals[0], signals[-1]

    def motor_signals(self, tendon: Any) -> tuple[Jet, Jet, Jet, Jet]:
        """Return angle [rad], error acted on [rad], duty [1] and force [N] of the motor."""
        stages, memory = self.stages, self.memory
        length = staged(Jet(tendon.wound, 1.0), stages["stretch"], tendon, memory=memory)
        angle = staged(length * tendon.inverse_radius, stages["angle"], tendon)
        error = Jet(tendon.command) - angle
        tendon.error = error[0]
        error = staged(error, stages["error"], tendon, memory=memory)
        duty = Jet(0.0)
        if stages["duty"]:
            duty = staged(self.asked_duty(error, tendon), stages["duty"], tendon, memory=memory)
            force = self.driven(duty, tendon)
        else:
            force = self.force(error, tendon, self.p)
        given = clip(force, -self.limit, self.limit) * tendon.enabled
        return angle, error, duty, staged(given, stages["motor_force"], tendon, memory=memory)

    def asked_duty(self, error: Jet, tendon: Any) -> Jet:
        """Return the share of all it has that the servo asks for [1]."""
        if self.duty is not None:
            return self.duty[0](error, tendon, self.p)
        asked = clip(self.force(error, tendon, self.p), -self.limit, self.limit)
        return asked * (1.0 / self.limit)

    def driven(self, duty: Jet, tendon: Any) -> Jet:
        """Return the force [N] of such a share."""
        if self.duty is not None:
            return self.duty[1](duty, tendon, self.p)
        return duty * self.limit

    def flow(self, now: Now, side: float) -> Flow:
        """Follow the signal from encoder to mechanism while the string moves with it."""
        tendon = self.tendon_at(now, side)
        angle, motor = self.motor_flow(tendon)
        tendon.error = tendon.command - angle[0]
        outrun = side * tendon.direction > 1.5
        stages = self.stages
        if self.rotor:
            probe = motor[0] if now.carried == 0.0 else now.carried
            gear = self.gear_line(probe, tendon)
            value = gear[0] + gear[1] * (motor[0] - probe)
            tension = Jet(value, gear[1] * motor[1], gear[1] * motor[2] + gear[2])
            gain = gear[1]
            if outrun:
                tension, gain = Jet(-self.holding * tendon.direction), 0.0
            pull = staged(tension, stages["transmission"], tendon)
            ahead = staged(tension + Jet(0.0, 1.0), stages["transmission"], tendon)
            return Flow(angle, motor, tension, pull, gain, (ahead[1] - pull[1]) * gain)
        tension = self.after_gear(motor, tendon)
        if outrun:
            tension = Jet(-self.holding * tendon.direction)
        if tension[0] < self.least:
            tension = Jet(self.least)
        return Flow(angle, motor, tension, staged(tension, stages["transmission"], tendon))

    def after_gear(self, force: Jet, tendon: Any) -> Jet:
        """Return what friction leaves of a motor's force [N]."""
        tendon.motor_force = force
        given = self.spool_force(force, tendon)
        return staged(given, self.stages["tension"], tendon, memory=self.memory)

    def spool_force(self, force: Jet, tendon: Any) -> Jet:
        """Return what the spool gives its string of a motor's force [N]."""
        return staged(force, self.stages["spool_force"], tendon, memory=self.memory)

    def gear_line(self, force: float, tendon: Any) -> Jet:
        """Return what gear friction leaves of a force [N], its slope [1], its slope by v."""
        here = self.after_gear(Jet(force), tendon)
        ahead = self.after_gear(Jet(force, 1.0), tendon)
        return Jet(here[0], ahead[1] - here[1], here[2])

    def spool_flow(self, now: Now, side: float) -> tuple[Jet, float, float]:
        """Return angle [rad], net force [N] and tension [N] of a spool that moves on its own."""
        tendon = self.tendon_at(now, side)
        angle, motor = self.motor_flow(tendon)
        tendon.error = tendon.command - angle[0]
        tension = self.string * max(now.lead, 0.0) if self.elastic else 0.0
        gear = self.gear_line(tension, tendon)
        taken = 0.0  # inside a gap nothing is in touch
        if gear[1] > 0.0:
            taken = tension + (tension - gear[0]) / gear[1]
        if side * tendon.direction > 1.5:
            return angle, -self.holding * tendon.direction, tension
        return angle, motor[0] - taken, tension

    def guided(self, tension: float, now: Now, side: float) -> float:
        """Return what guides leave of a tension [N] while the string slides on a side."""
        return staged(Jet(tension), self.stages["transmission"], self.tendon_at(now, side))[0]

    def reported_angle(self, now: Now, side: float, tension: float) -> Jet:
        """Return what the encoder reports [rad]."""
        tendon = self.tendon_at(now, side)
        angle, _ = self.motor_flow(tendon)
        tendon.tension = tension
        return staged(angle, self.stages["encoder"], tendon)

    def asked_angle(self, now: Now, angle: float) -> float:
        """Return the angle [rad] that a force network is shown as asked for."""
        tendon = self.tendon_at(now, 0.0)
        tendon.error = now.command - angle
        acting = staged(Jet(tendon.error), self.stages["error"], tendon)
        return now.command + acting[0] - tendon.error

    def hold_force(self, force: float, now: Now) -> None:
        """Hold a network's force [N] from now on, reckoned from the present motion."""
        self.held[0] = min(max(force, -self.limit), self.limit)
        tendon = self.tendon_at(now, 0.0)
        angle, _ = self.motor_flow(tendon)
        self.held[1] = self.hold(self.p, angle, tendon.angle_rate)[0]

    def renewed(self, now: Now, side: float) -> list[float]:
        """Return what the effects remember after a step that slid on a side."""
        out, stages = list(self.memory), self.stages
        tendon = self.tendon_at(now, side)
        angle, error, duty, motor = self.motor_signals(tendon)
        tendon.error = tendon.command - angle[0]
        tension = self.after_gear(motor, tendon)
        tension = Jet(max(tension[0], self.least), tension[1], tension[2])
        for stage, signal in (
            ("error", error),
            ("duty", duty),
            ("motor_force", motor),
            ("spool_force", self.spool_force(motor, tendon)),
            ("tension", tension),
        ):
            renew(signal, stages[f"remember_{stage}"], tendon, self.memory, out)
        return out
