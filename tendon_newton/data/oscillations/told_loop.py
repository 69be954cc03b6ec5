"""One joint of a log: does it shake, and why."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.oscillations.causes import CalmingChange, Explained, ShakingLoop, explain
from tendon_newton.data.oscillations.loop_closing import (
    AnsweringGains,
    cut_policy,
    cut_swing,
    policy_of,
    swings,
)
from tendon_newton.data.oscillations.loop_fit import RUN_IN, FittedServo, fit_servo
from tendon_newton.data.oscillations.servo_loop import Feedback
from tendon_newton.data.oscillations.shaking import Evenly, Shaking, envelope, find_shakings
from tendon_newton.data.recording import Array

TOLD = 0.7  # Share of the angle that a servo must tell for a cause to be named [1]
FITTED_PERIODS, FITTED_TIME = 16.0, 5.0
"""Periods and time [s] of a log that are fitted, at least."""
COMMANDED = 0.4  # Share of the amplitude that an independent command may have at the line [1]
HARMONICS = 9  # Of a commanded swing that are looked for, at most
LEAST_SWINGS = 2.5  # Of a command, from which what is in step with it is told
IN_STEP = 0.7  # Share of a line that must turn with a command's swing [1]
LASTING = 16.0  # Periods from which what no cause is found for counts as shaking
STANDS = 0.35  # Share of the time in which an angle stands, above which it sticks [1]
CREEPS = 0.5  # Amplitudes a period by which a command moves that does not stand [1]
LEAST_INTEGRAL = 0.05  # Of a policy that integrates [1/s]
LOOKED_AT = 2  # Lines that are looked at, the greatest first


@dataclass(frozen=True, kw_only=True)
class ToldJoint:
    """What is told of one joint."""

    log: Evenly
    shaking: Shaking | None  # None where it does not shake
    policy: AnsweringGains | None = None  # None where the command does not answer the angle
    fitted: FittedServo | None = None
    loop: ShakingLoop | None = None
    explained: Explained | None = None


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Lines of a joint that its command does not explain, the greatest first."""

    log: Evenly
    policy: AnsweringGains | None
    lines: tuple[Shaking, ...]

    @property
    def answers(self) -> bool:
        """Whether the command answers the angle."""
        cut = (cut_policy(self.log, one.frequency, one.rows) for one in self.lines)
        return self.policy is not None or any(one is not None for one in cut)


def tell_joint(log: Evenly) -> ToldJoint:
    """Tell whether a joint shakes, and what makes it."""
    return tell_lines(lines_of(log))


def lines_of(log: Evenly, others: Sequence[Array] = ()) -> Lines:
    """Find what shakes and does not follow an independent command.

    Args:
        others: Commands of the other joints, whose motion is a load of this one [rad], (T,) each.
    """
    policy = policy_of(log)
    kept = tuple(
        line
        for line in find_shakings(log)
        if not explained_by_commands(log, line, others)
        or (policy or cut_policy(log, line.frequency, line.rows)) is not None
    )
    return Lines(log=log, policy=policy, lines=kept)


def explained_by_commands(log: Evenly, line: Shaking, others: Sequence[Array]) -> bool:
    """Tell whether a line is what a command asks for, or comes of a command's slower swing.

    A limit, play and friction make harmonics of a commanded swing, and a moving arm makes those of
    its own swing in joints that stand.
    """
    if line.command_amplitude >= COMMANDED * line.amplitude:
        return True
    own = any(in_step(log, line, log.command, times) for times in range(2, HARMONICS + 1))
    return own or any(
        in_step(log, line, command, times)
        for command in others
        for times in range(1, HARMONICS + 1)
    )


