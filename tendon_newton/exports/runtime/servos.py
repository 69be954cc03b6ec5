"""From a command to the pull on a tendon, and back to what encoder and load cell report."""

# Numbers are Python's own here, where the law says `real` and vectors.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportReturnType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

from tendon_newton.actuators.learned import hold_answer
from tendon_newton.device_code.placeholders import HAS_ROTOR, HELD_MEMORY, Jet
from tendon_newton.device_code.slots import (
    clock_effects,
    encoder_effects,
    error_effects,
    line_effects,
    radius_effects,
    speed_effects,
    string_effects,
)
from tendon_newton.device_code.structs import Flow, Tendon
from tendon_newton.exports.runtime.facts import MEMORY_SIZE, PARAMETERS
from tendon_newton.law.bristles import rubbed_guides
from tendon_newton.law.servo import servo_flow
from tendon_newton.law.spool import UNBOUNDED, felt_inertia, spool_balance
from tendon_newton.law.string import TAUT, renewed_memory, tendon_flow


class Now(NamedTuple):
    """The instant and the motion at which a flow is asked for."""

    time: float
    command: float  # Desired angle of the motor [rad]
    length: float  # Excursion l [m]
    velocity: float  # Rate of the excursion [m/s]
    acceleration: float = 0.0  # Acceleration of the excursion over the last step [m/s2]
    elapsed: float = 0.0  # Time since the memory was true [s]
    lead: float = 0.0  # How far a rotor's spool leads its mechanism [m]
    lead_rate: float = 0.0
    carried: float = 0.0  # What a shaft carries [N m], where it is known
    voltage: float = 0.0  # Supply [V]; zero stands for the model's own
    enabled: float = 1.0


class ExportedServo:
    """One motor with its spool, string and load cell."""

    def __init__(self, numbers: Any) -> None:
        self.numbers = numbers
        self.radius = radius_effects(numbers["spool_radius"], 0, PARAMETERS)
        self.least = -UNBOUNDED if numbers["direct"] else 0.0
        self.limit = numbers["force_limit"]
        self.inertia = felt_inertia(self.radius, PARAMETERS) if HAS_ROTOR else 0.0
        self.string = string_effects(UNBOUNDED, 0, PARAMETERS)
        self.elastic = HAS_ROTOR and self.string < UNBOUNDED and not numbers["direct"]
        self.greatest_speed = speed_effects(math.inf, 0, PARAMETERS) * self.radius
        self.dry = numbers["dry"]
        self.memory = [0.0] * MEMORY_SIZE

    def clock(self, time: float) -> float:
        """Return the instant [s] whose command acts at a time."""
        return clock_effects(time, 0, PARAMETERS)

    def tendon_at(self, now: Now, side: float) -> Tendon:
        """Describe the tendon to the law; a side of +1 slides in, -1 out, 0 has no friction."""
        tendon = Tendon()
        tendon.time = now.time
        tendon.elapsed = now.elapsed
        tendon.memory = self.memory
        tendon.voltage = now.voltage
        tendon.enabled = now.enabled
        tendon.carried = now.carried
        tendon.force_limit = self.limit
        tendon.least_tension = self.least
        tendon.command = now.command
        tendon.nominal_radius = self.numbers["spool_radius"]
        tendon.spool_radius = self.radius
        tendon.inverse_radius = 1.0 / self.radius
        tendon.length = now.length
        tendon.string = self.string if self.elastic and now.lead > 0.0 else 0.0
        tendon.rate = now.velocity
        tendon.wound = now.length + now.lead
        tendon.velocity = now.velocity + now.lead_rate
        tendon.acceleration = now.acceleration
        tendon.side = side
        tendon.direction = min(max(side, -1.0), 1.0)
        tendon.angle_rate = Jet(tendon.velocity, 0.0, 1.0) * tendon.inverse_radius
        return tendon

    def motor_flow(self, now: Now) -> Flow:
        """Follow the signal from the encoder to the motor's force, friction left out."""
        return servo_flow(self.tendon_at(now, 0.0), PARAMETERS)

    def flow(self, now: Now, side: float) -> Flow:
        """Follow the signal from encoder to mechanism while the string moves with it."""
        return tendon_flow(self.tendon_at(now, side), PARAMETERS)

    def taut_pull(self, now: Now, side: float) -> float:
        """Return what such a string pulls with [N], be it below zero."""
        tendon = self.tendon_at(now, side)
        tendon.slack = TAUT
        return tendon_flow(tendon, PARAMETERS).pull[0]

    def loose_tension(self, now: Now) -> float:
        """Return the tension [N] of a string whose spool moves on its own."""
        return self.string * max(now.lead, 0.0) if self.elastic else 0.0

    def felt_tension(self, now: Now) -> float:
        """Return what such a string carries at its load cell [N]: a guide may hold the rest."""
        given = Jet(self.loose_tension(now), 0.0, 0.0)
        return line_effects(given, self.tendon_at(now, 1.0), PARAMETERS)[0]

    def spool_force(self, now: Now, side: float) -> float:
        """Return what accelerates a spool that moves on its own [N]."""
        tendon = self.tendon_at(now, side)
        flow = servo_flow(tendon, PARAMETERS)
        tendon.error = tendon.command - flow.angle[0]
        tension = Jet(self.felt_tension(now), 0.0, 0.0)
        return spool_balance(flow, tendon, PARAMETERS, tension, 0.0).force[0]

    def guided(self, tension: float, now: Now, side: float) -> float:
        """Return what guides leave of a tension [N] while the string slides on a side."""
        tendon = self.tendon_at(now, side)
        return rubbed_guides(Jet(tension, 0.0, 0.0), tendon, PARAMETERS)[0]

    def reported_angle(self, now: Now, side: float, tension: float) -> Jet:
        """Return what the encoder reports [rad]."""
        tendon = self.tendon_at(now, side)
        angle = servo_flow(tendon, PARAMETERS).angle
        tendon.tension = tension
        return encoder_effects(angle, tendon, PARAMETERS)

    def asked_angle(self, now: Now, angle: float) -> float:
        """Return the angle [rad] that a force network is shown as asked for."""
        tendon = self.tendon_at(now, 0.0)
        tendon.error = now.command - angle
        acting = error_effects(Jet(tendon.error, 0.0, 0.0), tendon, PARAMETERS)
        return now.command + acting[0] - tendon.error

    def hold_force(self, force: float, now: Now) -> None:
        """Hold a network's force [N] from now on, reckoned from the present motion."""
        tendon = self.tendon_at(now, 0.0)
        angle = servo_flow(tendon, PARAMETERS).angle
        self.memory[HELD_MEMORY] = min(max(force, -self.limit), self.limit)
        self.memory[HELD_MEMORY + 1] = hold_answer(PARAMETERS, angle, tendon.angle_rate)[0]

    def renewed(self, now: Now, side: float) -> list[float]:
        """Return what the effects remember after a step that slid on a side."""
        return renewed_memory(self.tendon_at(now, side), PARAMETERS, self.memory)
