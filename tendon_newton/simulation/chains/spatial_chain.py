"""Equations of motion of any tree of revolute and prismatic joints, in joint coordinates.

At q = 0 every link's frame has the axes of the base, so a link's rotation R is that of its
ancestors' joints alone. `here.inertia` scales what resists acceleration, not what weighs.

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
    Mat33,
    SpaceMatrix,
    TurnMatrix,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import ChainTerms, Drive, Mechanism
from tendon_newton.device_code.templates import device_template


@device_template
def rotation_about(axis: Vec3, angle: real) -> Mat33:
    """Return the rotation by an angle [rad] about a unit axis (Rodrigues)."""
    s = wp.sin(angle)
    c = wp.cos(angle)
    skew = wp.skew(axis)
    bent = s * skew + (real(1.0) - c) * (skew * skew)  # pyright: ignore[reportOperatorIssue]
    return wp.identity(n=3, dtype=real) + bent


@device_template
def row(matrix: SpaceMatrix, index: int) -> Vec3:
    """Return one row of a (J, 3) matrix."""
    return Vec3(matrix[index, 0], matrix[index, 1], matrix[index, 2])


@device_template
def turn_of(matrix: TurnMatrix, index: int) -> Mat33:
    """Return one link's rotation: three rows each. A tape reads these, and no local array."""
    i = 3 * index
    return Mat33(
        matrix[i, 0],
        matrix[i, 1],
        matrix[i, 2],
        matrix[i + 1, 0],
        matrix[i + 1, 1],
        matrix[i + 1, 2],
        matrix[i + 2, 0],
        matrix[i + 2, 1],
        matrix[i + 2, 2],
    )


@device_template
def chain_terms(mechanism: Mechanism, here: Drive) -> ChainTerms:
    """Return M(q), (J, J), and the torque of gravity and velocities, (J,): M q_ddot = torque."""
    q = here.q
    v = here.v
    origin = SpaceMatrix()
    centre = SpaceMatrix()
    axis = SpaceMatrix()
    rate = SpaceMatrix()  # angular velocity [rad/s]
    turning = SpaceMatrix()  # angular acceleration at q_ddot = 0 [rad/s2]
    bias = SpaceMatrix()  # acceleration of the joint's origin at q_ddot = 0 [m/s2]
    rotations = TurnMatrix()
    out = ChainTerms()
    mass_matrix = JointMatrix()
    torque = JointVector()
    for j in range(LINKS):
        rotation = wp.identity(n=3, dtype=real)
        o = Vec3()
        a = Vec3()
        w = Vec3()
        alpha = Vec3()
        if wp.static(PARENT[j] >= 0):
            rotation = turn_of(rotations, wp.static(PARENT[j]))
            o = row(origin, wp.static(PARENT[j]))
            a = row(bias, wp.static(PARENT[j]))
            w = row(rate, wp.static(PARENT[j]))
            alpha = row(turning, wp.static(PARENT[j]))
        z = rotation * mechanism.axis[here.world, j]
        offset = rotation * mechanism.offset[here.world, j]
        if wp.static(REVOLUTE[j]):
            o = o + offset
            a = a + wp.cross(alpha, offset) + wp.cross(w, wp.cross(w, offset))
            alpha = alpha + wp.cross(w, z * v[j])
            w = w + z * v[j]
            rotation = rotation * rotation_about(mechanism.axis[here.world, j], q[j])
        else:
            offset = offset + z * q[j]
            o = o + offset
            a = a + wp.cross(alpha, offset) + wp.cross(w, wp.cross(w, offset))
            a = a + real(2.0) * wp.cross(w, z * v[j])
        for i in range(3):
            for k in range(3):
                rotations[3 * j + i, k] = rotation[i, k]
        c = rotation * mechanism.centre[here.world, j]
        for i in range(3):
            origin[j, i] = o[i]
            centre[j, i] = o[i] + c[i]
            axis[j, i] = z[i]
            rate[j, i] = w[i]
            turning[j, i] = alpha[i]
            bias[j, i] = a[i]
        mass = mechanism.mass[here.world, j]
        turned = rotation * mechanism.inertia[here.world, j]
        inertia = here.inertia * (turned * wp.transpose(rotation))
        drift = here.inertia * (a + wp.cross(alpha, c) + wp.cross(w, wp.cross(w, c)))
        drift = drift - here.gravity
        spin = inertia * alpha + wp.cross(w, inertia * w)
        for i in range(LINKS):
            if wp.static(MOVES[i][j]):
                z_i = row(axis, i)
                column = z_i
                if wp.static(REVOLUTE[i]):
                    column = wp.cross(z_i, o + c - row(origin, i))
                    torque[i] = torque[i] - wp.dot(z_i, spin)
                torque[i] = torque[i] - mass * wp.dot(column, drift)
                for k in range(LINKS):
                    if wp.static(MOVES[k][j]):
                        z_k = row(axis, k)
                        entry = real(0.0)
                        if wp.static(REVOLUTE[k]):
                            entry = (
                                mass
                                * here.inertia
                                * wp.dot(column, wp.cross(z_k, o + c - row(origin, k)))
                            )
                        else:
                            entry = mass * here.inertia * wp.dot(column, z_k)
                        if wp.static(REVOLUTE[i] and REVOLUTE[k]):
                            entry = entry + wp.dot(z_i, inertia * z_k)
                        mass_matrix[i, k] = mass_matrix[i, k] + entry
    for j in range(JOINTS):
        mass_matrix[j, j] = mass_matrix[j, j] + mechanism.armature[here.world][j]
    out.mass_matrix = mass_matrix
    out.torque = torque
    return out
