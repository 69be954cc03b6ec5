"""The answer of a servo to its shaft, read off the recordings that a network is trained on.

A network that has only seen a bench move by itself cannot tell the servo's part of a force from the
mechanism's. On a spring both agree on every row. Rows of several benches can.
"""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.cards.force_network_card import HOLD_LIMIT, HoldLaw
from tendon_train.actuator.samples.windows import Windows

SLIDING = 0.15
"""Speed from which a gear slides for certain [rad/s]: six steps of a DYNAMIXEL X register."""
TAUT = 0.3  # Tension from which a tendon does not hang [N]
FEWEST = 200  # Fewer rows that slide say nothing


@dataclass(frozen=True, kw_only=True)
class ServoLaw:
    r"""A servo with friction in its gear.

    .. math:: F = P (\theta_d - \theta) - D \dot\theta - (c + \mu F) \operatorname{sign} \dot\theta
    """

    stiffness: float = 0.0  # P [N/rad]
    damping: float = 0.0  # D [N s/rad]
    dry_friction: float = 0.0  # c [N]
    load_friction: float = 0.0  # mu [1]

    @property
    def hold(self) -> HoldLaw:
        """What of it a simulation uses between two queries: friction has no slope."""
        return HoldLaw(stiffness=self.stiffness, damping=self.damping)


NO_LAW = ServoLaw()  # Law of a servo of which nothing is known


def fit_servo_law(windows: Windows) -> ServoLaw:
    """Return a servo's law, by least squares over the rows in which its gear slides.

    Where rows are too few nothing is known, and of a number that would push, it is nothing.
    """
    rows = np.unique(windows.last)
    command, angle, speed = windows.inputs[rows].T
    force = windows.force[rows]
    chosen = (np.abs(speed) > SLIDING) & (force > TAUT)
    if np.count_nonzero(chosen) < FEWEST:
        return NO_LAW
    side = np.sign(speed)
    terms = np.stack([command - angle, -speed, -side, -side * force], axis=1)[chosen]
    found, *_ = np.linalg.lstsq(terms, force[chosen])
    stiffness, damping = (float(np.clip(value, 0.0, HOLD_LIMIT)) for value in found[:2])
    dry, load = (max(0.0, float(value)) for value in found[2:])
    return ServoLaw(stiffness=stiffness, damping=damping, dry_friction=dry, load_friction=load)
