"""What a deployment logs beside servo and load cell: policy steps, timing and safety."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tendon_hardware.control.pilot import PilotStep
from tendon_hardware.logs import ros_messages as ros
from tendon_hardware.logs.session_log import SessionLog
from tendon_hardware.safety_rules.rules_applied import Trip
from tendon_newton.data.cards.policy_observation import GOALS, Task
from tendon_newton.data.formats.mcap_file import messages_of
from tendon_newton.errors import InvalidRecording

STEP_TOPIC = "/policy/step"
TIMING_TOPIC = "/loop/timing"
STEP_FIELDS = (
    "theta",
    "theta_dot",
    "action",
    "previous_action",
    "alpha",
    "output",
    "applied_action",
    "command",
    "held",
)
"""Numbers of a message on ``/policy/step``: the sample, the policy's output, the command.

With several servos all but ``alpha`` and ``held`` stand once per servo, and a policy that turns a
ball has rate and place of the ball in place of ``alpha``: see `step_fields`.
"""
TIMING_FIELDS = ("tick", "lateness", "duration", "policy")
"""Numbers of a message on ``/loop/timing``; all but the first [s]."""
COMMON_FIELDS = ("alpha", "held")  # Fields that do not belong to a servo
SERVO_FIELDS = len(STEP_FIELDS) - len(COMMON_FIELDS)  # Numbers of a step for each servo
LEVELS = {"cut": "warn", "hold": "warn", "unwind": "error", "off": "error"}


def step_fields(servos: int, task: Task = "tip") -> tuple[str, ...]:
    """Return the names of the numbers of a step of some servos."""
    names: list[str] = []
    for name in STEP_FIELDS:
        if name == "alpha":
            names += [goal for goal, _ in GOALS[task]]
        elif name in COMMON_FIELDS or servos == 1:
            names.append(name)
        else:
            names += [f"{name}_{d}" for d in range(servos)]
    return tuple(names)


def servo_count_of(width: int) -> int | None:
    """Return of how many servos a step of so many numbers is, or nothing where of none."""
    for goals in GOALS.values():
        servos, rest = divmod(width - len(goals) - 1, SERVO_FIELDS)
        if servos >= 1 and not rest:
            return servos
    return None


class DeployLog:
    """Writes a deployment."""

    def __init__(self, session_log: SessionLog) -> None:
        self.session_log = session_log

    def step(
        self, instant: float, step: PilotStep, command: Sequence[float], *, held: bool
    ) -> None:
        """Write a step and the commands [rad] that were given."""
        values = [*step.sample, *step.output, *step.action, *command, float(held)]
        self._write(STEP_TOPIC, instant, values)

    def timing(
        self, instant: float, tick: int, lateness: float, duration: float, policy: float
    ) -> None:
        """Write how late a tick was and how long it and the policy took [s]."""
        self._write(TIMING_TOPIC, instant, [float(tick), lateness, duration, policy])

    def trip(self, trip: Trip, *, alarm: bool = True) -> None:
        """Write that a safety rule came into effect; the planned end of a run is no alarm."""
        self.session_log.event(
            trip.instant,
            "safety",
            LEVELS[trip.action] if alarm else "ok",
            trip.reason,
            rule=trip.rule.name,
            action=trip.action,
            since=f"{trip.since - self.session_log.time_base.start:.4f}",
        )

    def _write(self, topic: str, instant: float, values: list[float]) -> None:
        stamp = self.session_log.time_base.stamp(instant)
        self.session_log.sink.write(topic, ros.NUMBERS, stamp, ros.numbers(values))


@dataclass(frozen=True, kw_only=True, slots=True)
class LoggedStep:
    """Sample, output and command of one policy step of a log."""

    time: float  # Stamp [s]
    sample: tuple[float, ...]  # What the policy saw: see `PilotStep`
    output: tuple[float, ...]  # Output of the policy for each servo [rad]
    action: tuple[float, ...]  # Outputs within the clip [rad]
    command: tuple[float, ...]  # Desired spool angles that were sent [rad]
    held: bool  # Whether the last command stayed instead

    @property
    def goal(self) -> float:
        """Goal angle [rad], or rate [rad/s] of a policy that turns a ball."""
        return self.sample[4 * len(self.command)]

    @property
    def seen(self) -> tuple[float, ...]:
        """What was seen of a ball [m]; nothing of a policy without one."""
        return self.sample[4 * len(self.command) + 1 :]


def read_steps(path: Path) -> Iterator[LoggedStep]:
    """Read the policy steps of a log, in order.

    Raises:
        InvalidRecording: The file is no MCAP file, or a step has other numbers than ours.
    """
    if not path.is_file():
        raise InvalidRecording(f"{path}: a deployment's log is an MCAP file; there is none")
    for _, stamp, message in messages_of(path, STEP_TOPIC):
        values = tuple(float(value) for value in message.data)
        servos = servo_count_of(len(values))
        if servos is None:
            raise InvalidRecording(
                f"{path}: a policy step has {len(STEP_FIELDS)} numbers, and {SERVO_FIELDS} more "
                f"for each further servo; one has {len(values)}"
            )
        sample, results = values[: -3 * servos - 1], values[-3 * servos - 1 : -1]
        yield LoggedStep(
            time=1e-9 * stamp,
            sample=sample,
            output=results[:servos],
            action=results[servos : 2 * servos],
            command=results[2 * servos :],
            held=bool(values[-1]),
        )


def step_table(path: Path) -> NDArray[np.float64]:
    """Return stamp [s], motor angles [rad], goal and commands [rad] of each step of a log.

    The shape is (T, 2 D + 2).
    """
    rows = [
        (step.time, *step.sample[: len(step.command)], step.goal, *step.command)
        for step in read_steps(path)
    ]
    return np.array(rows, dtype=np.float64)
