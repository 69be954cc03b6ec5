"""Who decides the commands of a deployment: a policy, or a hand at the keys."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Protocol

import numpy as np

from hardware.errors import PolicyMismatch
from hardware.policy_runner import Policy
from hardware.servos.base import ServoState
from tendon_newton.policy_observation import ObservationHistory, applied_action, motor_command

JOG_SPEED = 0.5
"""Speed at which a hand at the keys moves the command [rad/s]."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PilotStep:
    """What a pilot wants now, and from what."""

    sample: tuple[float, ...]
    """Position [rad], velocity [rad/s], both last actions [rad] and goal [rad], as float32."""
    output: float
    """What was given before any cut [rad], maybe no number."""
    action: float
    """Output within the clip [rad]; zero where the output is no number."""
    command: float
    """Desired spool angle [rad]."""


class Pilot(Protocol):
    """Decides a command per step."""

    def step(self, state: ServoState, goal: float) -> PilotStep:
        """Look at the servo and the goal [rad] and decide."""
        ...

    def apply(self, step: PilotStep | None) -> None:
        """Note that a step's command was given, or with ``None`` that the last one stays."""
        ...


class PolicyPilot:
    """Lets a policy decide, as it did in training.

    Args:
        policy: The policy.

    Raises:
        PolicyMismatch: It drives several servos.
    """

    def __init__(self, policy: Policy) -> None:
        if policy.card.servo_count > 1:
            raise PolicyMismatch(
                "a bench has one servo at its port; this policy drives "
                f"{policy.card.servo_count} together, which runs in simulation only"
            )
        self._policy = policy
        self._clip = policy.card.action_clip
        self._range = policy.card.command_range
        self._goals = policy.card.goal_range
        self._history = ObservationHistory(history=policy.card.history)
        self._action = 0.0

    def step(self, state: ServoState, goal: float) -> PilotStep:
        """Look at the servo and the goal [rad], cut to those of training, and let it decide."""
        goal = min(max(goal, self._goals[0]), self._goals[1])
        observation = self._history.observe([state.position], [state.velocity], [goal])
        output = self._policy(observation)
        action = float(applied_action(np.float32(output), self._clip)) if isfinite(output) else 0.0
        command = float(motor_command(np.float64(state.position), np.float64(action), self._range))
        sample = tuple(float(value) for value in observation[0, -5:])
        return PilotStep(sample=sample, output=output, action=action, command=command)

    def apply(self, step: PilotStep | None) -> None:
        """Note the action that is applied from now on."""
        if step is not None:
            self._action = step.action
        self._history.act([self._action])


class JogPilot:
    """Lets a hand decide: the goal is the spool angle itself, approached slowly.

    Args:
        rate: Steps per second [Hz].
        command_range: Least and greatest command [rad].
    """

    def __init__(self, rate: float, command_range: tuple[float, float]) -> None:
        self._step = JOG_SPEED / rate
        self._range = command_range
        self._command: float | None = None

    def step(self, state: ServoState, goal: float) -> PilotStep:
        """Move the command towards the goal [rad] by a step at most."""
        before = state.position if self._command is None else self._command
        wanted = min(max(goal, self._range[0]), self._range[1])
        command = min(max(wanted, before - self._step), before + self._step)
        sample = (state.position, state.velocity, 0.0, 0.0, goal)
        offset = command - state.position
        return PilotStep(sample=sample, output=offset, action=offset, command=command)

    def apply(self, step: PilotStep | None) -> None:
        """Note the command that was given."""
        if step is not None:
            self._command = step.command
