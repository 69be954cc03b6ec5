"""The numbers of a small servo that tell a log's angle from what drove it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.oscillations.servo_loop import LEAST, MOST, NAMES, driven
from tendon_newton.data.oscillations.shaking import Evenly, Waves
from tendon_newton.data.recording import Array, Mask

QUICKEST = 400.0  # Substeps a second, at most
A_PERIOD = 60  # Substeps of a period of the shaking, at least
PERIODS = 2.0  # Periods over which a slow drift of the angle is taken away
RUN_IN = 2.0  # Periods that are simulated and not compared, since no log tells how it begins
DRAWS, STARTS = 400, 4  # Half of the starts are the best that were drawn, half those in step
ROUNDS, FURTHER = 18, 40
"""Steps from all starts, and further ones from the best of each servo."""
STEP = 0.03  # Of the logarithm of a number, for slopes
DAMPING = (0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0)  # Of the slopes' squares [1]
SEED = 20
LONGEST = 1.5  # Step of the logarithm of a number
ENOUGH = 0.999  # Of the square: a step that takes away less is the last [1]
SIMPLER = 1.3  # By which each number that is left out may raise the square [1]
NEARLY, MOST_OTHERS = 1.3, 5
"""By how much a further servo's square may be greater [1], and how many are kept."""
WITHOUT = (("sticking", "play"), ("sticking",), ("play",), ())
"""Numbers that are left out, the simplest servo first."""
LOW, HIGH = np.log(LEAST), np.log(MOST)
DELAY, PULL = NAMES.index("delay"), NAMES.index("pull")


@dataclass(frozen=True, kw_only=True)
class FittedServo:
    """A servo that tells the angle."""

    numbers: Array  # In the order of ``NAMES``, shape (9,)
    told: float  # Share of the angle's variance that it tells [1]
    others: tuple[Array, ...]  # Numbers of further servos that tell it nearly as well


