"""Windows that leave the recorded motion, with the force that the servo gives there.

Along a recording a bench's force is a function of where its mechanism is, and a network may learn
that function in place of the servo. Such a network is right on every test. In a simulation it lets
the mechanism stay anywhere, and against another hand than in training it is wrong on a test too.
Some of the windows that are drawn are moved off their recording; what the servo makes of this, its
law says. A network for predictions learns the servo first in this way, and in the end what the law
leaves out, from recordings alone.
"""

import torch
from torch import Tensor

from tendon_train.actuator.samples.servo_law import ServoLaw
from tendon_train.actuator.training_config import Purpose

SHARE = 0.5
"""Share of the windows that leave their recording in a training for simulations [1]; the others
keep the network sharp."""
FIRST_SHARE = 0.25
"""Share at the beginning of a training for predictions [1]. A quarter and a half do equally well
on recordings of two other collections, one better on free fingers, one on those that a hand holds.
"""
FIRST_PART = 0.8  # Part of a training for predictions until which it falls to nothing [1]
ZERO = 0.3
"""Standard deviation of a window's zero of both angles [rad]: a servo does not know where it is."""
ANGLE = 0.1  # Standard deviation of the shaft's angle alone, at the window's start [rad]
SPEED = 0.5
"""Largest standard deviation of the speed by which a window departs [rad/s]; each has its own,
evenly drawn from nothing to this."""
SHORTEST, LONGEST = 0.05, 1.0
"""How long such a speed lasts [s]; each window has its own, even in its logarithm."""


def departing_share(purpose: Purpose, done: float) -> float:
    """Return which share of the windows departs after so much of a training [1]."""
    if purpose == "simulation":
        return SHARE
    return FIRST_SHARE * max(0.0, 1.0 - done / FIRST_PART)


def departed(
    windows: Tensor, law: ServoLaw, rate: float, share: float, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Return windows of which a share departs, and what that adds to the force at every sample.

    Angle and speed stay what they are to each other.

    Args:
        windows: theta_d [rad], theta [rad], theta_dot [rad/s], shape (W, window, 3).
        rate: Samples per second [Hz].
        share: Share of the windows that depart [1].
        generator: Draws, on the CPU, the same on every device.

    Returns:
        The windows, and forces [N], shape (W, window).
    """
    count, length, _ = windows.shape
    departs = (torch.rand(count, 1, generator=generator) < share).float()
    zero, angle = departs * torch.randn(2, count, 1, generator=generator)
    speed = departs * wandering(count, length, 1.0 / rate, generator)
    steps = 0.5 * (speed[:, 1:] + speed[:, :-1]) / rate
    turned = ANGLE * angle + torch.nn.functional.pad(torch.cumsum(steps, dim=1), (1, 0))
    shared = (ZERO * zero).expand(count, length)
    change = torch.stack([shared, shared + turned, speed], dim=2)
    force = -law.stiffness * turned - law.damping * speed
    return windows + change.to(windows.device), force.to(windows.device)


def wandering(count: int, length: int, period: float, generator: torch.Generator) -> Tensor:
    """Return speeds [rad/s] that forget themselves evenly, shape (count, length).

    Each is an Ornstein-Uhlenbeck process from its stationary state.
    """
    size, logarithm = torch.rand(2, count, 1, generator=generator)
    lasting = SHORTEST * (LONGEST / SHORTEST) ** logarithm
    kept = torch.exp(-period / lasting)[:, :, None]
    lag = torch.arange(length)[:, None] - torch.arange(length)
    weights = torch.where(lag >= 0, kept ** lag.clamp(min=0), 0.0)
    fresh = torch.cat([torch.ones_like(kept), (1.0 - kept**2).sqrt().expand(-1, 1, length - 1)], 2)
    noise = torch.randn(count, length, 1, generator=generator)
    return SPEED * size * (weights * fresh @ noise)[:, :, 0]
