"""The tension that a load cell between spool and mechanism feels."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_ROTOR,
    LINKS,
    TENDONS,
    Jet,
    JointVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import line_effects
from tendon_newton.device_code.structs import ContactStates, Drive, Flow, Forces, Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.tendons.routes import tendon_arms, tendon_bow
from tendon_newton.simulation.tendons.spools import rotor_inertia, string_stiffness
from tendon_newton.simulation.tendons.states import excursion, flow_at, tendon_state


@device_template
def held_share(
    mechanism: Mechanism, p: ParameterVector, here: Drive, contact: ContactStates, d: int
) -> real:
    """Return where between its two sides a held tendon is: 0 at the least pull, 1 at the most."""
    least = flow_at(mechanism, p, here, d, contact.least_side[d])
    most = flow_at(mechanism, p, here, d, contact.most_side[d])
    return share_between(least, most, contact.hold[d])


@device_template
def share_between(least: Flow, most: Flow, pull: real) -> real:
    """Return where a pull [N] is between those of two flows [1]; a half where they are one."""
    share = real(0.5)
    if most.pull[0] > least.pull[0]:
        share = (pull - least.pull[0]) / (most.pull[0] - least.pull[0])
    return share


@device_template
def tension_now(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    d: int,
    forces: Forces,
    acceleration: JointVector,
) -> real:
    """Return the tension at the load cell [N]: what gear and rotor leave of the motor's force.

    Where the tendon is held it is what holds it; where its spool moves on its own, what the string
    carries. A negative one says that the string cannot be taut. Accelerations of the coordinates
    [rad/s2, m/s2] count for a rotor alone.
    """
    tension = real(0.0)
    moves = bool(False)
    if wp.static(FREE_SPOOL):
        moves = contact.joint_held[LINKS + d] == real(0.0)
        if moves:
            tension = string_stiffness(mechanism, here, d) * here.q[LINKS + d]
            if here.remembers > real(0.0):  # what a guide holds
                string = tendon_state(mechanism, p, here, d, contact.row_side[TENDONS + d])
                line = line_effects(Jet(tension, real(0.0), real(0.0)), string, p)
                tension = line[0]
    if not moves:
        if contact.row_held[d] == real(0.0):
            tension = forces.tension[d]
            if wp.static(HAS_ROTOR):
                arms = tendon_arms(mechanism, here)
                bow = tendon_bow(here)
                rate = excursion(arms, d, acceleration) + bow[d]
                tension = tension - forces.felt[d] * rate
                if wp.static(not FREE_SPOOL):
                    inertia = rotor_inertia(mechanism, here.world, p, d)
                    tension = tension_of_shaft(mechanism, p, here, contact, d, inertia * rate)
        else:
            least = flow_at(mechanism, p, here, d, contact.least_side[d])
            most = flow_at(mechanism, p, here, d, contact.most_side[d])
            share = share_between(least, most, contact.hold[d])
            tension = least.tension[0] + share * (most.tension[0] - least.tension[0])
    return tension


@device_template
def tension_of_shaft(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    d: int,
    accelerating: real,
) -> real:
    """Return what a gear passes on [N] whose load decides its friction, by the rotor's part [N]."""
    flow = flow_at(mechanism, p, here, d, contact.row_side[d])
    loaded = here
    loaded.carried[d] = flow.motor_force[0] - accelerating
    flow = flow_at(mechanism, p, loaded, d, contact.row_side[d])
    return flow.tension[0] - flow.tension_gain * accelerating
