"""A logged deployment gone through again: the same observations, the same actions?"""

from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

from tendon_hardware.control.pilot import PolicyPilot
from tendon_hardware.control.policy_runner import Policy
from tendon_hardware.deployment.deploy_log import LoggedStep, read_steps
from tendon_hardware.servos.base import ServoState
from tendon_newton.errors import InvalidRecording

DIFFERENCE = 1e-5  # Greatest difference of outputs that two engines make of the same weights [rad]


@dataclass(frozen=True, kw_only=True)
class ReplayReport:
    """Comparison of a policy's actions with those in a log."""

    steps: int  # Steps that were compared
    difference: float  # Greatest difference between two outputs of a servo [rad]
    worst: float  # When that was, since the first step [s]
    broken: int  # Steps whose last actions in the log are not those that had been applied

    @property
    def same(self) -> bool:
        """Whether the policy is the one that made the log."""
        return self.difference <= DIFFERENCE and self.broken == 0

    @property
    def text(self) -> str:
        """The figures as a line."""
        return (
            f"{self.steps} steps; outputs differ by {self.difference:.2e} rad at most, "
            f"{self.worst:.2f} s after the first; {self.broken} steps with another history"
        )


def replay_log(policy: Policy, path: Path) -> ReplayReport:
    """Give a policy the observations of a log and compare what it wants with what stands there.

    Raises:
        InvalidRecording: The file holds no policy steps.
    """
    seen: tuple[float, ...] = ()
    pilot = PolicyPilot(policy, lambda rate: seen)
    steps = broken = 0
    difference = worst = start = 0.0
    for logged in read_steps(path):
        seen = logged.seen
        step = pilot.step(states_of(logged, policy.card.servo_count), logged.goal)
        start = logged.time if steps == 0 else start
        steps += 1
        broken += step.sample != logged.sample
        for found, there in zip(step.output, logged.output, strict=True):
            if isfinite(found) or isfinite(there):
                apart = abs(found - there)
                if not apart <= difference:
                    difference, worst = apart, logged.time - start
        pilot.apply(None if logged.held else replace(step, action=logged.action))
    if not steps:
        raise InvalidRecording(f"{path}: a deployment's log has policy steps; this file has none")
    return ReplayReport(steps=steps, difference=difference, worst=worst, broken=broken)


def states_of(logged: LoggedStep, servos: int) -> list[ServoState]:
    """Return what the servos said before a logged step.

    Raises:
        InvalidRecording: The log has another number of servos.
    """
    if len(logged.command) != servos:
        raise InvalidRecording(
            f"a log of {servos} servos has {7 * servos + 2} numbers per policy step; this one is "
            f"of {len(logged.command)}"
        )
    angles, speeds = logged.sample[:servos], logged.sample[servos : 2 * servos]
    return [
        ServoState(time=logged.time, position=angle, velocity=speed, current=0.0)
        for angle, speed in zip(angles, speeds, strict=True)
    ]
