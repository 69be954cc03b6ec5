"""All servos of an arm at once: each gives way to the arm's weight and to what the tip rests on.

Each servo is simulated alone under the loads of a posture. The posture that comes of it gives the
next loads, until both agree: a servo's own answer changes its load by a few percent, so that some
rounds are enough. The force under the tip grows where the tip is below the floor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.simulation.hosts.replay import replay

FREE_ROUNDS = 3
"""Rounds of an arm that meets nothing: the third moves an SO-101 by less than 0.1 mrad."""
FLOOR_ROUNDS = 25
"""Rounds at most where its tip meets the floor."""
SETTLED = 3.0e-4
"""Depth below the floor [m] that is left: an SO-101's tip moves by more with an encoder's count."""
SHARE = 0.7
"""Share of the depth that the force of a round is to take away: servos answer it late."""


@dataclass(frozen=True, kw_only=True)
class SimulatedMotion:
    """What an arm's servos do in one motion."""

    angles: Array
    """[rad], shape (T, J)."""
    loads: Array
    """Torque of gravity and of the floor at each servo [N m], shape (T, J)."""
    force: Array
    """Of the floor on the tip [N], shape (T,)."""


def simulate_arm(
    arm: Arm, models: Mapping[int, Model], motions: Sequence[ArmMotion]
) -> list[SimulatedMotion]:
    """Simulate servos of an arm together; those without a model are led along what was measured.

    Args:
        arm: The arm.
        models: Joint -> its servo's model.
        motions: What was commanded, and where the servos were in the first row.
    """
    states = [start_of(arm, models, motion) for motion in motions]
    moving, rounds = list(range(len(motions))), 0
    while moving and rounds < FLOOR_ROUNDS:
        rounds += 1
        for j, model in models.items():
            own = [loaded(motions[k].recordings[j], states[k].loads[:, j]) for k in moving]
            for k, trajectory in zip(moving, replay(own, model), strict=True):
                states[k].angles[:, j] = trajectory.motor_position[:, 0]
        deep = [k for k in moving if renew_loads(arm, models, states[k]) > SETTLED]
        moving = moving if rounds < FREE_ROUNDS else deep
    return states


def loaded(recording: Recording, load: Array) -> Recording:
    """Return a recording with the load on its shaft [N m], shape (T,)."""
    return replace(recording, joint_load=load)


def start_of(arm: Arm, models: Mapping[int, Model], motion: ArmMotion) -> SimulatedMotion:
    """Begin where the servos are told to be, or were where they are led."""
    led = np.isin(np.arange(motion.angles.shape[1]), list(models), invert=True)
    angles = np.where(led, motion.angles, motion.commands)
    force = np.zeros(len(angles))
    return SimulatedMotion(angles=angles, loads=arm.weight(angles), force=force)


def renew_loads(arm: Arm, models: Mapping[int, Model], state: SimulatedMotion) -> float:
    """Put the loads of its posture into a state; return how deep the tip still is [m]."""
    state.loads[:] = arm.weight(state.angles)
    if arm.floor is None:
        return 0.0
    height, slopes = arm.tip_height(state.angles)
    gives = np.zeros(slopes.shape[1])
    for j, model in models.items():
        gives[j] = float(model.actuator.values.get("compliance", 0.0))
    lifted = np.maximum(slopes**2 @ gives, 1.0e-6)  # [m/N]
    below = arm.floor - height
    unbalanced = np.where(state.force > 0.0, np.abs(below), np.maximum(below, 0.0))
    state.force[:] = np.maximum(state.force + SHARE * below / lifted, 0.0)
    state.loads[:] += state.force[:, None] * slopes
    return float(np.quantile(unbalanced, 0.99))
