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
