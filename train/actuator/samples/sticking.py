"""Windows in which a motor sticks, asked for something else that would not have moved it.

Where a gear sticks, the tension is what it was when the shaft came to rest, whatever is asked
within friction's band. Recordings show this for a few commands per stop; a network takes the
command for the cause and lets the force go down with it. So of the windows that end at rest, half
get another command from some instant of the rest on, for which the same force is as true.
"""

from __future__ import annotations

import torch
from torch import Tensor

from train.actuator.samples.servo_law import TAUT, ServoLaw
from train.actuator.samples.windows import REST_SPEED

SHARE = 0.5
"""Share of the windows that end at rest which are asked for something else [1]."""
FEWEST = 3
"""Samples of rest that a window needs."""
LATEST = 0.8
"""Latest that a command begins to change, in parts of the rest [1]."""
SHORTEST, LONGEST = 0.05, 1.05
"""How long it takes, in parts of the rest [1]; each window has its own: steps and ramps."""


def held_fast(windows: Tensor, force: Tensor, law: ServoLaw, generator: torch.Generator) -> Tensor:
    r"""Return windows of which half of those at rest are asked for something else.

    The lead :math:`\theta_d - \theta` goes to where it would hold the same force F,

    .. math:: F (1 - \mu) - c \le P (\theta_d - \theta) \le F (1 + \mu) + c

    with the friction of a gear that slides; one that sticks holds more.

    Args:
        windows: theta_d [rad], theta [rad], theta_dot [rad/s], shape (W, window, 3).
        force: Tension at their end [N], shape (W,).
        law: The servo's.
        generator: Draws, on the CPU, the same on every device.
    """
    count = len(windows)
    chance, place, begin, length = torch.rand(4, count, 1, generator=generator).to(windows.device)
    if law.stiffness == 0.0:
        return windows
    angle = windows[:, :, 1]
    lead = windows[:, :, 0] - angle
    rest = resting(windows[:, :, 2])
    samples = rest.sum(dim=1, keepdim=True)
    chosen = (chance < SHARE) & (samples >= FEWEST) & (force[:, None] > TAUT)
    band = law.load_friction * force[:, None] + law.dry_friction
    target = (force[:, None] + (2.0 * place - 1.0) * band) / law.stiffness
    age = torch.cumsum(rest, dim=1) / samples.clamp(min=1.0)
    way = (age - LATEST * begin) / (SHORTEST + (LONGEST - SHORTEST) * length)
    way = way.clamp(0.0, 1.0) * rest * chosen
    return torch.stack([angle + lead + way * (target - lead), angle, windows[:, :, 2]], dim=2)


def resting(speed: Tensor) -> Tensor:
    """Return 1 for each sample from which on a shaft rests to the end, else 0, (W, window)."""
    slow = speed.abs() <= REST_SPEED
    return slow.flip(1).cumprod(dim=1).flip(1).to(speed.dtype)
