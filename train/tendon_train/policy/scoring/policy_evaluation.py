"""Let policies climb stairs of goals in simulation, step for step as they are deployed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.data.cards.policy_observation import (
    ObservationHistory,
    applied_action,
    goal_angle,
    motor_command,
)
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.joints import freeze_arrays
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import closing_path, closing_tendons
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.force_model import open_force_model
from tendon_train.policy.worlds.goal_path import GoalPath
from tendon_train.policy.worlds.randomisation import Randomiser, effects_of, ranges_of
from tendon_train.policy.worlds.world_draws import WorldDraws


@dataclass(frozen=True, kw_only=True)
class RunnablePolicy:
    """A policy that was loaded from its file."""

    name: str
    card: PolicyCard
    run: Callable[[Any], Any]
    """Gives the outputs [rad] of one observation, a row in float32: one for each servo."""


@dataclass(frozen=True, kw_only=True)
class Climb:
    """Motion of one policy on stairs of goals; the first world is the nominal one."""

    policy: str
    place: str  # Simulation or bench of the climb, in words
    time: Array  # Instants of the policy's steps [s], shape (T,)
    goal: Array  # Goal angles [rad], shape (T,)
    tip: Array  # The tip in the base frame [m], shape (T, W, 3)
    tip_angle: Array  # Goal angle that the tip is at [rad], shape (T, W)
    goal_point: Array  # Goal point of the tip [m], shape (T, 3)
    command: Array  # Desired angles of the first motor [rad], shape (T, W)
    motor_position: Array  # Angles of the first motor [rad], shape (T, W)

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def error(self) -> Array:
        """Distance between tip and goal point [m], shape (T, W)."""
        return np.linalg.norm(self.tip - self.goal_point[:, None], axis=-1)


def climb_stairs(
    policies: Sequence[RunnablePolicy], goals: Array, config: EnvironmentConfig, *, seed: int = 0
) -> list[Climb]:
    """Run each policy on the same worlds and goals.

    Args:
        goals: Goal angle of each step [rad], shape (T,).
        config: Its finger, force, numbers to randomise and number of worlds; the first world is
            nominal.

    Raises:
        InvalidParameter: A policy has another rate than the stairs.
    """
    climbs = []
    for policy in policies:
        if policy.card.rate != config.rate:
            raise InvalidParameter(
                f"{policy.name}: the stairs are walked at {config.rate:g} Hz; the policy was "
                f"trained at {policy.card.rate:g} Hz"
            )
        climbs.append(climb(policy, goals, config, seed))
    return climbs


def climb(policy: RunnablePolicy, goals: Array, config: EnvironmentConfig, seed: int) -> Climb:
    """Run one policy from rest with the motor at home."""
    loop, mechanism, place = make_worlds(config, seed)
    card = policy.card
    if loop.tendon_count != card.servo_count:
        raise InvalidParameter(
            f"{policy.name}: the policy drives {card.servo_count} servos; {config.finger!r} has "
            f"{loop.tendon_count}"
        )
    history = ObservationHistory(config.worlds, card.history, card.servo_count)
    least, greatest = np.array(card.command_ranges, dtype=np.float32).T
    pay_out = None
    if card.pay_out is not None:
        home, wound_in = np.array(card.pay_outs, dtype=np.float32).T
        pay_out = home, wound_in
    at_rest = least if pay_out is None else pay_out[0]
    loop.reset(torch.from_numpy(np.tile(at_rest, (config.worlds, 1))))
    rows: list[tuple[Array, ...]] = []
    for goal in goals:
        reading = loop.reading
        assert reading.tip is not None
        position = reading.motor_position.numpy()
        seen = history.observe(position, reading.motor_velocity.numpy(), goal)
        output = np.array([np.ravel(policy.run(row[None])) for row in seen], np.float32)
        action = applied_action(output, card.action_clip)
        command = motor_command(position, action, (least, greatest), pay_out)
        rows.append((reading.tip.numpy().copy(), command[:, 0], position[:, 0].copy()))
        history.act(action)
        loop.step(torch.from_numpy(command))
        loop.require_finite()
    tip, command, position = (np.array(column) for column in zip(*rows, strict=True))
    return Climb(
        policy=policy.name,
        place=place,
        time=np.arange(len(goals)) / config.rate,
        goal=goals,
        tip=tip,
        tip_angle=angles_of(mechanism, tip),
        goal_point=goal_points(mechanism, goals),
        command=command,
        motor_position=position,
    )


def make_worlds(config: EnvironmentConfig, seed: int) -> tuple[ControlLoop, Mechanism, str]:
    """Return the worlds of an evaluation, on the CPU: the first nominal, the others drawn."""
    mechanism = load_mechanism(config.finger)
    force = open_force_model(config.force, mechanism)
    ranges = ranges_of(config, force.model)
    loop = ControlLoop(
        mechanism,
        force.model,
        config.worlds,
        rate=config.rate,
        max_step=config.max_step,
        precision="float64",
        effects=effects_of(ranges),
        device="cpu",
    )
    others = torch.ones(config.worlds, dtype=torch.bool)
    others[0] = False
    draws = WorldDraws(config.worlds, seed=seed)
    randomiser = Randomiser(loop, ranges, joint_friction=config.joint_friction, draws=draws)
    randomiser.draw(others)
    return loop, mechanism, f"simulation, {force.name}"


def angles_of(mechanism: Mechanism, tip: Array) -> Array:
    """Return the goal angles [rad] at which tips [m] are, shape (...) for (..., 3)."""
    seen = tip - posture(mechanism, np.zeros(len(mechanism.joints))).anchor[0]
    return goal_angle(seen[..., 0], seen[..., 2])


def goal_points(mechanism: Mechanism, goals: Array) -> Array:
    """Return the goal points [m] of goal angles [rad], shape (T, 3)."""
    path = GoalPath(mechanism)
    path.require((float(np.min(goals)), float(np.max(goals))))
    return path.points(torch.tensor(goals, dtype=torch.float32)).numpy().astype(np.float64)


def reachable_error(mechanism: Mechanism, goals: Array) -> Array:
    """Return how near to each goal point the nominal tip can rest under gravity [m], shape (T,).

    No policy does better there for long: gravity bends the finger even where the tendon is slack.
    A tendon that opens can hold it up, and then nothing is known: 0.
    """
    closing = closing_tendons(mechanism)
    if len(closing) < len(mechanism.tendons):
        return np.zeros(len(goals))
    resting = closing_path(mechanism, tendon=closing).tip
    assert resting is not None
    gaps = goal_points(mechanism, goals)[:, None] - resting[None]
    return np.min(np.linalg.norm(gaps, axis=-1), axis=1)
