"""Windows on a device, gathered batch by batch from their rows."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from train.actuator.samples.windows import Windows


@dataclass(frozen=True, kw_only=True)
class WindowTensors:
    """Rows and windows as tensors; a row is stored once, however many windows it is in."""

    inputs: Tensor
    """theta_d [rad], theta [rad], theta_dot [rad/s] of each row, shape (N, 3)."""
    force: Tensor
    """Tension of each row [N], shape (N,)."""
    rows: Tensor
    """Rows of each window, oldest first, shape (W, window)."""

    def batch(self, chosen: Tensor) -> Tensor:
        """Return the chosen windows, shape (len(chosen), window, 3)."""
        return self.inputs[self.rows[chosen]]

    def targets(self, chosen: Tensor) -> Tensor:
        """Return the tension [N] at every sample of the chosen windows."""
        return self.force[self.rows[chosen]]


def to_device(windows: Windows, device: str) -> WindowTensors:
    """Put windows on a device."""
    return WindowTensors(
        inputs=torch.tensor(windows.inputs, dtype=torch.float32, device=device),
        force=torch.tensor(windows.force, dtype=torch.float32, device=device),
        rows=torch.tensor(windows.rows, dtype=torch.int64, device=device),
    )
