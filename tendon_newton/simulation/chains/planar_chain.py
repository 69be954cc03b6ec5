"""Equations of motion of a chain that moves in one plane, in joint coordinates.

Every joint is revolute about the plane's normal or prismatic inside the plane. A link's frame
sits at its joint and turns with it; vectors of the plane are complex numbers in all but name: a
frame's direction u = (cos, sin) turns a local vector into the base frame. At q = 0 every frame
has the axes of the base. `here.inertia` scales what resists acceleration, not what weighs.

Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 2, written with the Jacobians
of the centres of mass.
"""

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    LINKS,
    MOVES,
    PARENT,
    REVOLUTE,
    JointMatrix,
    JointVector,
    PlaneMatrix,
    Vec2,
    real,
)
from tendon_newton.device_code.structs import ChainTerms, Drive, Mechanism
from tendon_newton.device_code.templates import device_template


@device_template
def turn(u: Vec2, local: Vec2) -> Vec2:
    """Express a vector of the frame with direction u in the base frame."""
    return Vec2(u[0] * local[0] - u[1] * local[1], u[1] * local[0] + u[0] * local[1])


@device_template
def chain_terms(mechanism: Mechanism, here: Drive) -> ChainTerms:
    """Return M(q), (J, J), and the torque of gravity and velocities, (J,): M q_ddot = torque."""
    q = here.q
    v = here.v
    direction = PlaneMatrix()
    origin = PlaneMatrix()
    centre = PlaneMatrix()
    bias = PlaneMatrix()  # acceleration of the joint's origin at q_ddot = 0 [m/s2]
    drift = PlaneMatrix()  # the same of the centre of mass, less gravity
    rate = JointVector()
    axis = PlaneMatrix()
    for j in range(LINKS):
        u = Vec2(real(1.0), real(0.0))
        o = Vec2(real(0.0), real(0.0))
        a = Vec2(real(0.0), real(0.0))
        w = real(0.0)
        offset = mechanism.offset[here.world, j]
        if wp.static(PARENT[j] >= 0):
            p = wp.static(PARENT[j])
            u = Vec2(direction[p, 0], direction[p, 1])
            a = Vec2(bias[p, 0], bias[p, 1])
            w = rate[p]
            offset = turn(u, offset)
            o = Vec2(origin[p, 0], origin[p, 1])
        if wp.static(REVOLUTE[j]):
            o = o + offset
            a = a - w * w * offset
            w = w + v[j]
            u = turn(u, Vec2(wp.cos(q[j]), wp.sin(q[j])))
        else:
            slide = turn(u, mechanism.axis[here.world, j])
            arm = offset + slide * q[j]
            o = o + arm
            a = a - w * w * arm + real(2.0) * w * v[j] * Vec2(-slide[1], slide[0])
            axis[j, 0] = slide[0]
            axis[j, 1] = slide[1]
        c = turn(u, mechanism.centre[here.world, j])
        g = here.inertia * (a - w * w * c) - here.gravity
        rate[j] = w
        for i in range(2):
            direction[j, i] = u[i]
            origin[j, i] = o[i]
            centre[j, i] = o[i] + c[i]
            bias[j, i] = a[i]
            drift[j, i] = g[i]

    out = ChainTerms()
    mass_matrix = JointMatrix()
    torque = JointVector()
    for k in range(LINKS):
        m = mechanism.mass[here.world, k]
        inertia = mechanism.inertia[here.world, k]
        columns = PlaneMatrix()  # Jacobian of the centre of mass of link k
        for j in range(LINKS):
            if wp.static(MOVES[j][k]):
                if wp.static(REVOLUTE[j]):
                    columns[j, 0] = origin[j, 1] - centre[k, 1]
                    columns[j, 1] = centre[k, 0] - origin[j, 0]
                else:
                    columns[j, 0] = axis[j, 0]
                    columns[j, 1] = axis[j, 1]
                torque[j] = torque[j] - m * (
                    columns[j, 0] * drift[k, 0] + columns[j, 1] * drift[k, 1]
                )
        for i in range(LINKS):
            for j in range(LINKS):
                if wp.static(MOVES[i][k] and MOVES[j][k]):
                    entry = m * (columns[i, 0] * columns[j, 0] + columns[i, 1] * columns[j, 1])
                    if wp.static(REVOLUTE[i] and REVOLUTE[j]):
                        entry = entry + inertia
                    mass_matrix[i, j] = mass_matrix[i, j] + here.inertia * entry
    for j in range(JOINTS):
        mass_matrix[j, j] = mass_matrix[j, j] + mechanism.armature[here.world][j]
    out.mass_matrix = mass_matrix
    out.torque = torque
    return out
