"""Sources of a deployment's commands: a policy, with a ball or without, or a hand at the keys."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Protocol

import numpy as np

from tendon_hardware.control.policy_runner import Policy
from tendon_hardware.servos.base import ServoState
from tendon_newton.data.cards.policy_observation import (
    ObservationHistory,
    applied_action,
    behind_now,
    motor_command,
)

JOG_SPEED = 0.5  # Speed at which a hand at the keys moves the command [rad/s]


@dataclass(frozen=True, kw_only=True, slots=True)
class PilotStep:
    """Action that a pilot wants now, and the sample behind it."""

    # Positions [rad], velocities [rad/s], both last actions [rad], the goal [rad, or rad/s of a
    # policy that turns] and what is seen of a ball [rad, m], as float32
    sample: tuple[float, ...]
    output: tuple[float, ...]  # Output for each servo before any cut [rad], maybe no number
    action: tuple[float, ...]  # Outputs within the clip [rad]; zero where the output is no number
    command: tuple[float, ...]  # Desired spool angles [rad]

    @property
    def goal(self) -> float:
        """The goal in the sample."""
        return self.sample[4 * len(self.command)]


class Pilot(Protocol):
    """Decides a command for each servo per step."""

    def step(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Look at the servos and the goal [rad] and decide."""
        ...

    def apply(self, step: PilotStep | None) -> None:
        """Note that a step's command was given, or with ``None`` that the last one stays."""


class PolicyPilot:
    """Lets a policy decide, as in training.

    Args:
        see: Gives what is seen of a ball for a commanded rate [rad/s].
    """

    def __init__(
        self, policy: Policy, see: Callable[[float], tuple[float, ...]] = lambda rate: ()
    ) -> None:
        card = policy.card
        self._policy = policy
        self._clip = card.action_clip
        self._ranges = tuple(zip(card.command_ranges, card.pay_outs, strict=True))
        self._goals = card.goal_range
        self._see = see
        self._history = ObservationHistory(
            history=card.history, servos=card.servo_count, task=card.task
        )
        self._width = len(card.observation)
        self._action = (0.0,) * card.servo_count

    def step(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Look at the servos and the goal, cut to those of training, and let it decide."""
        goal = min(max(goal, self._goals[0]), self._goals[1])
        observation = self._history.observe(
            [state.position for state in states],
            [state.velocity for state in states],
            [goal],
            self._see(goal),
        )
        output = self._policy(observation)
        action = tuple(
            float(applied_action(np.float32(value), self._clip)) if isfinite(value) else 0.0
            for value in output
        )
        command = tuple(
            float(motor_command(np.float64(state.position), np.float64(offset), *limits))
            for state, offset, limits in zip(states, action, self._ranges, strict=True)
        )
        sample = tuple(float(value) for value in observation[0, -self._width :])
        return PilotStep(sample=sample, output=output, action=action, command=command)

    def apply(self, step: PilotStep | None) -> None:
        """Note the action that is applied from now on."""
        if step is not None:
            self._action = step.action
        self._history.act(self._action)


class JogPilot:
    """Lets a hand decide for one servo: the goal is the spool angle itself, approached slowly.

    Args:
        rate: Steps per second [Hz].
        command_range: Least and greatest command [rad].
    """

    def __init__(self, rate: float, command_range: tuple[float, float]) -> None:
        self._step = JOG_SPEED / rate
        self._range = command_range
        self._command: float | None = None

    def step(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Move the command towards the goal [rad] by a step at most."""
        (state,) = states
        before = state.position if self._command is None else self._command
        wanted = min(max(goal, self._range[0]), self._range[1])
        command = min(max(wanted, before - self._step), before + self._step)
        sample = (state.position, state.velocity, 0.0, 0.0, goal)
        offset = (command - state.position,)
        return PilotStep(sample=sample, output=offset, action=offset, command=(command,))

    def apply(self, step: PilotStep | None) -> None:
        """Note the command that was given."""
        if step is not None:
            (self._command,) = step.command


class Eye(Protocol):
    """What sees the ball."""

    @property
    def place(self) -> tuple[float, float, float]:
        """Where the ball was seen last, from where it was at first, in the base's axes [m]."""
        ...

    @property
    def turned(self) -> float:
        """Turn about the task's axis that was seen [rad]."""
        ...

    @property
    def lost(self) -> bool:
        """Whether the ball is out of its cup, or nowhere to be seen."""
        ...


class BallPilot:
    """Lets a policy turn a ball; a lost ball has to be put back between open fingers.

    With the ball back the policy begins anew, as at the start of an episode of its training.
    """

    def __init__(self, policy: Policy, eye: Eye) -> None:
        self._policy, self._eye = policy, eye
        self._homes = tuple(low for low, _ in policy.card.command_ranges)
        self._inner = self._fresh()
        self._waits = False

    def step(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Look at servos, ball and commanded rate [rad/s] and decide."""
        if self._eye.lost:
            self._waits = True
            return self._open(states, goal)
        if self._waits:
            self._waits, self._inner = False, self._fresh()
        return self._inner.step(states, goal)

    def apply(self, step: PilotStep | None) -> None:
        """Note the action that is applied from now on."""
        if not self._waits:
            self._inner.apply(step)

    def _fresh(self) -> PolicyPilot:
        self._behind, self._turned = np.float32(0.0), self._eye.turned
        return PolicyPilot(self._policy, self._see)

    def _see(self, rate: float) -> tuple[float, ...]:
        """Return how far the ball is behind [rad] now, and where it is [m]."""
        turned, before = self._eye.turned, self._turned
        asked = np.float32(rate / self._policy.card.rate)
        self._behind = behind_now(self._behind, asked, np.float32(turned - before))
        self._turned = turned
        return (float(self._behind), *self._eye.place)

    def _open(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Let all strings out."""
        positions = tuple(state.position for state in states)
        offsets = tuple(
            home - position for home, position in zip(self._homes, positions, strict=True)
        )
        none = (0.0,) * len(states)
        velocities = tuple(state.velocity for state in states)
        return PilotStep(
            sample=(*positions, *velocities, *none, *none, goal, 0.0, *self._eye.place),
            output=none,
            action=offsets,
            command=self._homes,
        )
