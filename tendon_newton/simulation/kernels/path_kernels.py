r"""Kernels of a shaft that is led along a measured path against a measured load, without masses.

    path -> spool -> [string] -> transmission -> joint <- load, spring
    string -> spool force, tension -> cell

Each name without brackets is a slot for effects. A string of stiffness k carries
T = k (r theta - l(q)), and may push as well: the strings of both directions are one loop. The joint
stays where it is while

.. math:: a\,P(T, -1) + \tau(q) + \tau_f \ge 0 \ge a\,P(T, +1) + \tau(q) - \tau_f

with P what the guides leave of T on the side to which the tendon slides, a the moment arm, tau load
and spring, and tau_f the joint's dry friction. Else it slides to where its side is an equality. The
force at the shaft is the string's and what friction takes there. A state's q is the joint's angle,
its v the side z of the shaft's friction (`MeasuredPath`).

Validity: motions so slow that masses do not show.
Source: Kaneko, Yamashita, Tanie, Basic considerations on transmission characteristics for
tendon-driven robots (1991), with one guide.
"""

import warp as wp

from tendon_newton.device_code.placeholders import (
    Jet,
    JointVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import (
    cell_effects,
    joint_friction_effects,
    offset_effects,
    radius_effects,
    spring_effects,
    string_effects,
    transmission_effects,
)
from tendon_newton.device_code.structs import (
    Commands,
    Joint,
    Mechanism,
    Readout,
    Rows,
    States,
    Tendon,
    Worlds,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.gear import gear_line
from tendon_newton.law.servo import HELD

# Effects that can act where a path is led
PATH_EFFECTS = (
    "spool_radius_error",
    "position_offset",
    "viscous_friction",
    "coulomb_friction",
    "load_dependent_friction",
    "tendon_compliance",
    "routing_friction",
    "joint_stiffness_error",
    "spring_stiffening",
    "joint_dry_friction",
    "load_cell_gain",
    "load_cell_bias",
)
RIGID = 1.0e8  # Stiffness [N/m] from which a string does not stretch: 20 N move it by 0.2 um
NEWTON_STEPS = 8  # Steps towards a balance at most; a law with one corner takes three
BALANCED = 1.0e-14  # Change of the joint's angle in such a step [rad] that ends them


@device_template
def string_of(
    mechanism: Mechanism, world: int, p: ParameterVector, angle: real, rate: real, side: real
) -> Tendon:
    """Describe the string on a spool at an angle [rad] that turns [rad/s], sliding to a side."""
    tendon = Tendon()
    tendon.least_tension = -real(HELD)
    tendon.nominal_radius = mechanism.spool_radius[world][0]
    tendon.spool_radius = radius_effects(tendon.nominal_radius, 0, p)
    tendon.inverse_radius = real(1.0) / tendon.spool_radius
    tendon.wound = angle * tendon.spool_radius
    tendon.velocity = rate * tendon.spool_radius
    tendon.angle_rate = Jet(rate, real(0.0), real(0.0))
    tendon.enabled = real(1.0)
    tendon.side = side
    tendon.direction = side
    return tendon


@device_template
def joint_at(mechanism: Mechanism, world: int, q: real) -> Joint:
    """Describe the joint at an angle [rad] to the effects."""
    joint = Joint()
    joint.position = q
    joint.stiffness = mechanism.stiffness[world][0]
    joint.rest = mechanism.rest[world][0]
    joint.lower = mechanism.lower[world][0]
    joint.upper = mechanism.upper[world][0]
    return joint


@device_template
def tension_at(mechanism: Mechanism, world: int, p: ParameterVector, wound: real, q: real) -> Jet:
    """Return the string's tension [N] where it is wound [m], with its slope by q [N/rad]."""
    stiffness = wp.min(string_effects(real(RIGID), 0, p), real(RIGID))
    arm = mechanism.arms[world][0, 0]
    length = mechanism.excursion_offset[world][0] + arm * q
    lead = wound - length
    return Jet(stiffness * lead, stiffness * -arm, real(0.0))


@device_template
def net_torque(
    mechanism: Mechanism, world: int, p: ParameterVector, string: Tendon, q: real, load: real
) -> Jet:
    """Return what moves the joint at an angle [N m], sliding to the string's side, and its slope.

    On side 0 there is no friction.
    """
    joint = joint_at(mechanism, world, q)
    spring = spring_effects(
        Jet(-joint.stiffness * (q - joint.rest), -joint.stiffness, real(0.0)), joint, p
    )
    arm = mechanism.arms[world][0, 0]
    pull = transmission_effects(tension_at(mechanism, world, p, string.wound, q), string, p)
    friction = joint_friction_effects(mechanism.friction[world][0], joint, p)
    outside = load - string.side * wp.sign(arm) * friction
    return pull * arm + spring + Jet(outside, real(0.0), real(0.0))


@device_template
def balanced(
    mechanism: Mechanism, world: int, p: ParameterVector, string: Tendon, q: real, load: real
) -> real:
    """Return the angle [rad] near q at which nothing is left that moves the joint."""
    at = q
    moved = real(1.0)
    for _ in range(NEWTON_STEPS):
        if wp.abs(moved) > real(BALANCED):
            net = net_torque(mechanism, world, p, string, at, load)
            moved = -net[0] / net[1]
            at = at + moved
    return at


@device_template
def followed(
    mechanism: Mechanism, world: int, p: ParameterVector, string: Tendon, q: real, load: real
) -> real:
    """Return where the joint [rad] that was at q is once its string is wound as it is."""
    out = q
    way = wp.sign(mechanism.arms[world][0, 0])
    for turn in range(2):
        sliding = string
        sliding.side = real(1.0) - real(2.0) * real(turn)
        sliding.direction = sliding.side
        net = net_torque(mechanism, world, p, sliding, q, load)
        if net[0] * way * sliding.side > real(0.0):
            out = balanced(mechanism, world, p, sliding, q, load)
    return out


@device_template
def shaft_force(tension: real, string: Tendon, p: ParameterVector) -> real:
    """Return the force at the shaft [N] that leaves a tension [N] behind the shaft's friction."""
    gear = gear_line(tension, string, p)
    return tension + (tension - gear[0]) / gear[1]


@device_template
def start_kernel(
    first_world: int, mechanism: Mechanism, worlds: Worlds, commands: Commands, states: States
) -> None:
    """Put each joint where it rests without friction in the first row."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    first = commands.first[worlds.recording[i]]
    world, p = worlds.mechanism[i], worlds.parameters[i]
    angle = commands.angle[first][0]
    string = string_of(mechanism, world, p, angle, real(0.0), real(0.0))
    q = balanced(mechanism, world, p, string, real(0.0), commands.load[first])
    states.q[i] = JointVector(q)
    states.v[i] = JointVector()


@device_template
def path_kernel(
    first_world: int,
    mechanism: Mechanism,
    worlds: Worlds,
    commands: Commands,
    rows: Rows,
    time_step: real,
    states: States,
    readout: Readout,
) -> None:
    """Lead each world's shaft through its recording, a step a row."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    recording, world, p = worlds.recording[i], worlds.mechanism[i], worlds.parameters[i]
    first = commands.first[recording]
    q = states.q[i][0]
    side = states.v[i][0]
    out = rows.out[i]
    before = first + wp.max(rows.begin[recording] - 1, 0)
    for row in range(rows.begin[recording], wp.min(rows.end[recording], commands.count[recording])):
        here = first + row
        now, angle, load = commands.time[here], commands.angle[here][0], commands.load[here]
        way = angle - commands.angle[before][0]
        rate = real(0.0)
        if way != real(0.0):
            rate = way / (now - commands.time[before])
            to = wp.sign(way)
            side = to + (side - to) * wp.exp(to * way / -p[0])
        string = string_of(mechanism, world, p, angle, rate, side)
        q = followed(mechanism, world, p, string, q, load)
        tension = tension_at(mechanism, world, p, string.wound, q)
        force = shaft_force(tension[0], string, p)
        joint = offset_effects(Jet(q + p[1] * load, real(0.0), real(0.0)), string, p)
        readout.joint_position[out + row] = JointVector(joint[0])
        readout.motor_position[out + row] = TendonVector(angle)
        readout.motor_velocity[out + row] = TendonVector(rate)
        readout.force[out + row] = TendonVector(cell_effects(force, now, 0, p))
        before = here
    states.q[i] = JointVector(q)
    states.v[i] = JointVector(side)
