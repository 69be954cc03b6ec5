"""How a servo answers to its shaft, read off the recordings that a network is trained on.

A network that has only seen a bench move as it moves by itself cannot tell what of a force is the
servo's and what the mechanism's: on a spring both agree on every row. Rows of several benches can.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tendon_newton.force_network_card import HOLD_LIMIT, PLAIN_HOLD, HoldLaw

if TYPE_CHECKING:
    from train.actuator.windows import Windows

SLIDING = 0.15
"""Speed from which a gear slides for certain [rad/s]: six steps of a DYNAMIXEL X register."""
TAUT = 0.3
"""Tension from which a tendon does not hang [N]."""
FEWEST = 200
"""Fewer rows that slide say nothing."""


def fit_servo_law(windows: Windows) -> HoldLaw:
    r"""Return stiffness and damping of a servo with friction, by least squares over sliding rows.

    .. math:: F = P (\theta_d - \theta) - D \dot\theta - (c + \mu F) \operatorname{sign} \dot\theta

    Of the four numbers friction's two are not kept: what they explain must not pass for damping.
    Where rows are too few, or a number would push, nothing is known and the force is held.
    """
    rows = np.unique(windows.last)
    command, angle, speed = windows.inputs[rows].T
    force = windows.force[rows]
    chosen = (np.abs(speed) > SLIDING) & (force > TAUT)
    if np.count_nonzero(chosen) < FEWEST:
        return PLAIN_HOLD
    side = np.sign(speed)
    terms = np.stack([command - angle, -speed, -side, -side * force], axis=1)[chosen]
    found, *_ = np.linalg.lstsq(terms, force[chosen])
    stiffness, damping = (float(np.clip(value, 0.0, HOLD_LIMIT)) for value in found[:2])
    return HoldLaw(stiffness=stiffness, damping=damping)
