"""All joints of a log: how they follow, and which of them shake, at what frequency, by what."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.checks.frozen_checks import frozen_rows
from tendon_newton.data.checks.measures import supply_of
from tendon_newton.data.checks.read_checks import unread_angles
from tendon_newton.data.importers.joint_examination import (
    JointExamination,
    examine_joint,
    fails,
    motion_of,
)
from tendon_newton.data.oscillations.causes import NONE, CalmingChange, ShakingLoop
from tendon_newton.data.oscillations.log_reading import ReadLog
from tendon_newton.data.oscillations.loop_closing import limit_rows
from tendon_newton.data.oscillations.shaking import evenly, uninterrupted
from tendon_newton.data.oscillations.told_loop import Lines, ToldJoint, lines_of, tell_lines
from tendon_newton.data.recording import Array, Recording

DEGREE = np.pi / 180.0
ANSWERS_NOTHING = "no command"
"""Check that takes a motion beside its command for a fault of the log; a shaking explains it."""
ENDLESS = 1000  # Times the floor from which a line's height tells no more


@dataclass(frozen=True, kw_only=True)
class JointOfLog:
    """What a log tells of one joint."""

    joint: str
    followed: JointExamination
    findings: tuple[Finding, ...]  # Of the checks, in its columns
    at_limit: float  # Share of the rows in which its command is at a limit [1]
    told: ToldJoint | None  # Of the recording in which it shakes most; None where in none
    recording: str  # That recording; empty where in none
    shaken: tuple[str, ...]  # All recordings in which it shakes


def tell_log(log: ReadLog) -> Iterator[JointOfLog]:
    """Tell of one joint after the other."""
    for place, joint in enumerate(log.joints):
        wholes = [one for one in log.recordings if place < one.tendon_count]
        yield tell_joint_of(joint, place, wholes, log.findings_of(place))


def tell_joint_of(
    joint: str, place: int, wholes: Sequence[Recording], findings: Sequence[Finding]
) -> JointOfLog:
    """Tell of one joint by all recordings, and by what the checks find in its columns."""
    found: list[tuple[float, str, Lines]] = []
    limits = 0
    for whole in wholes:
        assert whole.command is not None
        since: Array = whole.time - whole.time[0]
        read = ~unread_angles(whole, place)
        known: Array = whole.motor_position[read, place]
        angle = np.interp(since, since[read], known)
        shaken: list[Lines] = []
        for rows in uninterrupted(since):
            commands = [
                evenly(since[rows], command, angle[rows]) for command in whole.command[rows].T
            ]
            others = [one.command for k, one in enumerate(commands) if k != place]
            lines = lines_of(commands[place], others)
            limits += int(limit_rows(lines.log.command).sum()) if lines.answers else 0
            shaken += [lines] if lines.lines else []
        found += [(size_of(one), whole.name, one) for one in sorted(shaken, key=size_of)[-1:]]
    worst = max(found, key=lambda one: one[0], default=None)
    told = None if worst is None else tell_lines(worst[2])
    if told is None or told.shaking is None:
        worst, told, found = None, None, []
    shaken_in = [Path(name).stem for _, name, _ in found]
    findings = [
        one
        for one in findings
        if one.check != ANSWERS_NOTHING or Path(one.recording).stem not in shaken_in
    ]
    return JointOfLog(
        joint=joint,
        followed=examine_joint(
            joint,
            {w.name: motion_of(w, frozen_rows(w), place) for w in wholes},
            [one for one in findings if fails(one)],
            [whole.motor_position[:, place] for whole in wholes],
        ),
        at_limit=limits / sum(whole.sample_count for whole in wholes),
        findings=tuple(findings),
        told=told,
        recording="" if worst is None else worst[1],
        shaken=tuple(name for _, name, _ in found),
    )


def size_of(found: Lines) -> float:
    """Return amplitude and duration of a joint's greatest line [rad s]."""
    first = found.lines[0]
    return first.amplitude * float(first.rows.sum()) * found.log.step


