"""A policy that turns a ball in a hand, and fingers that open while the ball is out of its cup."""

from collections.abc import Sequence
from typing import Protocol

from tendon_hardware.control.pilot import PilotStep, PolicyPilot
from tendon_hardware.control.policy_runner import Policy
from tendon_hardware.servos.base import ServoState


class Eye(Protocol):
    """What sees the ball."""

    @property
    def place(self) -> tuple[float, float, float]:
        """Where the ball was seen last, from where it was at first, in the base's axes [m]."""
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
        return PolicyPilot(self._policy, lambda: self._eye.place)

    def _open(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Let all strings out."""
        positions = tuple(state.position for state in states)
        offsets = tuple(
            home - position for home, position in zip(self._homes, positions, strict=True)
        )
        none = (0.0,) * len(states)
        velocities = tuple(state.velocity for state in states)
        return PilotStep(
            sample=(*positions, *velocities, *none, *none, goal, *self._eye.place),
            output=none,
            action=offsets,
            command=self._homes,
        )
