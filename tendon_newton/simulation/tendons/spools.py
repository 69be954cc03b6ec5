r"""Spools that turn on their own: a rotor, and a string that may stretch or hang loose.

With a rotor, each tendon's spool has a coordinate u of its own: how far it *leads* its mechanism,

.. math:: s = l(q) + u, \qquad F = k\,\max(0, u)

with s the string that is wound in, l the tendon's excursion, F its tension and k its stiffness.
The gear gives the string what friction leaves of the motor's force and the rotor's inertia,
F = f(F_m - a s_ddot) with a = J / r^2, so that

.. math:: a\,\ddot s = F_m - f^{-1}(F), \qquad M \ddot q = \tau + A^T T(F)

with T what the guides leave of the tension. A string that does not stretch (k infinite) holds u at
0 while it pulls. Then M + a A^T (T f)' A is the mass matrix of the mechanism, and the load cell
reads F = f(F_m) - a f' s_ddot. It goes slack where that is negative, and is caught without bounce.

Source: Newton's and Hooke's laws; complementarity as in Brogliato, Nonsmooth Mechanics (2016).
"""

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    LINKS,
    TENDONS,
    Jet,
    JointVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import line_effects, radius_effects
from tendon_newton.device_code.structs import ContactStates, Drive, Forces, Mechanism, Spool
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.bristles import rubbed_guides
from tendon_newton.law.gear import felt_share, passed_share
from tendon_newton.law.servo import on_side, servo_flow
from tendon_newton.law.spool import UNBOUNDED, felt_inertia, spool_balance
from tendon_newton.simulation.tendons.routes import tendon_arms, tendon_bow
from tendon_newton.simulation.tendons.states import tendon_state

SNUG = 1.0e-9  # A string with less slack [m] than this has none
SNUG_RATE = 1.0e-9  # A spool that leads or lags by less [m/s] moves with its mechanism


@device_template
def rotor_inertia(mechanism: Mechanism, world: int, p: ParameterVector, d: int) -> real:
    """Return the inertia of a rotor as felt at its string, J / r^2 [kg]."""
    radius = radius_effects(mechanism.spool_radius[world][d], d, p)
    return felt_inertia(radius, p)


@device_template
def is_string(mechanism: Mechanism, world: int, d: int) -> bool:
    """Tell whether a tendon can only pull; a servo that turns its joint directly pushes too."""
    return mechanism.least_tension[world][d] == real(0.0)


@device_template
def is_rigid(drive: Drive, d: int) -> bool:
    """Tell whether string d does not stretch."""
    return drive.string[d] >= real(UNBOUNDED)


@device_template
def taut_spools(mechanism: Mechanism, here: Drive) -> JointVector:
    """Mark the spools that may be held by strings that do not stretch, shape (J,)."""
    held = JointVector()
    for d in range(TENDONS):
        c = LINKS + d
        snug = here.q[c] >= -real(SNUG) and wp.abs(here.v[c]) <= real(SNUG_RATE)
        if is_rigid(here, d) and (snug or not is_string(mechanism, here.world, d)):
            held[c] = real(1.0)
    return held


@device_template
def string_stiffness(mechanism: Mechanism, here: Drive, d: int) -> real:
    """Return by how much more a string carries as its spool's lead grows [N/m]; 0 where slack."""
    stiffness = here.string[d]
    one_way = is_string(mechanism, here.world, d)
    if is_rigid(here, d) or (one_way and here.q[LINKS + d] <= real(0.0)):
        stiffness = real(0.0)
    return stiffness


@device_template
def spool_at(
    mechanism: Mechanism, p: ParameterVector, here: Drive, d: int, side: real, guide_side: real
) -> Spool:
    """Return the forces at both ends of a string whose spool moves on its own."""
    tendon = tendon_state(mechanism, p, here, d, side)
    flow = servo_flow(tendon, p)
    tendon.error = tendon.command - flow.angle[0]
    stiffness = string_stiffness(mechanism, here, d)
    tension = stiffness * here.q[LINKS + d]
    guided = on_side(tendon, guide_side)
    given = Jet(tension, real(0.0), real(0.0))
    line = line_effects(given, guided, p)
    felt = felt_share(given, line, guided, p)
    out = spool_balance(flow, tendon, p, line, felt * stiffness)
    out.inertia = rotor_inertia(mechanism, here.world, p, d)
    out.pull = rubbed_guides(given, guided, p)
    out.pull_by_lead = passed_share(given, out.pull, guided, p) * stiffness
    return out


@device_template
def with_spool(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    d: int,
    forces: Forces,
) -> Forces:
    """Add what a spool that moves on its own, and its string, do to the coordinates."""
    spool = spool_at(mechanism, p, here, d, contact.row_side[d], contact.row_side[TENDONS + d])
    c = LINKS + d
    arms = tendon_arms(mechanism, here)
    bow = tendon_bow(here)
    row = arms[d]
    whole = arms[d]
    whole[c] = real(1.0)
    out = forces
    mass_matrix = out.mass_matrix
    torque = out.torque
    stiffness = out.stiffness
    damping = out.damping
    pull = out.pull
    driven = contact.row_held[d] == real(0.0)
    guided = contact.row_held[TENDONS + d] == real(0.0)
    pull[d] = contact.hold[TENDONS + d]
    if guided:
        pull[d] = spool.pull[0]
    for i in range(JOINTS):
        torque[i] = torque[i] - whole[i] * spool.inertia * bow[d]
        if driven:
            torque[i] = torque[i] + whole[i] * spool.force[0]
            stiffness[i, c] = stiffness[i, c] + whole[i] * spool.force_by_lead
        if guided:
            torque[i] = torque[i] + row[i] * spool.pull[0]
            stiffness[i, c] = stiffness[i, c] + row[i] * spool.pull_by_lead
        for j in range(JOINTS):
            product = whole[i] * whole[j]
            mass_matrix[i, j] = mass_matrix[i, j] + product * spool.inertia
            if driven:
                stiffness[i, j] = stiffness[i, j] + product * spool.force[1]
                damping[i, j] = damping[i, j] + product * spool.force[2]
            if guided:
                stiffness[i, j] = stiffness[i, j] + row[i] * row[j] * spool.pull[1]
                damping[i, j] = damping[i, j] + row[i] * row[j] * spool.pull[2]
    out.mass_matrix = mass_matrix
    out.torque = torque
    out.stiffness = stiffness
    out.damping = damping
    out.pull = pull
    return out