def in_step(log: Evenly, line: Shaking, command: Array, times: int) -> bool:
    """Tell whether a line turns so many times as fast as a swing of a command, and with it."""
    rows = line.rows
    if rows.sum() * log.step * line.frequency < LEAST_SWINGS * times:
        return False
    asked = envelope(command, line.frequency / times, log.step)[rows]
    size = np.abs(asked)
    if np.median(size) < times * line.amplitude:
        return False
    seen = envelope(log.angle, line.frequency, log.step)[rows]
    turned = seen * np.conj(asked / np.maximum(size, 1e-12)) ** times
    return bool(np.abs(turned.sum()) > IN_STEP * np.abs(turned).sum())


def tell_lines(found: Lines) -> ToldJoint:
    """Tell what makes the first line of which that can be told; else the greatest."""
    told: ToldJoint | None = None
    for line in found.lines[:LOOKED_AT]:
        own = found.policy or cut_policy(found.log, line.frequency, line.rows)
        one = tell_line(found.log, line, own)
        if one.explained is not None and one.explained.cause is not None:
            return one
        if line.rows.sum() * found.log.step * line.frequency > LASTING:
            told = told or one
    return told or ToldJoint(log=found.log, shaking=None, policy=found.policy)


def tell_line(log: Evenly, line: Shaking, policy: AnsweringGains | None) -> ToldJoint:
    """Identify the loop that may make a line, and ask it."""
    outer = policy is not None
    part = stretch(log, line)
    integrates = policy is None or policy.integral > LEAST_INTEGRAL
    stuck = integrates and line.stands > STANDS and (outer or goal_stands(log, line))
    best = fit_servo(part, line.frequency, outer=outer, stuck=stuck)
    feedback = feedback_of(log, line, policy)
    loop = ShakingLoop(
        numbers=best.numbers,
        others=best.others,
        feedback=feedback,
        frequency=line.frequency,
        amplitude=line.amplitude,
    )
    explained = explain(loop)
    if stuck:
        off = CalmingChange(what="integral", share=0.0)
        explained = replace(explained, cause="sticking", changes=(off,))
    elif best.told < TOLD:
        explained = replace(explained, cause=None, changes=())
    return ToldJoint(
        log=log, shaking=line, policy=policy, fitted=best, loop=loop, explained=explained
    )


def goal_stands(log: Evenly, line: Shaking) -> bool:
    """Tell whether the command hardly moves while an angle stands and jumps.

    Under one that creeps on, friction alone makes an angle stand and jump.
    """
    speed = np.abs(np.diff(log.command, append=log.command[-1])) / log.step
    return bool(np.mean(speed[line.rows] > CREEPS * line.amplitude * line.frequency) < 0.5)


def feedback_of(log: Evenly, line: Shaking, policy: AnsweringGains | None) -> Feedback:
    """Return what closes the loop."""
    if policy is None:
        return Feedback(outer=False, row=log.step)
    period = round(1.0 / (line.frequency * log.step))
    cut = cut_swing(log.command, period, line.rows)
    bound = float(np.inf)
    if cut.any():
        least, most = swings(log.command, period)
        bound = 0.5 * float(np.median((most - least)[cut]))
    return Feedback(
        outer=True,
        gain=policy.gain,
        integral=max(0.0, policy.integral),
        late=policy.late,
        row=log.step,
        bound=bound,
    )


def stretch(log: Evenly, line: Shaking) -> Evenly:
    """Return the part of a log that is fitted: the shaking, and what moves it."""
    fitted = max(FITTED_TIME, FITTED_PERIODS / line.frequency)
    length = round((fitted + RUN_IN / line.frequency) / log.step)
    length = min(length, len(log.angle))
    moved = np.abs(np.diff(log.command, append=log.command[-1]))
    shakes: Array = np.cumsum(np.r_[0.0, line.rows.astype(np.float64)])
    share = (shakes[length:] - shakes[:-length]) / length
    moves = np.cumsum(np.r_[0.0, moved])
    travel = moves[length:] - moves[:-length]
    best = int(np.argmax(share + 0.1 * travel / max(float(travel.max()), 1e-12)))
    rows = slice(best, best + length)
    return Evenly(step=log.step, command=log.command[rows], angle=log.angle[rows])
