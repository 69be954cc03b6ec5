"""Derivatives that are known by reasoning, in place of those that a tape works out line by line.

The contact states (what slides, sticks or touches) are whole numbers: their derivative is
zero, and a tape that walks through
the search for them would only lose time. A linear solve has the same solve as its adjoint.
"""

# pyright: reportAttributeAccessIssue=false, reportOperatorIssue=false

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse, looped_inverse
from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    ROWS,
    TOUCHES,
    JointMatrix,
    JointVector,
    ParameterVector,
    RowMatrix,
    RowVector,
    real,
)
from tendon_newton.device_code.structs import Commands, ContactStates, Drive, Log, Mechanism
from tendon_newton.device_code.templates import Specialiser, device_template
from tendon_newton.simulation.contact.contact_distances import constant_share, halved_share
from tendon_newton.simulation.dynamics.contact_states import (
    SWEEPS,
    choose_contact_states,
    constrained_solve,
)
from tendon_newton.simulation.dynamics.forces import free_part, touching
from tendon_newton.simulation.kernels.acting_command import find_row


@device_template
def inverse_rule(matrix: JointMatrix, adj_ret: JointMatrix) -> None:
    """Apply d(M^-1) = -M^-1 dM M^-1."""
    turned = wp.transpose(inverse(matrix))
    wp.adjoint[matrix] += -(turned * adj_ret * turned)


@device_template
def constraint_forces(
    matrix: JointMatrix, load: JointVector, x: JointVector, contact: ContactStates, arms: RowMatrix
) -> RowVector:
    """Return the multipliers z of the tendons that stick.

    A^T z = load - M x over the joints that are free.
    """
    part = free_part(matrix, load - matrix * x, arms, contact)
    rest = part.load
    free = part.arms
    z = RowVector()
    for _sweep in range(wp.static(1 if ROWS == 1 else SWEEPS)):
        for d in range(ROWS):
            size = wp.dot(free[d], free[d])
            if contact.row_held[d] > real(0.0) and size > real(0.0):
                change = wp.dot(free[d], rest) / size
                rest = rest - free[d] * change
                z[d] = z[d] + change
    return z


@device_template
def constrained_solve_rule(
    matrix: JointMatrix,
    load: JointVector,
    contact: ContactStates,
    arms: RowMatrix,
    bow: RowVector,
    adj_ret: JointVector,
) -> None:
    """Apply the adjoint of a saddle-point system: one more solve.

    It is symmetric, but for contacts that slide and strings whose friction stands between two
    coordinates.
    """
    turned = matrix
    if wp.static(TOUCHES or FREE_SPOOL):
        turned = wp.transpose(matrix)
    x = constrained_solve(matrix, load, contact, arms, bow)
    y = constrained_solve(turned, adj_ret, contact, arms, RowVector())
    wp.adjoint[load] += y
    wp.adjoint[matrix] += -wp.outer(y, x)
    held = real(0.0)
    for d in range(ROWS):
        held = held + contact.row_held[d]
    if held > real(0.0):
        lift = constraint_forces(matrix, load, x, contact, arms)
        pull = constraint_forces(turned, adj_ret, y, contact, arms)
        wp.adjoint[arms] += -(wp.outer(pull, x) + wp.outer(lift, y))
        wp.adjoint[bow] += -pull


@device_template
def constant_contact_states(
    mechanism: Mechanism, p: ParameterVector, here: Drive, adj_ret: ContactStates
) -> None:
    """Contact states are whole numbers."""


@device_template
def constant_touch(
    mechanism: Mechanism, world: int, q: JointVector, v: JointVector, adj_ret: JointVector
) -> None:
    """Contacts are constant too."""


@device_template
def constant_row(commands: Commands, log: Log, instant: real, guess: int, adj_ret: int) -> None:
    """Rows are constant too."""


def add_gradient_rules(specialiser: Specialiser, *, meets: bool) -> None:
    """Teach a specialiser all rules of this file; links may meet obstacles, or not."""
    specialiser.gradient(inverse, inverse_rule)
    specialiser.gradient(looped_inverse, inverse_rule)
    specialiser.gradient(constrained_solve, constrained_solve_rule)
    specialiser.gradient(choose_contact_states, constant_contact_states)
    specialiser.gradient(touching, constant_touch)
    specialiser.gradient(find_row, constant_row)
    if meets:
        specialiser.gradient(halved_share, constant_share)
