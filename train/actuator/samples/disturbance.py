"""Windows as another servo and another morning could have recorded them.

A hold of some seconds is hundreds of windows that differ by noise alone, and its angles are like no
other hold's: a network can learn it by heart. So every window is changed a little whenever it is
drawn, by less than what its force would notice.
"""

from __future__ import annotations

import torch
from torch import Tensor

ZERO = 0.02
"""Standard deviation of a window's zero of both angles [rad]: a quarter of a millimetre of tendon,
to which one is tied again."""
COMMAND = 0.03
"""The same of the command alone [rad]: an eighth of a newton at the paper's 4.2 N/rad."""
ANGLE = 0.003
"""The same of each sample's angle [rad]: two counts of an encoder with 4096."""
SPEED = 0.03
"""The same of each sample's speed [rad/s]: the step of a DYNAMIXEL X register (0.229 rev/min,
e-manual)."""


def disturbed(windows: Tensor, generator: torch.Generator) -> Tensor:
    """Return windows with another zero, another command and other noise.

    Args:
        windows: theta_d [rad], theta [rad], theta_dot [rad/s], shape (W, window, 3).
        generator: Draws, on the CPU, the same on every device.
    """
    count, length, _ = windows.shape
    zero, command = torch.randn(2, count, 1, generator=generator)
    angle, speed = torch.randn(2, count, length, generator=generator)
    change = torch.stack(
        [
            (ZERO * zero + COMMAND * command).expand(count, length),
            ZERO * zero + ANGLE * angle,
            SPEED * speed,
        ],
        dim=2,
    )
    return windows + change.to(windows.device)
