"""What an arm's tip rests on: a floor is there if servos together stop short where it would be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.arms.arm_simulation import SimulatedMotion, simulate_arm
from tendon_newton.data.model_file import Model

# Way [m] by which a free arm must go deeper than the measured one before a floor is looked for
DEEPER = 0.005
# Heights that are tried above the lowest place at which the tip was [m]: on one table an SO-101's
# lowest places are 10 mm apart (docs/lab/so101.md)
HEIGHTS = 0.004 * np.arange(4)
# Way of the tip by a servo [m/rad] from which on it can stop the servo short: a servo that is off
# by 0.1 rad moves it by 1 mm, a quarter of a step of the heights
LIFTS = 0.01
# Share of the squared error that a floor may leave of those motions, to be believed. Chosen: more
# than the one number of a floor takes away by chance, and less than a table does.
LESS = 0.9


def find_floor(arm: Arm, models: Mapping[int, Model], motions: Sequence[ArmMotion]) -> Arm:
    """Return an arm with the floor that its motions show, or as it is."""
    if arm.mechanism.tip is None:
        return arm
    heights, slopes = zip(*(arm.tip_height(motion.angles) for motion in motions), strict=True)
    lifts = np.abs(np.concatenate(slopes)).max(axis=0) > LIFTS
    models = {j: model for j, model in models.items() if lifts[j]}
    free = simulate_arm(arm, models, motions)
    low = min(float(height.min()) for height in heights)
    deep = [
        (motion, state)
        for motion, state in zip(motions, free, strict=True)
        if arm.tip_height(state.angles)[0].min() < low - DEEPER
    ]
    if not deep:
        return arm
    those = [motion for motion, _ in deep]
    arms = [replace(arm, floor=low + float(height)) for height in HEIGHTS]
    errors = [squared_error(those, simulate_arm(tried, models, those)) for tried in arms]
    best = int(np.argmin(errors))
    believed = errors[best] < LESS * squared_error(those, [state for _, state in deep])
    return arms[best] if believed else arm


def squared_error(motions: Sequence[ArmMotion], states: Sequence[SimulatedMotion]) -> float:
    """Return the sum of all servos' squared errors [rad2]."""
    pairs = zip(motions, states, strict=True)
    return sum(float(np.sum((state.angles - motion.angles) ** 2)) for motion, state in pairs)
