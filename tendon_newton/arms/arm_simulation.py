"""All servos of an arm at once: each gives way to the arm's weight and to what the tip rests on.

Each servo is simulated alone under the loads of a posture. The posture that comes of it gives the
next loads, until both agree: a servo's own answer changes its load by a few percent, so that some
rounds are enough. The force under the tip grows where the tip is below the floor.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.mechanisms.geometry.joints import ReadOnlyArrays
from tendon_newton.simulation.hosts.replay import Replay

# Rounds of an arm that meets nothing: the third moves an SO-101 by less than 0.1 mrad
FREE_ROUNDS = 3
FLOOR_ROUNDS = 25  # Rounds at most where its tip meets the floor
# Depth below the floor [m] that is left: an SO-101's tip moves by more with an encoder's count
SETTLED = 3.0e-4
# Share of the rows that are no deeper than that [1]; where a tip lands, a row may be
DEEP_ROWS = 0.99
SHARE = 0.7  # Share of the depth that the force of a round is to take away: servos answer it late
# Way of the tip by a force [m/N] from which on a floor is felt: a servo six times stiffer than an
# STS3215 at its gain 32 on a lever of 0.2 m. Nothing that stiff is lifted by the force of a table.
LEAST_LIFT = 1.0e-4


@dataclass(frozen=True, kw_only=True)
class SimulatedMotion(ReadOnlyArrays):
    """What an arm's servos do in one motion."""

    angles: Array  # [rad], shape (T, J)
    loads: Array  # Torque of gravity and of the floor at each servo [N m], shape (T, J)
    force: Array  # Force of the floor on the tip [N], shape (T,)
    # How deep below the floor the tip still is, or how high where it is pushed [m]
    depth: float = 0.0


def simulate_arm(
    arm: Arm, models: Mapping[int, Model], motions: Sequence[ArmMotion]
) -> list[SimulatedMotion]:
    """Simulate servos of an arm together; those without a model are led along what was measured."""
    states = [start_of(arm, models, motion) for motion in motions]
    moving, rounds = list(range(len(motions))), 0
    servos: dict[int, Replay] = {}
    while moving and rounds < FLOOR_ROUNDS:
        rounds += 1
        angles = [states[k].angles.copy() for k in moving]
        for j, model in models.items():
            loads = [states[k].loads[:, j] for k in moving]
            if j not in servos:
                own = [motions[k].recordings[j] for k in moving]
                servos[j] = Replay([loaded(r, n) for r, n in zip(own, loads, strict=True)], model)
            for out, trajectory in zip(angles, servos[j].run(loads), strict=True):
                out[:, j] = trajectory.motor_position[:, 0]
        for k, own in zip(moving, angles, strict=True):
            states[k] = next_round(arm, models, own, states[k].force)
        if rounds >= FREE_ROUNDS and any(states[k].depth <= SETTLED for k in moving):
            moving, servos = [k for k in moving if states[k].depth > SETTLED], {}
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


def next_round(
    arm: Arm, models: Mapping[int, Model], angles: Array, force: Array
) -> SimulatedMotion:
    """Return the loads of a posture (T, J) [rad], where the floor pushed by some force (T,) [N]."""
    loads = arm.weight(angles)
    if arm.floor is None:
        return SimulatedMotion(angles=angles, loads=loads, force=force)
    height, slopes = arm.tip_height(angles)
    gives = np.zeros(slopes.shape[1])
    for j, model in models.items():
        gives[j] = float(model.actuator.values.get("compliance", 0.0))
    lifted = slopes**2 @ gives  # [m/N]
    felt = lifted > LEAST_LIFT
    below = np.where(felt, arm.floor - height, 0.0)
    unbalanced = np.where(force > 0.0, np.abs(below), np.maximum(below, 0.0))
    more = SHARE * below / np.maximum(lifted, LEAST_LIFT)
    force = np.where(felt, np.maximum(force + more, 0.0), 0.0)
    return SimulatedMotion(
        angles=angles, loads=loads + force[:, None] * slopes, force=force,
        depth=float(np.quantile(unbalanced, DEEP_ROWS)),
    )  # fmt: skip
