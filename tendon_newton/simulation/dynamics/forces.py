"""Forces on the joints in frozen contact states: smooth, with their derivatives."""

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse
from tendon_newton.device_code.placeholders import (
    FIRST_BODY,
    FREE_SPOOL,
    HAS_BODY,
    HAS_ROTOR,
    JOINTS,
    LINKS,
    ROUTED,
    ROWS,
    TENDONS,
    TOUCHES,
    Jet,
    JointMatrix,
    JointVector,
    ParameterVector,
    RowMatrix,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import chain_terms, contact_terms, with_body_terms
from tendon_newton.device_code.structs import (
    ContactStates,
    Drive,
    Flow,
    Forces,
    FreeEquation,
    Mechanism,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.joint import damping_torque, spring_torque
from tendon_newton.simulation.tendons.routes import (
    route_stiffness,
    row_arms,
    row_bow,
    tendon_arms,
    tendon_bow,
)
from tendon_newton.simulation.tendons.spools import rotor_inertia, with_spool
from tendon_newton.simulation.tendons.states import flow_at, joint_state


@device_template
def smooth_forces(
    mechanism: Mechanism, p: ParameterVector, here: Drive, contact: ContactStates
) -> Forces:
    """Return mass matrix M, torque f and its derivatives K by q and D by v, without what sticks.

    The first stage of the integrator solves (M - g D - g² K) a = f + g K v, where g [s] is a
    share of the step: a force that grows with speed is implicit, however stiff it is.
    """
    terms = chain_terms(mechanism, here)
    if wp.static(HAS_BODY):
        terms = with_body_terms(mechanism, here, terms)
    mass_matrix = terms.mass_matrix
    torque = terms.torque
    stiffness = JointMatrix()
    damping = JointMatrix()
    for j in range(FIRST_BODY):
        own = joint_torque(mechanism, p, here, j, contact.touch[j])
        torque[j] = torque[j] + own[0] - here.friction[j] * contact.joint_direction[j]
        stiffness[j, j] = stiffness[j, j] + own[1]
        damping[j, j] = damping[j, j] + own[2]
    if wp.static(TOUCHES):
        touch = contact_terms(mechanism, here)
        torque = torque + touch.torque
        stiffness = stiffness + touch.stiffness
        damping = damping + touch.damping
    arms = tendon_arms(mechanism, here)
    bow = tendon_bow(here)
    laden = Drive()
    if wp.static(HAS_ROTOR and not FREE_SPOOL):
        laden = loaded(mechanism, p, here, contact, mass_matrix, torque)
    out = Forces()
    slack = TendonVector()
    line = TendonVector()
    pulls = TendonVector()
    tension = TendonVector()
    felt = TendonVector()
    for d in range(TENDONS):
        pull = Jet(real(0.0), real(0.0), real(0.0))
        inertia = real(0.0)
        pulls[d] = contact.hold[d]
        moves = bool(False)
        if wp.static(FREE_SPOOL):
            moves = contact.joint_held[LINKS + d] == real(0.0)
        if contact.row_held[d] == real(0.0) and not moves:
            flow = Flow()
            if wp.static(HAS_ROTOR and not FREE_SPOOL):
                flow = flow_at(mechanism, p, laden, d, contact.row_side[d])
            else:
                flow = flow_at(mechanism, p, here, d, contact.row_side[d])
            pull = flow.pull
            pulls[d] = pull[0]
            slack[d] = flow.slack
            line[d] = flow.line
            tension[d] = flow.tension[0]
            if wp.static(HAS_ROTOR):
                rotor = rotor_inertia(mechanism, here.world, p, d)
                inertia = flow.pull_gain * rotor
                felt[d] = flow.tension_gain * rotor
            if wp.static(HAS_ROTOR and not FREE_SPOOL):
                if flow.tension[0] < mechanism.least_tension[here.world][d]:
                    pull = Jet(real(0.0), real(0.0), real(0.0))  # at rest a string is slack
        for i in range(FIRST_BODY):
            torque[i] = torque[i] + arms[d, i] * pull[0]
            if wp.static(ROUTED and HAS_ROTOR):
                torque[i] = torque[i] - arms[d, i] * inertia * bow[d]
            for j in range(FIRST_BODY):
                product = arms[d, i] * arms[d, j]
                if wp.static(HAS_ROTOR):
                    mass_matrix[i, j] = mass_matrix[i, j] + product * inertia
                stiffness[i, j] = stiffness[i, j] + product * pull[1]
                damping[i, j] = damping[i, j] + product * pull[2]
        if wp.static(FREE_SPOOL):
            if not moves:
                c = LINKS + d
                # held, and solved for by nobody: any numbers keep the matrices regular
                mass_matrix[c, c] = real(1.0)
                stiffness[c, c] = -real(1.0)
    out.mass_matrix = mass_matrix
    out.torque = torque
    out.stiffness = stiffness
    out.damping = damping
    out.slack = slack
    out.line = line
    out.pull = pulls
    out.tension = tension
    out.felt = felt
    if wp.static(FREE_SPOOL):
        for d in range(TENDONS):
            if contact.joint_held[LINKS + d] == real(0.0):
                out = with_spool(mechanism, p, here, contact, d, out)
    if wp.static(ROUTED):
        out.stiffness = out.stiffness + route_stiffness(here, out.pull)
        out.arms = row_arms(mechanism, here, contact)
        out.bow = row_bow(here)
    return out


@device_template
def free_part(
    matrix: JointMatrix, load: JointVector, arms: RowMatrix, contact: ContactStates
) -> FreeEquation:
    """Return matrix x = load on the joints that are not held; x is zero along those that are."""
    m = matrix
    b = load
    free = arms
    for j in range(JOINTS):
        if contact.joint_held[j] > real(0.0):
            for i in range(JOINTS):
                m[i, j] = real(0.0)
                m[j, i] = real(0.0)
            for d in range(ROWS):
                free[d, j] = real(0.0)
            m[j, j] = real(1.0)
            b[j] = real(0.0)
    # a tape does not see numbers that are written into a struct one by one
    out = FreeEquation()
    out.matrix = m
    out.load = b
    out.arms = free
    return out


@device_template
def loaded(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    mass_matrix: JointMatrix,
    torque: JointVector,
) -> Drive:
    """Return a drive that knows what each sliding gear is given [N], by its motor less the rotor.

    Friction under load depends on the sign of F - C (`load_side`; some laws take 2 F - C). F is
    what the gear is given, C all other friction. F follows from accelerations, and those are found
    with the sign that F = F_m has. This changes no sign, since with one tendon

        F - C = (M (F_m - C) + J F_l) / (M + c J)

    F_m and F_l are the forces of motor and load, J and M the inertias of rotor and load. Only the
    gear's gain c > 0 depends on the sign that was taken.
    """
    arms = tendon_arms(mechanism, here)
    bow = tendon_bow(here)
    m = mass_matrix
    push = torque
    force = TendonVector()
    felt = TendonVector()
    for d in range(TENDONS):
        if contact.row_held[d] == real(0.0):
            flow = flow_at(mechanism, p, here, d, contact.row_side[d])
            inertia = rotor_inertia(mechanism, here.world, p, d)
            force[d] = flow.motor_force[0]
            felt[d] = inertia
            for i in range(FIRST_BODY):
                passed = flow.pull[0] - flow.pull_gain * inertia * bow[d]
                push[i] = push[i] + arms[d, i] * passed
                for j in range(FIRST_BODY):
                    m[i, j] = m[i, j] + arms[d, i] * arms[d, j] * flow.pull_gain * inertia
    no_arms = RowMatrix()
    free = free_part(m, push, no_arms, contact)
    acceleration = inverse(free.matrix) * free.load
    for d in range(TENDONS):
        rate = bow[d]
        for j in range(FIRST_BODY):
            rate = rate + arms[d, j] * acceleration[j]
        force[d] = force[d] - felt[d] * rate
    out = here
    out.carried = force
    return out


@device_template
def joint_torque(mechanism: Mechanism, p: ParameterVector, here: Drive, j: int, touch: real) -> Jet:
    """Return the torque of a joint's spring, damper and end stop (touch: +1 upper, -1 lower)."""
    joint = joint_state(mechanism, here, j)
    torque = spring_torque(joint, p) + damping_torque(joint, p)
    if touch != real(0.0):
        bound = joint.upper
        if touch < real(0.0):
            bound = joint.lower
        k = mechanism.limit_stiffness[here.world][j]
        c = mechanism.limit_damping[here.world][j]
        torque = torque - Jet(k * (joint.position - bound) + c * joint.velocity, k, c)
    return torque


@device_template
def touching(mechanism: Mechanism, world: int, q: JointVector, v: JointVector) -> JointVector:
    """Return per joint +1 or -1 where its upper or lower end stop pushes; a stop never pulls."""
    touch = JointVector()
    for j in range(JOINTS):
        k = mechanism.limit_stiffness[world][j]
        c = mechanism.limit_damping[world][j]
        over = q[j] - mechanism.upper[world][j]
        under = q[j] - mechanism.lower[world][j]
        if over > real(0.0) and k * over + c * v[j] > real(0.0):
            touch[j] = real(1.0)
        if under < real(0.0) and k * under + c * v[j] < real(0.0):
            touch[j] = real(-1.0)
    return touch