def fit_servo(log: Evenly, frequency: float, *, outer: bool, stuck: bool = False) -> FittedServo:
    """Fit a servo to a stretch of a log, from many starts.

    Play and sticking are left out where the rest tells the angle as well.

    Args:
        frequency: At which it shakes [Hz].
        outer: Whether a policy closes the loop.
        stuck: Whether its angle is known to stick: play is left out then, and no sticking.
    """
    variants = (("play",),) if stuck else WITHOUT
    every = max(1, int(1.0 / (A_PERIOD * frequency * log.step)))
    log = Evenly(step=every * log.step, command=log.command[::every], angle=log.angle[::every])
    parts = max(1, int(np.ceil(log.step * min(A_PERIOD * frequency, QUICKEST))))
    step = log.step / parts
    fine = np.arange((len(log.angle) - 1) * parts + 1)
    command = log.command[fine // parts]
    drive = command if outer else command - drawn_out(log.angle, parts)
    summed = step * np.cumsum(drive)
    summed -= summed.mean()  # an integral that hunts swings about what the load takes
    width = max(3, round(PERIODS / (frequency * log.step)))
    known = round(RUN_IN / (frequency * log.step))
    wanted = without_drift(log.angle[:, None], width)[known:]

    def residuals(logs: Array) -> Array:
        told = driven(np.exp(logs), drive, summed, step, outer=outer)[::parts]
        return without_drift(told, width)[known:] - wanted

    rng = np.random.default_rng(SEED)
    starts = rng.uniform(LOW, HIGH, size=(DRAWS, len(NAMES)))
    turns = frequency * log.step * np.arange(len(wanted))
    wave = np.asarray(np.exp(-2.0j * np.pi * turns), dtype=np.complex128)
    fixed: list[Mask] = []
    chosen: list[Array] = []
    for without in variants:
        drawn = starts.copy()
        kept = np.array([name in without or (outer and name == "integral") for name in NAMES])
        drawn[:, kept] = LOW[kept]
        left = residuals(drawn)
        moved = in_step(drawn, wanted.T @ wave, (left + wanted).T @ wave, frequency)
        for own, own_left in ((drawn, left), (moved, residuals(moved))):
            chosen += list(own[np.argsort(np.sum(own_left**2, axis=0))[: STARTS // 2]])
        fixed += STARTS * [kept]
    kept = np.array(fixed, dtype=np.bool_)
    ends, squares = walked(residuals, np.array(chosen), kept)
    first = STARTS * np.arange(len(variants))
    best = first + np.argmin(squares.reshape(-1, STARTS), axis=1)
    ends[best], squares[best] = walked(residuals, ends[best], kept[best], rounds=FURTHER)
    total = float(np.sum(wanted**2))
    allowed = squares * np.repeat([SIMPLER ** -len(without) for without in variants], STARTS)
    order = np.argsort(allowed)
    at = order[0]
    near = [k for k in order[1 : MOST_OTHERS + 1] if allowed[k] < NEARLY * allowed[at]]
    return FittedServo(
        numbers=np.exp(ends[at]),
        told=1.0 - float(squares[at]) / total,
        others=tuple(np.exp(ends[k]) for k in near),
    )


def in_step(drawn: Array, wanted: Waves, told: Waves, frequency: float) -> Array:
    """Return logarithms of numbers whose delay and pull bring a line to its phase and size.

    Args:
        drawn: Logarithms, shape (N, 9).
        wanted: The line as it was seen, at this frequency [Hz], complex, shape (1,).
        told: What the numbers make of it, likewise, shape (N,).
    """
    ratio = wanted / np.where(told == 0.0, 1.0, told)
    later = np.exp(drawn[:, DELAY]) - np.angle(ratio) / (2.0 * np.pi * frequency)
    moved = drawn.copy()
    moved[:, DELAY] = np.log(LEAST[DELAY] + np.mod(later - LEAST[DELAY], 1.0 / frequency))
    moved[:, PULL] += np.log(np.maximum(np.abs(ratio), 1e-9))
    return np.clip(moved, LOW, HIGH)


def drawn_out(angle: Array, parts: int) -> Array:
    """Return an angle at so many places a row, by cubics that keep its slopes, (T' parts + 1,)."""
    slope = np.gradient(angle)
    row, part = np.divmod(np.arange((len(angle) - 1) * parts), parts)
    share = part / parts
    rise = angle[row + 1] - angle[row]
    first, last = slope[row] - rise, slope[row + 1] - rise
    bent = share * (1.0 - share) * ((1.0 - share) * first - share * last)
    return np.append(angle[row] + share * rise + bent, angle[-1])


def walked(
    residuals: Callable[[Array], Array],
    starts: Array,
    fixed: Mask,
    bounds: tuple[Array, Array] = (LOW, HIGH),
    rounds: int = ROUNDS,
) -> tuple[Array, Array]:
    """Walk from all starts at once to least squares, by damped steps of Gauss and Newton.

    Args:
        residuals: Gives what numbers' logarithms (N, 9) leave of an angle, shape (T, N).
        starts: Logarithms, shape (K, 9).
        fixed: Those that stay, shape (K, 9).
        bounds: Least and most of each, shape (9,).
        rounds: Steps, at most.

    Returns:
        The ends, shape (K, 9), and their sums of squares, shape (K,).
    """
    best, (count, size) = starts.copy(), starts.shape
    left = residuals(best)
    squares = np.sum(left**2, axis=0)
    for _ in range(rounds):
        signs = np.where(best + STEP > bounds[1], -1.0, 1.0)
        moved = best[:, None, :] + STEP * signs[:, :, None] * np.eye(size)
        near = residuals(moved.reshape(-1, size)).reshape(len(left), count, size)
        slopes = np.where(fixed, 0.0, (near - left[:, :, None]) * signs / STEP)
        tried = np.stack(
            [np.clip(steps(best[k], slopes[:, k], left[:, k]), *bounds) for k in range(count)]
        )
        new = residuals(tried.reshape(-1, size)).reshape(len(left), count, len(DAMPING))
        sums = np.sum(new**2, axis=0)
        choice = np.argmin(sums, axis=1)
        each = list(range(count))
        better = np.flatnonzero(sums[each, choice] < ENOUGH * squares)
        if not better.size:
            break
        taken = choice[better]
        best[better], squares[better] = tried[better, taken], sums[better, taken]
        left[:, better] = new[:, better, taken]
    return best, squares


def steps(place: Array, slopes: Array, left: Array) -> Array:
    """Return where steps of several dampings lead from a place, shape (6, 9)."""
    square, pull = slopes.T @ slopes, slopes.T @ left
    scale = np.diag(square) + 1e-9 * np.trace(square)
    changes = [
        np.linalg.lstsq(square + damping * np.diag(scale), pull, rcond=1e-9)[0]
        for damping in DAMPING
    ]
    return place - np.clip(changes, -LONGEST, LONGEST)


def without_drift(angles: Array, width: int) -> Array:
    """Return angles less their moving mean over some rows, (T, N)."""
    half = width // 2
    padded = np.pad(angles, ((half + 1, half), (0, 0)), mode="edge")
    sums = np.cumsum(padded, axis=0)
    return angles - (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
