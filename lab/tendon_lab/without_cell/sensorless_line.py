r"""The tendon as its own load cell.

.. math::
    F = \kappa \, (r \theta - s - \textstyle\sum_j a_j q_j) \, (1 + \psi d)

On a slider, of which only the spool is seen, ``kappa`` is its spring in series with the line. On a
finger the tip tells the joint angles, ``a`` are the moment arms and ``kappa`` is the stiffness of
the line alone. Springs, damping, weight and obstacles do not enter. ``s`` is the length wound in
before the line was taut, and ``d`` the direction of winding. ``psi`` is the share by which the
spool feels more than the mechanism (capstan friction at the guide). The camera that sees the tip
may be off by a constant, which ``q`` is freed of.

Left out: mass and damping of a slider (0.4 N at 0.08 m/s and 5 N s/m), an eccentric encoder.
"""

from dataclasses import dataclass

import numpy as np

from tendon_lab.without_cell.sensorless_motion import SensorlessMotion
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

LINE_STIFFNESS = 1.0e4  # Stiffness of a braided line of some 0.2 m with its knots [N/m]
LINE_SPREAD = 0.5
"""Standard deviation of its logarithm [1], the same for all benches: lines differ by half."""
KNOT_SPREAD = 0.15
"""Standard deviation of it between benches [1]: one line on all of them, cut and knotted anew."""
SPRING_SPREAD = 0.03
"""Standard deviation of a bought spring's stiffness [1]: half of the usual 5 to 7 %."""
SLACK = 3.2e-4
"""Slack of a tendon homed by hand [m]: mean of what is never negative and 0.4 mm as a rule."""
SLACK_SPREAD = 2.4e-4  # Standard deviation of that slack [m]
ARM_SPREAD = 0.03  # Standard deviation of a printed moment arm [1]: 0.2 mm in 8 mm
CAMERA_SPREAD = 5.0e-4
"""Spread of a camera's offset [m], along x and along z, all along a bench's recordings."""
GUIDE_FRICTION, GUIDE_SPREAD = 0.05, 0.03
"""Capstan exponent of a guide [1]: 0.1 of braid on PTFE over 30 degrees."""
FINGER_FRICTION, FINGER_SPREAD = 0.08, 0.04
"""Capstan exponent with a finger behind the guide [1]: joints bend the line by up to 3 rad more."""


@dataclass(frozen=True, kw_only=True)
class LinePrior:
    """What is known of a bench before anything is recorded."""

    bench: str
    give: float
    """Give of a slider's spring at the line [m/N]; none on a finger, whose joints are seen."""
    friction: float  # psi [1]
    friction_spread: float  # Standard deviation of psi [1]
    arms: tuple[float, ...] = ()  # Moment arms [m]; none on a slider


@dataclass(frozen=True, kw_only=True)
class Line:
    """Tendon of one bench, with the numbers that are to be found."""

    bench: str
    stiffness: float  # kappa [N/m]
    slack: float  # s [m]
    friction: float  # psi [1]
    arms: tuple[float, ...] = ()  # Moment arms [m]; none on a slider
    camera: tuple[float, ...] = ()  # Offset of the camera in x and z [m]; none on a slider

    def tension(self, motion: SensorlessMotion) -> Array:
        """Return the tension that a motion implies [N], shape (T,); a line never pushes."""
        joints = motion.joints_seen_by(self.camera)
        stretch = motion.wound - self.slack - joints @ np.array(self.arms)
        return np.maximum(0.0, self.stiffness * stretch * (1.0 + self.friction * motion.direction))


def line_prior(bench: str, mechanism: Mechanism) -> LinePrior:
    """Return what a bench's asset and a handbook say about its tendon."""
    arms = mechanism.tendons[0].moment_arm
    if arms.size == 1:
        give = float(arms[0]) ** 2 / mechanism.joints[0].stiffness
        return LinePrior(
            bench=bench, give=give, friction=GUIDE_FRICTION, friction_spread=GUIDE_SPREAD
        )
    return LinePrior(
        bench=bench,
        give=0.0,
        friction=FINGER_FRICTION,
        friction_spread=FINGER_SPREAD,
        arms=tuple(float(arm) for arm in arms),
    )


def nominal_line(bench: str, mechanism: Mechanism) -> Line:
    """Return the tendon that a bench's asset and a handbook promise."""
    prior = line_prior(bench, mechanism)
    return Line(
        bench=bench,
        stiffness=1.0 / (prior.give + 1.0 / LINE_STIFFNESS),
        slack=SLACK,
        friction=prior.friction,
        arms=prior.arms,
    )
