r"""A small servo, many side by side: second order with delay, limit, friction and play.

.. math:: \dot x = v, \qquad \dot v = g \operatorname{clip}_m(f) - b v

with the drive :math:`f`, an angle, late by :math:`d`. A servo that stands stays while
:math:`|f| \le s`; one that moves is slowed by a share of that. The joint lies within a play about
:math:`x`: where neither side touches it, its speed fades. In a servo's own loop the drive is the
error and its integral; under a policy it is the command less :math:`x`.
"""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array

RANGES = {
    "delay": (1e-3, 0.4),  # d [s]
    "pull": (5.0, 1e5),  # g [1/s^2]
    "damping": (1.0, 200.0),  # b [1/s]
    "limit": (3e-3, 20.0),  # m [rad]
    "sticking": (1e-4, 0.3),  # s [rad]
    "sliding": (0.2, 0.95),  # Friction in motion against that at rest [1]
    "play": (1e-4, 0.3),  # [rad]
    "fading": (0.3, 300.0),  # Of the joint's speed within the play [1/s]
    "integral": (1e-3, 20.0),  # Of a servo's own loop [1/s]
}
NAMES = tuple(RANGES)
LEAST, MOST = (np.array(ends) for ends in zip(*RANGES.values(), strict=True))


@dataclass(frozen=True, kw_only=True)
class Feedback:
    """What closes the loop."""

    outer: bool  # Whether a policy does, whose command is logged
    gain: float = 0.0  # Of the policy [1]
    integral: float = 0.0  # Of the policy [1/s]
    late: int = 0  # Rows by which it answers
    row: float = 0.0  # Time between rows [s]
    bound: float = np.inf  # Most that a policy's command is off its goal [rad]


class Servos:
    """Servos of different numbers, shape (N,) each, that are advanced together."""

    def __init__(self, numbers: Array, step: float, *, outer: bool) -> None:
        self.delay, self.pull, self.damping, self.limit, self.sticking = numbers.T[:5].copy()
        self.sliding, self.width, fading, self.integral = numbers.T[5:].copy()
        self.step, self.outer = step, outer
        self.place, self.speed, self.angle, self.rate = np.zeros((4, len(numbers)))
        # implicit, so that long steps are stable
        self.slowed = 1.0 / (1.0 + step * self.damping + (step**2 * self.pull if outer else 0.0))
        self.faded = 1.0 / (1.0 + step * fading)

    def advance(self, drive: Array) -> Array:
        """Advance by a step under an angle that is wanted or missing [rad]; return the angle."""
        force = drive - self.place if self.outer else drive
        stands = self.speed == 0.0
        drag = self.sliding * self.sticking * np.sign(np.where(stands, force, self.speed))
        pushed = np.minimum(np.maximum(force, -self.limit), self.limit) - drag
        speed = (self.speed + self.step * self.pull * pushed) * self.slowed
        weak = np.abs(force) <= self.sticking
        self.speed = np.where(weak & (stands | (speed * self.speed < 0.0)), 0.0, speed)
        self.place = self.place + self.step * self.speed
        rate = self.rate * self.faded
        free = self.angle + self.step * rate
        half = 0.5 * self.width
        self.angle = np.minimum(np.maximum(free, self.place - half), self.place + half)
        self.rate = np.where(free == self.angle, rate, self.speed)
        return self.angle


def driven(numbers: Array, drive: Array, summed: Array, step: float, *, outer: bool) -> Array:
    """Return the angles of servos under a measured drive [rad], shape (T, N).

    Args:
        numbers: In the order of ``NAMES``, shape (N, 9).
        drive: Command, or error in a servo's own loop, shape (T,).
        summed: Its integral [rad s], shape (T,).
    """
    servos = Servos(numbers, step, outer=outer)
    count = len(drive)
    late = servos.delay / step
    if outer:
        servos.place[:] = drive[0]
        servos.angle[:] = drive[0]
    angles = np.empty((count, len(numbers)))
    for row in range(count):
        at = np.clip(row - late, 0.0, None)
        low = at.astype(np.intp)
        share = at - low
        high = np.minimum(low + 1, count - 1)
        now = drive[low] + share * (drive[high] - drive[low])
        if not outer:
            now = now + servos.integral * (summed[low] + share * (summed[high] - summed[low]))
        angles[row] = servos.advance(now)
    return angles


def closed(
    numbers: Array, feedback: Feedback, kick: float, step: float, count: int, *, gains: Array
) -> Array:
    """Return angles of closed loops that begin a kick away from a goal of 0 [rad], (count, N).

    Args:
        gains: By what the loop's proportional and integral gain are multiplied [1], shape (N, 2).
    """
    servos = Servos(numbers, step, outer=feedback.outer)
    number = len(numbers)
    servos.place[:] = servos.angle[:] = kick
    late = np.asarray(np.round(servos.delay / step), dtype=np.intp)
    every = max(1, round(feedback.row / step)) if feedback.outer else 1
    gain, integral = gains[:, 0], gains[:, 1]
    integral = integral * (feedback.integral if feedback.outer else servos.integral)
    gain = gain * (feedback.gain if feedback.outer else 1.0)
    bound = feedback.bound if feedback.outer else servos.limit
    summed, command, columns = np.zeros(number), np.zeros(number), np.arange(number)
    drives, angles = np.zeros((2, count, number))
    for row in range(count):
        angles[row] = servos.angle
        if row % every == 0:
            error = -angles[max(0, row - every * feedback.late)]
            summed = np.clip(summed + every * step * integral * error, -bound, bound)
            command = np.clip(gain * error + summed, -bound, bound)
        drives[row] = command
        servos.advance(np.where(row >= late, drives[np.maximum(row - late, 0), columns], 0.0))
    return angles
