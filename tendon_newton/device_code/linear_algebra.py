"""Small dense linear algebra on matrices that live in registers."""

import warp as wp

from tendon_newton.device_code.placeholders import JOINTS, JointMatrix, JointVector, real
from tendon_newton.device_code.templates import device_template


@device_template
def inverse(matrix: JointMatrix) -> JointMatrix:
    """Invert a symmetric positive definite matrix, shape (J, J), by Gauss-Jordan elimination."""
    m = matrix
    for pivot in range(JOINTS):
        scale = real(1.0) / m[pivot, pivot]
        m[pivot, pivot] = real(1.0)
        for column in range(JOINTS):
            m[pivot, column] = m[pivot, column] * scale
        for row in range(JOINTS):
            if row != pivot:
                factor = m[row, pivot]
                m[row, pivot] = real(0.0)
                for column in range(JOINTS):
                    m[row, column] = m[row, column] - factor * m[pivot, column]
    return m


@device_template
def looped_inverse(matrix: JointMatrix) -> JointMatrix:
    """Invert as `inverse` does, in loops that stay loops: with many joints a compiler needs it.

    No tape walks it: its derivative is written by hand.
    """
    m = matrix
    count = int(JOINTS)
    for pivot in range(count):
        scale = real(1.0) / m[pivot, pivot]
        m[pivot, pivot] = real(1.0)
        for column in range(count):
            m[pivot, column] = m[pivot, column] * scale
        for row in range(count):
            if row != pivot:
                factor = m[row, pivot]
                m[row, pivot] = real(0.0)
                for column in range(count):
                    m[row, column] = m[row, column] - factor * m[pivot, column]
    return m


@device_template
def solution(matrix: JointMatrix, load: JointVector) -> JointVector:
    """Solve matrix x = load by Gaussian elimination: a third of the work of `inverse`.

    As there no rows are exchanged: what stays of a mass matrix and its springs needs none.
    """
    m = matrix
    x = load
    for pivot in range(JOINTS):
        scale = real(1.0) / m[pivot, pivot]
        for row in range(JOINTS):
            if row > pivot:
                factor = scale * m[row, pivot]
                for column in range(JOINTS):
                    if column > pivot:
                        m[row, column] = m[row, column] - factor * m[pivot, column]
                x[row] = x[row] - factor * x[pivot]
    for step in range(JOINTS):
        i = wp.static(JOINTS - 1) - step
        for j in range(JOINTS):
            if j > i:
                x[i] = x[i] - m[i, j] * x[j]
        x[i] = x[i] / m[i, i]
    return x
