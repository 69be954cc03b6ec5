"""An encoder's seam inside the range, and its zero: whether it changes or lies far off."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.checks.command_checks import LIKE
from tendon_newton.data.checks.finding import Examined, Finding, Severity
from tendon_newton.data.checks.following import expected
from tendon_newton.data.checks.measures import names_of, resolution
from tendon_newton.data.checks.read_checks import LEAST_ROWS, unasked_jumps
from tendon_newton.data.checks.set_checks import OFF_ZERO
from tendon_newton.data.recording import Array, Mask, Recording

TURN = 2.0 * np.pi  # [rad]
NEAR = 0.1  # [1] of a period: how far a shaft goes within the row in which it wraps
FAR = 3.0  # [1] times the pace of all other rows: no shaft jumps so far
BITS = range(8, 17)  # of encoders
SLIPPED = 0.1  # [rad] by which a zero must change
LASTING = 1.0  # [s] before and after which it must stay
STEADY = 0.25  # [1] of the change, within which the angle keeps to its command on either side
AS_FAR = (0.8, 1.25)  # [1] times as far as its command a servo goes that nothing holds back
LESS = 0.5  # [1] of the distance to the command, which turns that are added must leave


@dataclass(frozen=True, kw_only=True, eq=False)
class Seam:
    """Rows at which a column wraps around."""

    jumps: Mask  # Before which rows, shape (T,)
    period: float  # By how much [rad]

    def mended(self, values: Array) -> Array:
        """Return a column with its turns added, shape (T,)."""
        steps = np.diff(values, prepend=values[:1])
        return values - self.period * np.cumsum(self.jumps * np.sign(steps))


def position_jumps(recording: Recording) -> Iterator[Finding]:
    """Steps of angle or command from one end to the other within a row, as a wrapped one makes."""
    for place, columns in enumerate(zip(*(names_of(recording, c) for c in ("theta", "theta_d")),
                                        strict=True)):  # fmt: skip
        for column, seam in zip(columns, seams_of(recording, place), strict=True):
            if seam is not None:
                size = "a turn" if seam.period == TURN else f"{seam.period:.4g} rad"
                yield Examined(recording.name, column).defect(
                    f"{int(seam.jumps.sum())} steps of {size} within one row, first at "
                    f"t = {recording.time[seam.jumps.argmax()]:.6g} s",
                    "the encoder wrapped around inside the range: add the turns",
                )


def without_seams(recording: Recording) -> Recording:
    """Return a recording with its turns added."""
    theta = recording.motor_position.copy()
    goal = None if recording.command is None else recording.command.copy()
    for place in range(recording.tendon_count):
        own, asked = seams_of(recording, place)
        if own is not None:
            theta[:, place] = own.mended(theta[:, place])
        if asked is not None and goal is not None:
            goal[:, place] = asked.mended(goal[:, place])
    return replace(recording, motor_position=theta, command=goal)


def seams_of(recording: Recording, place: int) -> tuple[Seam | None, Seam | None]:
    """Return the seams of angle and command whose turns bring the two together, if any.

    A command that steps while its angle goes on has no seam: its steps have any size.
    """
    theta = recording.motor_position[:, place]
    own = seam_of(theta)
    if own is None or recording.command is None:
        return own, None
    goal = recording.command[:, place]
    asked = seam_of(goal)
    if asked is not None and asked.period != TURN:
        asked = None
    apart = {
        choice: float(np.std(mended(theta, choice[0]) - mended(goal, choice[1])))
        for choice in ((None, None), (own, None), (own, asked))
    }
    best = min(apart, key=lambda choice: apart[choice])
    return best if apart[best] < LESS * apart[None, None] else (None, None)


def mended(values: Array, seam: Seam | None) -> Array:
    """Return a column with the turns of its seam, if it has one."""
    return values if seam is None else seam.mended(values)


def seam_of(values: Array) -> Seam | None:
    """Find the rows before which a column jumps from one end of its range to the other.

    Args:
        values: Angle or command [rad], shape (T,).
    """
    steps = np.abs(np.diff(values))
    span = float(np.ptp(values))
    jumps = steps > 0.5 * span
    if not jumps.any() or jumps.all() or span == 0.0:
        return None
    pace = float(steps[~jumps].max())
    ends = (steps >= span - 2.0 * pace) | (np.abs(steps - TURN) < max(NEAR * TURN, 2.0 * pace))
    if not ends[jumps].all() or steps[jumps].min() <= FAR * pace:
        return None
    period = period_of(steps[jumps], resolution(values), pace)
    return None if period is None else Seam(jumps=np.r_[False, jumps], period=period)


def period_of(sizes: Array, count: float, pace: float) -> float | None:
    """Return by what steps of these sizes wrap [rad]: a turn, or a power of two of counts."""
    for period in (TURN, *(count * 2.0**bits for bits in BITS)):
        if np.abs(sizes - period).max() < max(NEAR * period, 2.0 * pace):
            return period
    return None


def zeros(recording: Recording) -> Iterator[Finding]:
    """An angle whose zero changes amid a run, or lies far from that of its command."""
    if recording.command is None or recording.sample_count < LEAST_ROWS:
        return
    for place, column in enumerate(names_of(recording, "theta")):
        if told := changed_zero(recording, place) or far_zero(recording, place):
            yield Examined(recording.name, column).found(*told)


Told = tuple[Severity, str, str]
"""How bad it is, what was seen, and what to do."""


def changed_zero(recording: Recording, place: int) -> Told | None:
    """Say where an angle jumps and keeps to its command from another zero."""
    time = recording.time
    off, jumps = unasked_jumps(recording, place)
    edges = [0, *(int(row) + 1 for row in jumps), len(off)]
    for first, row, end in zip(edges, edges[1:], edges[2:], strict=False):
        before, after = off[first:row], off[row:end]
        change = float(np.median(after) - np.median(before))
        lasting = min(time[row - 1] - time[first], time[end - 1] - time[row])
        steady = max(float(np.std(before)), float(np.std(after))) < STEADY * abs(change)
        if abs(change) > SLIPPED and lasting > LASTING and steady:
            return (
                "defect",
                f"jumps by {change:+.3g} rad at t = {time[row]:.6g} s and stays there, as theta_d "
                "does not",
                "its zero changed there: cut the file there, or take the jump off",
            )
    return None


def far_zero(recording: Recording, place: int) -> Told | None:
    """Say how far an angle stands beside its command all along, where nothing holds it back."""
    assert recording.command is not None
    if recording.bench != "servo" or recording.force is not None:
        return None
    theta, goal = recording.motor_position[:, place], expected(recording, place)
    zero = float(np.median(theta - recording.command[:, place]))
    spread, asked = float(np.std(theta)), float(np.std(goal))
    as_far = AS_FAR[0] * asked < spread < AS_FAR[1] * asked
    if abs(zero) < OFF_ZERO or not as_far or np.corrcoef(theta, goal)[0, 1] < LIKE:
        return None
    return (
        "caution",
        f"stands {zero:+.3g} rad beside theta_d all along",
        f"the zeros of theta and theta_d differ: say offset = {-zero:.3g} for theta in the "
        "mapping, or calibrate the joint anew",
    )
