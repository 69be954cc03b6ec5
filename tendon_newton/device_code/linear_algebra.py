"""Small dense linear algebra on matrices that live in registers."""

from __future__ import annotations

from tendon_newton.device_code.placeholders import JOINTS, JointMatrix, real
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