def supply_text(recordings: Sequence[Recording]) -> str:
    """Say what the supply is and how far it dips; nothing where it was not logged."""
    supplies = [s for one in recordings if (s := supply_of(one)) is not None]
    if not supplies:
        return ""
    usual = float(np.median(np.concatenate(supplies)))
    least = min(float(s.min()) for s in supplies)
    return f"supply {usual:.1f} V, dips to {least:.1f} V"


def shaking_lines(seen: JointOfLog) -> list[str]:
    """Say that a joint shakes, what makes it and what to change first; a line each."""
    told = seen.told
    if told is None or told.shaking is None:
        return []
    line = told.shaking
    above = f"{line.above_floor:.0f}" if line.above_floor < ENDLESS else f"over {ENDLESS}"
    step, start = told.log.step, told.log.start
    lines = [
        f"{seen.joint} shakes at {line.frequency:.2f} Hz by {line.amplitude / DEGREE:.2f} deg: "
        f"{seen.recording}, {step * line.rows.sum():.1f} s between "
        f"{start + step * line.first:.1f} and {start + step * line.last:.1f} s, {above} times "
        "the floor of its spectrum"
    ]
    if len(seen.shaken) > 1:
        lines.append(f"  and in {len(seen.shaken) - 1} more recordings")
    return [*lines, *(f"  {text}" for text in cause_lines(told))]


def cause_lines(told: ToldJoint) -> list[str]:
    """Say what closes the loop, the cause, and what calms it."""
    loop, explained, fitted = told.loop, told.explained, told.fitted
    assert told.shaking is not None
    assert loop is not None
    assert explained is not None
    assert fitted is not None
    through = "the servo's own loop; its command does not move with it"
    if loop.feedback.outer:
        through = (
            f"the policy: its command answers the angle by {loop.feedback.gain:.2g} and "
            f"{loop.feedback.integral:.2g} 1/s"
        )
    known = (
        f"loop: {through}; {1e3 * loop.number('delay'):.0f} ms of delay, "
        f"{size_text(loop, 'play')}, {size_text(loop, 'sticking')} "
        f"({100.0 * fitted.told:.0f} % of the motion told)"
    )
    if explained.cause is None:
        own = explained.own_frequency
        does = f"shakes at {own:.2f} Hz" if own else "is calm"
        lines = [f"cause: I do not know; the loop that was identified {does} by itself", known]
        return [*lines, *(f"try: {change_text(loop, change)}" for change in explained.changes)]
    words = {
        "gain": "the loop gain is too high",
        "delay": f"{1e3 * loop.number('delay'):.0f} ms of delay at this gain",
        "play": size_text(loop, "play"),
        "sticking": f"sticking of {loop.number('sticking') / DEGREE:.2f} deg with an integral term",
    }
    if explained.cause == "sticking":
        known += f"; the angle stands still for {100.0 * told.shaking.stands:.0f} % of the time"
    lines = [f"cause: {words[explained.cause]}", known]
    for k, change in enumerate(explained.changes):
        lines.append(("change first: " if k == 0 else "or: ") + change_text(loop, change))
    if not explained.changes:
        lines.append("change first: no single number calms it; measure the loop by steps")
    return lines


def size_text(loop: ShakingLoop, what: str) -> str:
    """Say how much play or sticking a loop has."""
    size = loop.number(what)
    return f"{size / DEGREE:.2f} deg of {what}" if size > 2.0 * NONE[what] else f"no {what}"


def change_text(loop: ShakingLoop, change: CalmingChange) -> str:
    """Say to what a number must be lessened for the loop to be calm."""
    share = change.share
    if change.what == "delay":
        return f"calm with less than {1e3 * share * loop.number('delay'):.0f} ms of delay"
    if change.what == "play":
        return f"calm with less than {share * loop.number('play') / DEGREE:.2f} deg of play"
    if share == 0.0:
        return f"calm without the {change.what}"
    whose = "policy's" if loop.feedback.outer else "servo's"
    own = {"gain": loop.feedback.gain, "integral": loop.feedback.integral}[change.what]
    value = f", {share * own:.3g}" if loop.feedback.outer else ""
    return f"calm below {100.0 * share:.0f} % of the {whose} {change.what}{value}"
