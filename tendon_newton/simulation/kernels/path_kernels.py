r"""Kernels of a shaft that is led along a measured path: what it takes to hold it there.

    path -> spool -> [string] -> transmission -> joint <- load, spring, damper, weight, inertia
    string -> spool force, tension -> cell

Each name without brackets is a slot for effects. A string of stiffness k carries
T = k (r theta - l(q)), and may push as well: the strings of both directions are one loop. The joint
stays where it is while

.. math:: a\,P(T, -1) + \tau + \tau_f \ge 0 \ge a\,P(T, +1) + \tau - \tau_f

with P what the guides leave of T on the side to which the tendon slides, a the moment arm, tau all
that moves the joint besides, and tau_f the joint's dry friction. Else it slides to where its side
is an equality. The force at the shaft is the string's and what friction takes there. A state's q is
the joint's angle, its v the side z of the shaft's friction (`MeasuredPath`).

Weight, damper and inertia, :math:`-M \ddot q`, are those of a joint that a rigid string would lead:
q follows theta, and its rates are those of the path (`simulation.hosts.measured_motion`).

Validity: strings so stiff that the joint's own swing on them does not show.
Source: Kaneko, Yamashita, Tanie, Basic considerations on transmission characteristics for
tendon-driven robots (1991), with one guide; Featherstone, Rigid Body Dynamics Algorithms (2008),
chapter 5, for the inverse of the equations of motion.
"""

import warp as wp

