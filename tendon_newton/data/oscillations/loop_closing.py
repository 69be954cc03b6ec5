r"""Whether a command answers the angle, and by which gains.

A command that is made of the angle holds what of each reading no past reading foretells; one that
comes from elsewhere does not, be it periodic or not (Granger's test). Of a goal that stays or moves
evenly,

.. math:: \Delta^2 u_k = -K_P \Delta^2 y_{k-d} - K_I h\, \Delta y_{k-d}

where no limit cuts the command. This is fitted robustly, since a goal that changes now and then is
an outlier, and held against what earlier readings alone foretell.

Source: Granger, Investigating causal relations by econometric models, Econometrica 37 (1969).
"""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.oscillations.shaking import Evenly, envelope
from tendon_newton.data.recording import Array, Indices, Mask

ORDER = 12  # Earlier rows from which a command might be foretold
LATEST = 4  # Rows by which a command may answer late, less one
ANSWERS = 0.6  # Share that a command must have of what no earlier reading foretells [1]
LEAST_ROWS = 30  # In which the command moves
ROUNDS = 20
TAIL = 2.0  # Spreads beyond which a row counts less
OFTEN = 4  # Rows of one value, from which that is a limit
CONTINUOUS = 0.2  # Share of values that come once, from which a command has no counts [1]
CUT = 0.1  # Share of rows at a limit from which a command swings between limits [1]
MOSTLY = 0.5  # Share of rows at either end of its swing, from which a command is a switch [1]
OPPOSED = 0.8  # Angle by which such a command may be off the reading's opposite [rad]
ROUNDING = 1e-12  # [rad] of a command
STRAIGHT = 0.03  # Of a command's usual bend, below which a row bends hardly [1]


@dataclass(frozen=True, kw_only=True)
class AnsweringGains:
    """Gains by which a command answers an angle."""

    gain: float  # Command per angle [1]
    integral: float  # [1/s]
    late: int  # Rows from the reading to the command
    share: float  # Of the command that no earlier reading foretells, what this tells [1]


def policy_of(log: Evenly) -> AnsweringGains | None:
    """Return by which gains a command answers the angle; None where it does not."""
    best: AnsweringGains | None = None
    free = np.flatnonzero(~cut_rows(log.command))
    for late in range(LATEST):
        found = fitted(log, free, late)
        if found is not None and (best is None or found.share > best.share + 0.02):
            best = found
    return best if best is not None and best.share > ANSWERS else None


def fitted(log: Evenly, free: Indices, late: int) -> AnsweringGains | None:
    """Return the gains of one lateness [rows]."""
    rows = free[free > ORDER + late + 2]
    rows = rows[np.isin(rows - 1, free) & np.isin(rows - 2, free)]
    if len(rows) < LEAST_ROWS:
        return None
    bent = np.diff(log.command, 2, prepend=[0.0, 0.0])[rows]
    turned = np.diff(log.angle, prepend=log.angle[0])
    seen = rows - late
    earlier = np.stack([turned[seen - k] for k in range(1, ORDER + 1)], axis=1)
    _, foretold = robust(earlier, bent)
    _, unforeseen = robust(earlier, turned[seen])
    answer = np.stack([turned[seen] - turned[seen - 1], log.step * turned[seen]], axis=1)
    numbers, left = robust(answer, bent)
    if foretold <= ROUNDING:
        return None
    gain, integral = -numbers
    made = (gain + log.step * integral) * unforeseen / foretold
    share = min(made, 1.0 - (left / foretold) ** 2)
    return AnsweringGains(gain=float(gain), integral=float(integral), late=late, share=float(share))


def cut_rows(command: Array) -> Mask:
    """Tell in which rows a command hardly bends, at a limit or with a goal, and near them, (T,)."""
    bent = np.abs(np.diff(command, 2, append=[0.0, 0.0]))
    least = max(ROUNDING, STRAIGHT * float(np.quantile(bent, 0.9)))
    straight = np.r_[True, bent[:-1] < least]
    near = straight | np.r_[straight[1:], False] | np.r_[False, straight[:-1]]
    return near | limit_rows(command)


def limit_rows(command: Array) -> Mask:
    """Tell in which rows a command without counts has a value that comes often, a limit, (T,)."""
    _, place, times = np.unique(np.round(command, 12), return_inverse=True, return_counts=True)
    if np.mean(times[place] == 1) < CONTINUOUS:
        return np.zeros(len(command), dtype=np.bool_)
    return times[place] >= OFTEN


def staying(command: Array) -> Indices:
    """Return for how many rows a command has the value that it has in each row, (T,)."""
    ends = np.flatnonzero(np.diff(command, prepend=np.nan, append=np.nan) != 0.0)
    return np.repeat(np.diff(ends), np.diff(ends))


def swings(command: Array, period: int) -> tuple[Array, Array]:
    """Return least and most of a command over so many rows about each row, (T,) each."""
    half = max(1, period // 2)
    padded = np.pad(command, half, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    return around.min(axis=1), around.max(axis=1)


def cut_swing(command: Array, period: int, rows: Mask) -> Mask:
    """Tell where a limit cuts a command that swings with a period [rows], (T,).

    A goal that stays for a period is no limit. A command that mostly stays at either end of its
    swing is a switch.

    Args:
        rows: Where it swings, shape (T,).
    """
    long = staying(command)
    least, most = swings(command, period)
    switching = (long > 1) & ((command == least) | (command == most)) & (long < period)
    limit = limit_rows(command) & (long < period)
    return rows & (limit | switching if np.mean(switching[rows]) > MOSTLY else limit)


def cut_policy(log: Evenly, frequency: float, rows: Mask) -> AnsweringGains | None:
    """Return the gain of a command that swings between limits against the angle; None otherwise.

    Args:
        frequency: At which the angle shakes [Hz].
        rows: Where it does, shape (T,).
    """
    limit = cut_swing(log.command, round(1.0 / (frequency * log.step)), rows)
    if np.mean(limit[rows]) < CUT:
        return None
    wanted, angle = (envelope(x, frequency, log.step)[rows] for x in (log.command, log.angle))
    against = -wanted * np.conj(angle)
    if (
        np.abs(np.angle(against.sum())) > OPPOSED
        or np.abs(against.sum()) < 0.5 * np.abs(against).sum()
    ):
        return None
    moved, turned = np.diff(log.command), np.diff(log.angle)
    free = ~limit[1:] & ~limit[:-1] & rows[1:] & rows[:-1]
    free &= np.abs(turned) > 0.3 * np.abs(turned[rows[1:]]).max(initial=0.0)
    ratio = float(np.median(np.abs(wanted) / np.maximum(np.abs(angle), 1e-9)))
    steep = float(np.quantile(-moved[free] / turned[free], 0.75)) if free.sum() >= OFTEN else 0.0
    return AnsweringGains(
        gain=max(steep, ratio), integral=0.0, late=0, share=float(np.mean(limit[rows]))
    )


def robust(regressors: Array, target: Array) -> tuple[Array, float]:
    """Fit a line through most rows, and return its numbers and the spread that it leaves."""
    weights = np.ones(len(target))
    numbers, size = np.zeros(regressors.shape[1]), 0.0
    for _ in range(ROUNDS):
        scaled = regressors * weights[:, None]
        square = scaled.T @ regressors
        numbers = np.linalg.pinv(square, rcond=1e-14, hermitian=True) @ (scaled.T @ target)
        left = np.abs(target - regressors @ numbers)
        size = 1.4826 * float(np.median(left))
        weights = np.minimum(1.0, TAIL * size / np.maximum(left, 1e-15))
    return numbers, size
