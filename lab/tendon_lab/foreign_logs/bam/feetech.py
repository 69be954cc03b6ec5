"""What the load register of a Feetech servo tells about its firmware: duty and goal.

The loop at rest is exact in whole numbers. At n counts of error the register says kp / 4 (n - 1)
+ 16 thousandths of full duty on the side of the error, and 0 for less than two counts. The
register of a moving servo tells, together with its angle, which goal its loop has at that instant.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tendon_lab.foreign_logs.bam.motors import COUNTS_PER_RAD, BamMotor
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import NamedValues
from tendon_newton.data.recording import Array, Recording

REGISTER = 100.0  # register counts in one unit of the column ``torque``
SIGN = 1024.0  # bit 10 of the load register says which way
FULL = 1000.0  # counts of full duty
LEAST = 0.016  # [1] duty from the factory that any error gets
UNLIMITED = 0.99  # [1] beyond this duty the register says nothing of the goal
LATE = 0.1  # [rad] a goal that is so far behind its command is on its way
SPAN = 0.1  # [s] over which a goal's speed is taken: a dozen of the firmware's steps of 8 ms
ROWS = 3  # fewer are no profile


def signed_duty(columns: Mapping[str, Array]) -> Array:
    """Return the duty [1] that the column ``torque`` holds, positive where the goal is ahead."""
    counts = np.round(REGISTER * columns["torque"])
    duty = np.where(counts >= SIGN, counts - SIGN, -counts) / FULL
    ahead = columns["goal_position"] - columns["position"]
    return duty if duty @ ahead >= 0.0 else -duty


def goal_of(recording: Recording) -> Array:
    """Return the goal of the servo's loop [rad] at each row, nan where the duty is at its limit."""
    duty = recording.extra["duty"]
    gain = recording.actuator_overrides["duty_per_rad"]
    error = np.sign(duty) * (np.maximum(np.abs(duty) - LEAST, 0.0) / gain + 1.0 / COUNTS_PER_RAD)
    known = (np.abs(duty) < UNLIMITED) & recording.enabled
    return np.where(known, recording.motor_position[:, 0] + error, np.nan)


def goal_speeds(recording: Recording) -> Array:
    """Return the speeds [rad/s] of goals that are on their way to a far command."""
    assert recording.command is not None
    time, goal = recording.time, goal_of(recording)
    behind = np.abs(recording.command[:, 0] - goal) > LATE
    steps = max(1, round(SPAN / float(np.median(np.diff(time)))))
    whole = np.convolve(behind, np.ones(steps + 1), mode="valid") == steps + 1
    still = np.abs(recording.command[steps:, 0] - recording.command[:-steps, 0]) == 0.0
    moved = np.abs(goal[steps:] - goal[:-steps]) / (time[steps:] - time[:-steps])
    return moved[whole & still & np.isfinite(moved)]


def goal_speed_of(logs: Sequence[ImportedLog]) -> float | None:
    """Return the speed [rad/s] at which goals follow jumps of the command, if any does."""
    speeds = [goal_speeds(log.recording) for log in logs if "duty" in log.recording.extra]
    every = np.concatenate(speeds) if speeds else np.zeros(0)
    return float(every.mean()) if every.size >= ROWS else None


def firmware_of(logs: Sequence[ImportedLog], motor: BamMotor) -> tuple[NamedValues, ...]:
    """Return what the firmware does besides its law: factory registers, and a goal's speed."""
    speed = goal_speed_of(logs) if motor.load_is_duty else None
    if speed is None:
        return motor.effects
    return (NamedValues(name="command_rate_limit", values={"limit": speed}), *motor.effects)


def goal_findings(logs: Sequence[ImportedLog], motor: BamMotor) -> Iterator[Finding]:
    """Say that the servo acts on another goal than the command."""
    speed = goal_speed_of(logs) if motor.load_is_duty else None
    if speed is not None:
        yield Examined("all", "theta_d").caution(
            f"after a jump of the command the duty grows as if the goal moved at "
            f"{speed:.2f} rad/s ({speed * COUNTS_PER_RAD:.0f} counts/s)",
            "the firmware limits the speed of its goal: the model has "
            "command_rate_limit, fitted to the train logs' duty",
        )


def feetech_findings(log: ImportedLog) -> Iterator[Finding]:
    """Say what became of the column ``torque``."""
    if "duty" in log.recording.extra:
        yield Examined(log.recording.name, "duty").note(
            "the column torque is the load register over 100: values from 10.24 on have "
            "the sign bit",
            "read as a duty with a sign; no torque was measured",
        )


def unmeasured_load(recording: Recording, columns: Mapping[str, Array]) -> Iterator[Finding]:
    """Name a load that was never measured."""
    if "load" in columns and not columns["load"].any():
        yield Examined(recording.name, "load").note(
            f"0 in all {recording.sample_count} rows",
            "the load was not measured: no column is made of it",
        )