from tendon_newton.device_code.first_order_lag import share_kept
from tendon_newton.device_code.placeholders import (
    HAS_SLOW_CELL,
    Jet,
    JointVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import (
    cell_effects,
    chain_terms,
    damping_effects,
    offset_effects,
    radius_effects,
    spring_effects,
    string_effects,
    transmission_effects,
)
from tendon_newton.device_code.structs import (
    Cell,
    Commands,
    Drive,
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
from tendon_newton.simulation.dynamics.sensors import INSTANT, cells_are_slow, report
from tendon_newton.simulation.kernels.acting_command import log_of
from tendon_newton.simulation.tendons.states import joint_state, tendon_state
from tendon_newton.simulation.tendons.world_drive import world_drive

# Effects that can act where a path is led
PATH_EFFECTS = (
    "spool_radius_error",
    "position_offset",
    "viscous_friction",
    "coulomb_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "tendon_compliance",
    "routing_friction",
    "joint_stiffness_error",
    "joint_damping_error",
    "inertia_error",
    "spring_stiffening",
    "joint_dry_friction",
    "gravity_misalignment",
    "load_cell_delay",
    "load_cell_lag",
    "load_cell_gain",
    "load_cell_bias",
    "load_cell_drift",
)
RIGID = 1.0e8  # Stiffness [N/m] from which a string does not stretch: 20 N move it by 0.2 um
NEWTON_STEPS = 8  # Steps towards a balance at most; a law with one corner takes three
BALANCED = 1.0e-14  # Change of the joint's angle in such a step [rad] that ends them


@device_template
def string_of(
    mechanism: Mechanism, p: ParameterVector, drive: Drive, angle: real, rate: real, side: real
) -> Tendon:
    """Describe the string on a spool at an angle [rad] that turns [rad/s], sliding to a side."""
    tendon = tendon_state(mechanism, p, drive, 0, side)
    tendon.least_tension = -real(HELD)
    tendon.wound = angle * tendon.spool_radius
    tendon.velocity = rate * tendon.spool_radius
    tendon.angle_rate = Jet(rate, real(0.0), real(0.0))
    return tendon


@device_template
def led(
    mechanism: Mechanism, p: ParameterVector, commands: Commands, row: int, drive: Drive
) -> Drive:
    """Return the drive with its joint where a rigid string has it in a row of the commands."""
    out = drive
    gear = radius_effects(mechanism.spool_radius[drive.world][0], 0, p)
    gear = gear / mechanism.arms[drive.world][0, 0]
    zero = mechanism.excursion_offset[drive.world][0] / mechanism.arms[drive.world][0, 0]
    out.q = JointVector(gear * commands.angle[row][0] - zero)
    out.v = JointVector(gear * commands.rate[row])
    out.acceleration = JointVector(gear * commands.acceleration[row])
    return out


@device_template
def moving_torque(mechanism: Mechanism, p: ParameterVector, here: Drive) -> real:
    """Return what weight, damper and inertia do to the joint [N m] while it is led."""
    terms = chain_terms(mechanism, here)
    joint = joint_state(mechanism, here, 0)
    damper = Jet(-joint.damping * joint.velocity, real(0.0), real(0.0))
    damper = damping_effects(damper, joint, p)
    return terms.torque[0] + damper[0] - terms.mass_matrix[0, 0] * here.acceleration[0]


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
    mechanism: Mechanism, p: ParameterVector, here: Drive, string: Tendon, q: real, load: real
) -> Jet:
    """Return what moves the joint at an angle [N m], sliding to the string's side, and its slope.

    On side 0 there is no friction.
    """
    at = here
    at.q = JointVector(q)
    joint = joint_state(mechanism, at, 0)
    spring = spring_effects(
        Jet(-joint.stiffness * (q - joint.rest), -joint.stiffness, real(0.0)), joint, p
    )
    arm = mechanism.arms[here.world][0, 0]
    tension = tension_at(mechanism, here.world, p, string.wound, q)
    pull = transmission_effects(tension, string, p)
    outside = load - string.side * wp.sign(arm) * here.friction[0]
    return pull * arm + spring + Jet(outside, real(0.0), real(0.0))


@device_template
def balanced(
    mechanism: Mechanism, p: ParameterVector, here: Drive, string: Tendon, q: real, load: real
) -> real:
    """Return the angle [rad] near q at which nothing is left that moves the joint."""
    at = q
    moved = real(1.0)
    for _ in range(NEWTON_STEPS):
        if wp.abs(moved) > real(BALANCED):
            net = net_torque(mechanism, p, here, string, at, load)
            moved = -net[0] / net[1]
            at = at + moved
    return at


@device_template
def followed(
    mechanism: Mechanism, p: ParameterVector, here: Drive, string: Tendon, q: real, load: real
) -> real:
    """Return where the joint [rad] that was at q is once its string is wound as it is."""
    out = q
    way = wp.sign(mechanism.arms[here.world][0, 0])
    for turn in range(2):
        sliding = string
        sliding.side = real(1.0) - real(2.0) * real(turn)
        sliding.direction = sliding.side
        net = net_torque(mechanism, p, here, sliding, q, load)
        if net[0] * way * sliding.side > real(0.0):
            out = balanced(mechanism, p, here, sliding, q, load)
    return out


@device_template
def shaft_force(tension: real, string: Tendon, p: ParameterVector) -> real:
    """Return the force at the shaft [N] that leaves a tension [N] behind the shaft's friction.

    The side that carries the load may be another one in front of the friction than behind it.
    """
    force = tension
    for _ in range(2):
        gear = gear_line(force, string, p)
        force = force + (tension - gear[0]) / gear[1]
    return force


@device_template
def start_kernel(
    first_world: int, mechanism: Mechanism, worlds: Worlds, commands: Commands, states: States
) -> None:
    """Put each joint where it rests without friction in the first row.

    What acts on the shaft then is known only where its friction turns over at once.
    """
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    first = commands.first[worlds.recording[i]]
    p = worlds.parameters[i]
    angle, rate = commands.angle[first][0], commands.rate[first]
    here = world_drive(mechanism, worlds.mechanism[i], p)
    here = led(mechanism, p, commands, first, here)
    string = string_of(mechanism, p, here, angle, rate, real(0.0))
    load = commands.load[first] + moving_torque(mechanism, p, here)
    states.q[i] = JointVector(balanced(mechanism, p, here, string, here.q[0], load))
    states.v[i] = JointVector()
    if p[0] == real(0.0):
        states.v[i] = JointVector(wp.sign(rate))


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
    """Lead each world's shaft through all of its recording, a step a row."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    recording, p = worlds.recording[i], worlds.parameters[i]
    log = log_of(commands, recording, p)
    drive = world_drive(mechanism, worlds.mechanism[i], p)
    q = states.q[i][0]
    side = states.v[i][0]
    slow = wp.static(HAS_SLOW_CELL) and cells_are_slow(p)
    cell = Cell()
    out = rows.out[i]
    before = real(0.0)
    for row in range(log.count):
        here = log.first + row
        now, angle, load = commands.time[here], commands.angle[here][0], commands.load[here]
        rate = commands.rate[here]
        way = rate * (now - before)
        if way != real(0.0):
            to = wp.sign(way)
            side = to + (side - to) * share_kept(to * way, p[0])
        drive = led(mechanism, p, commands, here, drive)
        drive.time = now
        string = string_of(mechanism, p, drive, angle, rate, side)
        moved = load + moving_torque(mechanism, p, drive)
        q = followed(mechanism, p, drive, string, q, moved)
        tension = tension_at(mechanism, drive.world, p, string.wound, q)
        force = shaft_force(tension[0], string, p)
        joint = offset_effects(Jet(q + p[1] * load, real(0.0), real(0.0)), string, p)
        readout.joint_position[out + row] = JointVector(joint[0])
        readout.motor_position[out + row] = TendonVector(angle)
        readout.motor_velocity[out + row] = TendonVector(rate)
        if not slow:
            readout.force[out + row] = TendonVector(cell_effects(force, now, 0, p))
        if wp.static(HAS_SLOW_CELL):
            cell.before = cell.after
            cell.after = TendonVector(force)
            if row == 0:
                cell.force = cell.after
            if slow and row > 0:
                cell = report(commands, log, p, cell, before, now - before, out, readout.force)
            if slow and row + 1 == log.count:
                cell.before = cell.after
                last = real(2.0 * INSTANT)
                cell = report(commands, log, p, cell, now, last, out, readout.force)
        before = now
    states.q[i] = JointVector(q)
    states.v[i] = JointVector(side)
