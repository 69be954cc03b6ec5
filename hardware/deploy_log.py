"""What a deployment logs beside servo and load cell: policy steps, timing and safety."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hardware import ros_messages as ros
from hardware.pilot import PilotStep
from hardware.safety import Trip
from hardware.session_log import SessionLog
from tendon_newton.errors import InvalidRecording
from tendon_newton.recording_formats.mcap_file import McapReading

STEP_TOPIC = "/policy/step"
TIMING_TOPIC = "/loop/timing"
STEP_FIELDS = ("theta", "theta_dot", "action", "previous_action", "alpha", "output",
               "applied_action", "command", "held")  # fmt: skip
"""Numbers of a message on ``/policy/step``: the sample, what the policy gave, what came of it."""
TIMING_FIELDS = ("tick", "lateness", "duration", "policy")
"""Numbers of a message on ``/loop/timing``; all but the first [s]."""
LEVELS = {"cut": "warn", "hold": "warn", "unwind": "error", "off": "error"}


class DeployLog:
    """Writes a deployment.

    Args:
        session_log: Where servo and load cell are logged too.
    """

    def __init__(self, session_log: SessionLog) -> None:
        self.session_log = session_log

    def step(self, instant: float, step: PilotStep, command: float, *, held: bool) -> None:
        """Write a step and the command [rad] that was given."""
        values = [*step.sample, step.output, step.action, command, float(held)]
        self._write(STEP_TOPIC, instant, values)

    def timing(self, instant: float, tick: int, lateness: float, duration: float,
               policy: float) -> None:  # fmt: skip
        """Write how late a tick was and how long it and the policy took [s]."""
        self._write(TIMING_TOPIC, instant, [float(tick), lateness, duration, policy])

    def trip(self, trip: Trip) -> None:
        """Write that a safety rule came into effect."""
        self.session_log.event(
            trip.instant, "safety", LEVELS[trip.action], trip.reason, rule=trip.rule.name,
            action=trip.action, since=f"{trip.since - self.session_log.time_base.start:.4f}",
        )  # fmt: skip

    def _write(self, topic: str, instant: float, values: list[float]) -> None:
        stamp = self.session_log.time_base.stamp(instant)
        self.session_log.sink.write(topic, ros.NUMBERS, stamp, ros.numbers(values))


@dataclass(frozen=True, kw_only=True, slots=True)
class LoggedStep:
    """One policy step of a log."""

    time: float
    """Stamp [s]."""
    sample: tuple[float, ...]
    """Position [rad], velocity [rad/s], both last actions [rad] and goal [rad]."""
    output: float
    """What the policy gave [rad]."""
    action: float
    """Output within the clip [rad]."""
    command: float
    """Desired spool angle that was sent [rad]."""
    held: bool
    """Whether the last command stayed instead."""


def read_steps(path: Path) -> Iterator[LoggedStep]:
    """Read the policy steps of a log, in order.

    Raises:
        InvalidRecording: It is no MCAP file, or a step has other numbers than ours.
    """
    if not path.is_file():
        raise InvalidRecording(f"{path}: a deployment's log is an MCAP file; there is none")
    with path.open("rb") as file:
        for _, stamp, message in McapReading(file, path.name).messages({STEP_TOPIC}):
            values = [float(value) for value in message.data]
            if len(values) != len(STEP_FIELDS):
                raise InvalidRecording(
                    f"{path}: a policy step has {len(STEP_FIELDS)} numbers; one has {len(values)}"
                )
            yield LoggedStep(
                time=1e-9 * stamp, sample=tuple(values[:5]), output=values[5], action=values[6],
                command=values[7], held=bool(values[8]),
            )  # fmt: skip
