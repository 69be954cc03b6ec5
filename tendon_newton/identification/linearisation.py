"""A fit around its optimum: residuals and their derivatives."""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.identification.objective import loss_weights


@dataclass(frozen=True, kw_only=True)
class Linearisation:
    """A candidate's residuals around its optimum."""

    residual: Array  # Scaled residuals, shape (M,)
    jacobian: Array  # Derivatives of the residuals by each parameter, shape (M, F)
    weight: Array | float = 1.0  # How often each row counts [1], shape (M,)

    def normal_matrix(self) -> Array:
        """Return the weighted normal matrix, shape (F, F)."""
        w = self.weight * loss_weights(self.residual)
        return self.jacobian.T @ (w[:, None] * self.jacobian)

    def gradient(self, rows: Array | None = None) -> Array:
        """Return the gradient of the loss over some rows, shape (F,)."""
        w = self.weight * loss_weights(self.residual)
        w = w if rows is None else w * rows
        return self.jacobian.T @ (w * self.residual)


def invertible(hessian: Array) -> Array:
    """Return a normal matrix with a ridge so small that it helps idle parameters only."""
    return hessian + 1.0e-9 * np.diag(np.maximum(np.diag(hessian), 1.0e-30))
