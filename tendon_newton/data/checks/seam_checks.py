"""An encoder's seam inside the range: an angle that leaves at one end and comes in at the other."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.measures import names_of, resolution
from tendon_newton.data.recording import Array, Mask, Recording

TURN = 2.0 * np.pi  # [rad]
NEAR = 0.1  # [1] of a period: how far a shaft goes within the row in which it wraps
FAR = 3.0  # [1] times the pace of all other rows: no shaft jumps so far
BITS = range(8, 17)  # of encoders
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
                    f"{int(seam.jumps.sum())} steps of {size} within one row, first at row "
                    f"{int(seam.jumps.argmax())}",
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
    """Return the seams of angle and command whose turns bring the two together, if any."""
    theta = recording.motor_position[:, place]
    own = seam_of(theta)
    if recording.command is None:
        return own, None
    goal = recording.command[:, place]
    asked = seam_of(goal)
    if asked is not None and asked.period != TURN:
        asked = None  # steps of a command have any size
    choices = [(one, two) for one in {own, None} for two in {asked, None}]
    apart = {
        choice: float(np.std(mended(theta, choice[0]) - mended(goal, choice[1])))
        for choice in choices
    }
    best = min(choices, key=lambda choice: (apart[choice], choice != (None, None)))
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
