"""The tension that a load cell between spool and mechanism feels."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_ROTOR,
    LINKS,
    TENDONS,
    JointVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.structs import ContactStates, Drive, Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.tendons.pipeline import excursion, flow_at
from tendon_newton.simulation.tendons.routes import tendon_arms, tendon_bow
from tendon_newton.simulation.tendons.spools import rotor_inertia, spool_at


@device_template
def held_share(
    mechanism: Mechanism, p: ParameterVector, here: Drive, contact: ContactStates, d: int
) -> real:
    """Return where between its two sides a held tendon is: 0 at the least pull, 1 at the most."""
    least = flow_at(mechanism, p, here, d, contact.least_side[d])
    most = flow_at(mechanism, p, here, d, contact.most_side[d])
    share = real(0.5)
    if most.pull[0] > least.pull[0]:
        share = (contact.hold[d] - least.pull[0]) / (most.pull[0] - least.pull[0])
    return share


@device_template
def tension_now(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    d: int,
    acceleration: JointVector,
) -> real:
    """Return the tension at the load cell [N]: what gear and rotor leave of the motor's force.

    Where the tendon is held it is what holds it; where its spool moves on its own, what the string
    carries. A negative one says that the string cannot be taut.

    Args:
        mechanism: Numbers of all benches.
        p: Numbers of actuator and effects.
        here: What acts on the world, and where it is.
        contact: What slides, sticks and pulls.
        d: The tendon.
        acceleration: Accelerations of the coordinates now [rad/s2, m/s2], for a rotor alone.
    """
    tension = real(0.0)
    moves = bool(False)
    if wp.static(FREE_SPOOL):
        moves = contact.joint_held[LINKS + d] == real(0.0)
        if moves:
            guide = contact.row_side[TENDONS + d]
            spool = spool_at(mechanism, p, here, d, contact.row_side[d], guide)
            tension = spool.tension
    if not moves:
        if contact.row_held[d] == real(0.0):
            sliding = flow_at(mechanism, p, here, d, contact.row_side[d])
            tension = sliding.tension[0]
            if wp.static(HAS_ROTOR):
                arms = tendon_arms(mechanism, here)
                bow = tendon_bow(here)
                rate = excursion(arms, d, acceleration) + bow[d]
                inertia = rotor_inertia(mechanism, here.world, p, d)
                tension = tension - sliding.tension_gain * inertia * rate
                if wp.static(not FREE_SPOOL):
                    loaded = here
                    loaded.carried[d] = sliding.motor_force[0] - inertia * rate
                    sliding = flow_at(mechanism, p, loaded, d, contact.row_side[d])
                    tension = sliding.tension[0] - sliding.tension_gain * inertia * rate
        else:
            least = flow_at(mechanism, p, here, d, contact.least_side[d])
            most = flow_at(mechanism, p, here, d, contact.most_side[d])
            share = held_share(mechanism, p, here, contact, d)
            tension = least.tension[0] + share * (most.tension[0] - least.tension[0])
    return tension
