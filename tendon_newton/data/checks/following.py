r"""How a shaft follows its command, from positions alone: delay, lag, play and offset.

.. math:: y = \operatorname{play}_w\bigl(L_\tau u(t - d)\bigr) + c

with the command :math:`u` held until its next row, a first-order lag :math:`L_\tau` and the play
operator of width :math:`w`. The four numbers are those with the least squared error. A load is
taken to go with the posture: what is a quadratic form of all commands is sag, and no play.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.recording import Array, Mask, Recording

STILL = 0.1  # [rad/s] slower counts as standing still
HELD_ERROR = 0.1  # [rad] no lag of a moving position servo reaches it for so long
HELD_TIME = 0.5  # [s] shorter is a servo on its way
SETTLING = 0.5  # [s] from a first row, whose past is not known
DELAYS = np.arange(0.0, 0.31, 0.02)  # [s] where the search begins
LAGS = (0.001, 0.03, 0.06, 0.12, 0.2)  # [s] likewise
PLAYS = (0.0, 0.02, 0.06, 0.2)  # [rad] likewise
STEP = 1.0e-3  # [s] of delay and lag and [rad] of play, for the slopes of the residual
DAMPING = (0.0, 0.1, 1.0, 10.0)  # [1] of the slopes' squares; the best of these is taken
LATEST = 0.3  # [s] no servo that anybody uses answers later
EXPECTED_DELAYS, EXPECTED_LAGS = 8, (0.001, 0.03, 0.1)
"""How many delays [1], and which lags [s], are tried where only rows are judged."""
EXPECTED_ROWS = 4000  # Rows that decide between them
ROUNDS = 12
ENOUGH = 1.0 - 1e-4  # [1] of the square: a step that takes away less is the last
ROWS_A_FORM = 20  # Rows that each direction of sag takes
NEARLY = 0.01  # [1] of the motion: what follows so well carries no load worth a word
SAG_ROUNDS = 2  # In which the posture is as late as the joint was found to be before
SAGS = 0.25  # [1] of the square that is left without a load, below which one is there
TOLD_APART = 1e-6  # [1] of the largest direction of sag, below which one is rounding


@dataclass(frozen=True, kw_only=True)
class FollowedMotion:
    """One uninterrupted stretch of a joint."""

    time: Array  # [s], strictly increasing, shape (T,)
    command: Array  # [rad], held until the next row, shape (T,)
    position: Array  # [rad], shape (T,)
    # Commands of all joints, on which its load depends [rad], shape (T, J); no load without any
    posture: Array | None = None
    read: Mask | None = None  # Rows whose angle was read, shape (T,); all by default

    @property
    def good(self) -> Mask:
        """Rows whose angle was read, shape (T,)."""
        return np.ones(len(self.time), dtype=np.bool_) if self.read is None else self.read

    def until(self, count: int) -> "FollowedMotion":
        """Return the first so many rows."""
        rows = slice(count)
        return FollowedMotion(
            time=self.time[rows],
            command=self.command[rows],
            position=self.position[rows],
            posture=None if self.posture is None else self.posture[rows],
            read=self.good[rows],
        )


@dataclass(frozen=True, kw_only=True)
class Following:
    """How a joint follows."""

    delay: float  # [s]
    lag: float  # Time constant [s]
    play: float  # Width [rad]
    residual: float  # What the four numbers leave, RMS [rad]
    motion: float  # Standard deviation of the positions [rad]


def follow(motions: Sequence[FollowedMotion]) -> Following:
    """Fit delay, lag and play to motions; rows in which something holds the joint do not count."""
    used = [free_rows(motion) for motion in motions]
    none = np.zeros((sum(map(int, map(np.sum, used))) or 1, 0))
    starts = [np.array([delay, lag, 0.0]) for delay in DELAYS for lag in LAGS]
    first = min(starts, key=lambda numbers: error(motions, used, none, numbers))
    best = walked(motions, used, none, [np.array([*first[:2], width]) for width in PLAYS])
    left = error(motions, used, none, best)
    positions = np.concatenate([motion.position for motion in motions])
    if left > (NEARLY * positions.std()) ** 2:
        sag, loaded = none, best
        for _ in range(SAG_ROUNDS):
            sag = sag_of(motions, used, loaded)
            nearest = min([loaded, *starts], key=lambda numbers: error(motions, used, sag, numbers))
            loaded = walked(motions, used, sag, [np.array([*nearest[:2], w]) for w in PLAYS])
        if (lower := error(motions, used, sag, loaded)) < SAGS * left:
            best, left = loaded, lower
    delay, lag, width = map(float, best)
    return Following(
        delay=delay,
        lag=lag,
        play=width,
        residual=float(np.sqrt(left)),
        motion=float(positions.std()),
    )


def walked(
    motions: Sequence[FollowedMotion], used: Sequence[Mask], sag: Array, starts: Sequence[Array]
) -> Array:
    """Return the best of what walks from several starts end at."""
    ends = [refine(lambda numbers: left_of(motions, used, sag, numbers), s) for s in starts]
    return min(ends, key=lambda numbers: error(motions, used, sag, numbers))


def error(
    motions: Sequence[FollowedMotion], used: Sequence[Mask], sag: Array, numbers: Array
) -> float:
    """Return the mean square of what numbers and sag leave [rad^2]."""
    return float(np.mean(left_of(motions, used, sag, numbers) ** 2))


def left_of(
    motions: Sequence[FollowedMotion], used: Sequence[Mask], sag: Array, numbers: Array
) -> Array:
    """Return what delay, lag and play leave of all used rows beside the sag [rad], shape (N,)."""
    left = pooled([residual_of(motion, numbers) for motion in motions], used)
    return left - sag @ (sag.T @ left)


def pooled(parts: Sequence[Array], used: Sequence[Mask]) -> Array:
    """Put the used rows of motions below each other, each without its mean, shape (N, ...)."""
    chosen = [part[mask] for part, mask in zip(parts, used, strict=True) if mask.any()]
    return np.concatenate([part - part.mean(axis=0) for part in chosen] or [np.zeros(1)])


def sag_of(motions: Sequence[FollowedMotion], used: Sequence[Mask], numbers: Array) -> Array:
    """Return directions in which a joint sags with the posture, orthonormal, shape (N, F).

    The posture follows its commands late: what sagged with the commands themselves would seem to
    have play. Few rows tell of no sag.
    """
    forms = [
        np.zeros((len(m.time), 0)) if m.posture is None else forms_of(reached(m, numbers))
        for m in motions
    ]
    rows = pooled(forms, used)
    if rows.ndim < 2 or rows.shape[1] == 0 or len(rows) < ROWS_A_FORM * rows.shape[1]:
        return np.zeros((len(rows), 0))
    size = np.linalg.norm(rows, axis=0)
    directions, sizes, _ = np.linalg.svd(
        rows[:, size > 0.0] / size[size > 0.0], full_matrices=False
    )
    return directions[:, sizes > TOLD_APART * sizes.max(initial=0.0)]


def reached(motion: FollowedMotion, numbers: Array) -> Array:
    """Return the posture that commands lead to, late as the joint itself is [rad], (T, J)."""
    assert motion.posture is not None
    delay, lag, _ = numbers
    each = [lagged(replace(motion, command=one), delay, lag) for one in motion.posture.T]
    return np.stack(each, axis=1)


def forms_of(posture: Array) -> Array:
    """Return angles and their products, (T, J + J (J + 1) / 2) for (T, J)."""
    first, second = np.triu_indices(posture.shape[1])
    return np.concatenate([posture, posture[:, first] * posture[:, second]], axis=1)


def offset_of(motion: FollowedMotion, following: Following) -> float:
    """Return the median of position minus what delay, lag and play make of the command [rad]."""
    numbers = np.array([following.delay, following.lag, following.play])
    free = free_rows(motion)
    return float(np.median(residual_of(motion, numbers)[free if free.any() else slice(None)]))


def free_rows(motion: FollowedMotion) -> Mask:
    """Tell which rows were read, away from the first one and from all in which it is held."""
    time = motion.time
    begin = time[np.r_[True, held_rows(motion)[1:]]]  # the first row has no past
    nearest = np.searchsorted(begin, time)
    since = time - begin[np.maximum(0, nearest - 1)]
    until = np.r_[begin, np.inf][nearest] - time
    return (np.minimum(np.abs(since), until) > SETTLING) & motion.good


def refine(residual: Callable[[Array], Array], start: Array) -> Array:
    """Walk to the least square of a residual by damped steps of Gauss and Newton, none below 0."""
    best, found = start, residual(start)
    for _ in range(ROUNDS):
        slopes = np.stack([(residual(best + step) - found) / STEP for step in STEP * np.eye(3)], 1)
        square, pull = slopes.T @ slopes, slopes.T @ found
        tried = [
            np.maximum(0.0, best - np.linalg.pinv(square + d * np.diag(np.diag(square))) @ pull)
            for d in DAMPING
        ]
        residuals = [residual(numbers) for numbers in tried]
        k = int(np.argmin([new @ new for new in residuals]))
        if residuals[k] @ residuals[k] >= ENOUGH * (found @ found):
            break
        best, found = tried[k], residuals[k]
    return best


def residual_of(motion: FollowedMotion, numbers: Array) -> Array:
    """Return position minus what delay [s], lag [s] and play [rad] make of the command."""
    delay, lag, width = numbers
    return motion.position - play(lagged(motion, delay, lag), 0.5 * width)


def lagged(motion: FollowedMotion, delay: float, lag: float) -> Array:
    """Return a held command behind a delay and a first-order lag [rad], shape (T,), exactly."""
    time, command = motion.time, motion.command
    lag = max(lag, 1.0e-6)
    decay = np.exp(-np.diff(time) / lag)
    scale, shift = np.r_[1.0, decay], np.r_[0.0, (1.0 - decay) * command[:-1]]
    step = 1
    while step < len(time):  # compose z_k = scale_k z_(k-1) + shift_k over twice as many rows
        shift[step:] += scale[step:] * shift[:-step]
        scale[step:] = scale[step:] * scale[:-step]
        step *= 2
    state = scale * command[0] + shift
    row = np.clip(np.searchsorted(time, time - delay, side="right") - 1, 0, None)
    since = np.maximum(0.0, time - delay - time[row])
    return command[row] + (state[row] - command[row]) * np.exp(-since / lag)


def play(drive: Array, half: float) -> Array:
    """Return what follows a drive through play of half a width [rad], shape (T,).

    Each row clips what was before to ``drive - half .. drive + half``; clips compose to clips.
    """
    low, high = drive - half, drive + half
    step = 1
    while step < len(drive):
        before = np.clip(low[:-step], low[step:], high[step:])
        high[step:] = np.clip(high[:-step], low[step:], high[step:])
        low[step:] = before
        step *= 2
    return np.clip(drive[0], low, high)


def held_rows(motion: FollowedMotion) -> Mask:
    """Tell in which rows a joint stands far from its command, or falls back, for long.

    Something solid is in the way there, or the servo has let go. A constant offset does not count.
    """
    short = motion.command - motion.position
    short = short - np.median(short)
    speed = np.gradient(motion.position, motion.time)
    stands = (np.abs(short) > HELD_ERROR) & (np.sign(short) * speed < STILL)
    edges = np.flatnonzero(np.diff(np.r_[False, stands, False]))
    held = np.zeros(len(short), dtype=np.bool_)
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        held[first:last] = motion.time[last - 1] - motion.time[first] >= HELD_TIME
    return held


def expected(recording: Recording, place: int, used: Mask | None = None) -> Array:
    """Return where an angle would be by its command: late, lagging and beside it [rad], (T,).

    Args:
        used: Rows that tell how it follows, shape (T,); those with the motor on by default.
    """
    assert recording.command is not None
    used = recording.enabled if used is None else used
    used = used if used.any() else np.ones_like(used)
    whole = FollowedMotion(
        time=recording.time,
        command=recording.command[:, place],
        position=recording.motor_position[:, place],
    )
    part, rows = whole.until(EXPECTED_ROWS), used[:EXPECTED_ROWS]
    rows = rows if rows.any() else np.ones_like(rows)

    def beside(motion: FollowedMotion, numbers: tuple[float, float]) -> Array:
        return motion.position - lagged(motion, *numbers)

    tried = [
        (float(delay), lag)
        for delay in np.linspace(0.0, LATEST, EXPECTED_DELAYS)
        for lag in EXPECTED_LAGS
    ]
    best = min(tried, key=lambda numbers: float(np.std(beside(part, numbers)[rows])))
    return lagged(whole, *best) + float(np.median(beside(whole, best)[used]))
