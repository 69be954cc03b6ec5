r"""The tendon as its own load cell.

.. math::
    F = \kappa \, (r \theta - s - \textstyle\sum_j a_j q_j) \, (1 + \psi d)

On a slider, of which only the spool is seen, ``kappa`` is its spring in series with the line. On a
finger the tip tells the joint angles, ``a`` are the moment arms and ``kappa`` is the stiffness of
the line alone: springs, damping, weight and whatever blocks the finger do not enter. ``s`` is what
the line had to be wound in before it was taut, ``psi`` how much more the spool feels than the
mechanism (capstan friction at the guide), and ``d`` the direction of winding.

Left out: mass and damping of a slider (0.4 N at 0.08 m/s and 5 N s/m), an eccentric encoder.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, log
from typing import TYPE_CHECKING

import numpy as np

from tendon_newton.recording import Array

if TYPE_CHECKING:
    from tendon_newton.mechanisms.mechanism import Mechanism
    from train.actuator.sensorless_motion import Motion

LINE_STIFFNESS = 1.0e4
"""Of a braided line of some 0.2 m with its knots [N/m]."""
LINE_SPREAD = 0.5
"""Standard deviation of its logarithm [1]: lines and knots differ by half."""
SPRING_SPREAD = 0.03
"""Of a bought spring's stiffness [1]: half of the usual tolerance of 5 to 7 %."""
SLACK_SPREAD = 4.0e-4
"""Of the line left when the tendon was homed by hand [m]."""
ARM_SPREAD = 0.03
"""Of a printed moment arm [1]: 0.2 mm in 8 mm."""
GUIDE_FRICTION = 0.05
"""Capstan exponent of a guide [1]: 0.1 of braid on PTFE over 30 degrees."""
GUIDE_SPREAD = 0.03


@dataclass(frozen=True, kw_only=True)
class LinePrior:
    """What is known of a bench before anything is recorded.

    The numbers are log(kappa / (N/m)) [1], s [m], psi [1] and the moment arms [m].
    """

    bench: str
    mean: Array
    """Shape (3 + J,)."""
    spread: Array
    """Standard deviations, shape (3 + J,)."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """One bench's tendon."""

    bench: str
    stiffness: float
    """kappa [N/m]"""
    slack: float
    """s [m]"""
    friction: float
    """psi [1]"""
    arms: tuple[float, ...] = ()
    """Moment arms [m]; none on a slider."""

    def tension(self, motion: Motion) -> Array:
        """Return the tension that a motion implies [N], shape (T,); a line never pushes."""
        stretch = motion.wound - self.slack - motion.joints @ np.array(self.arms)
        return np.maximum(0.0, self.stiffness * stretch * (1.0 + self.friction * motion.direction))


def line_prior(bench: str, mechanism: Mechanism) -> LinePrior:
    """Return what a bench's asset and a handbook say about its tendon."""
    arms = mechanism.tendons[0].moment_arm
    if arms.size == 1:
        spring = mechanism.joints[0].stiffness / float(arms[0]) ** 2
        seen = spring / (LINE_STIFFNESS + spring)  # share of the travel that is the line's stretch
        stiffness, spread = LINE_STIFFNESS * seen, hypot(SPRING_SPREAD, LINE_SPREAD * seen)
        arms = np.empty(0)
    else:
        stiffness, spread = LINE_STIFFNESS, LINE_SPREAD
    return LinePrior(
        bench=bench,
        mean=np.array([log(stiffness), 0.0, GUIDE_FRICTION, *arms]),
        spread=np.array([spread, SLACK_SPREAD, GUIDE_SPREAD, *(ARM_SPREAD * arms)]),
    )


def nominal_line(bench: str, mechanism: Mechanism) -> Line:
    """Return the tendon that a bench's asset and a handbook promise."""
    return line_from(bench, line_prior(bench, mechanism).mean)


def line_from(bench: str, numbers: Array) -> Line:
    """Return a tendon from its numbers in the order of `LinePrior`."""
    return Line(
        bench=bench,
        stiffness=float(np.exp(numbers[0])),
        slack=float(numbers[1]),
        friction=float(numbers[2]),
        arms=tuple(float(arm) for arm in numbers[3:]),
    )
