"""The table of faults: each is made in three sizes in a clean log, and says where it is.

A fault takes a log, its size and a generator, changes the log in place, and returns the rows of
each episode that it spoilt, shape (E, T). ``JOINT`` is spoilt where a fault is of one joint.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.benchmarks.corrupted_logs.logs import EPISODES, RATE, ROWS, Log

Rows = NDArray[np.bool_]
Spoil = Callable[[Log, float, np.random.Generator], Rows]
JOINT, OTHER = 1, 2
TURN = 360.0


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One kind of fault."""

    kind: str
    words: str  # What is wrong
    unit: str  # Of its sizes
    sizes: tuple[float, float, float]
    spoil: Spoil
    also: tuple[str, ...] = ()  # Kinds that name it as well
    every: bool = False  # Whether it is of all joints


def none() -> Rows:
    """Return no rows."""
    return np.zeros((EPISODES, ROWS), dtype=np.bool_)


def whole(count: float) -> Rows:
    """Return all rows of so many episodes."""
    rows = none()
    rows[: round(count)] = True
    return rows


def scattered(share: float, rng: np.random.Generator) -> Rows:
    """Return a share of all rows, each by itself [percent]."""
    rows = none()
    rows[:, 5:-5] = rng.random((EPISODES, ROWS - 10)) < share / 100.0
    return rows


def window(seconds: float, log: Log, rng: np.random.Generator, column: int | None = JOINT) -> Rows:
    """Return rows of one episode while what is spoilt would move most."""
    count, episode = round(RATE * seconds), int(rng.integers(EPISODES))
    place = slice(None) if column is None else [column]
    moved = np.abs(np.diff(log.action[episode][:, place], axis=0)).sum(axis=1)
    sums = np.convolve(moved, np.ones(count), mode="valid")
    first = 20 + int(np.argmax(sums[20 : len(sums) - 20]))
    rows = none()
    rows[episode, first : first + count] = True
    return rows


def failed_read(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Read 0 in some rows."""
    rows = scattered(size, rng)
    log.state[..., JOINT][rows] = 0.0
    return rows


def neighbour_read(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Read another joint in some rows."""
    rows = scattered(size, rng)
    log.state[..., JOINT][rows] = log.state[..., OTHER][rows]
    return rows


def repeated_read(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Write the last reading again in some rows."""
    rows = scattered(size, rng)
    for episode, row in np.argwhere(rows):
        log.state[episode, row, JOINT] = log.state[episode, row - 1, JOINT]
    return rows


def frozen_read(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Freeze one angle for a while."""
    rows = window(size, log, rng)
    log.state[..., JOINT][rows] = log.state[..., JOINT][rows][0]
    return rows


def stalled_recorder(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Write one row again and again."""
    rows = window(size, log, rng, None)
    for values in (log.state, log.action):
        values[rows] = values[rows][0]
    return rows


def reversed_joint(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Count an angle the other way in some episodes."""
    rows = whole(size)
    log.state[..., JOINT][rows] *= -1.0
    return rows


def seam(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Put the encoder's seam where a share of the angles lies beyond it."""
    shift = 0.5 * TURN - np.quantile(log.state[..., JOINT], 1.0 - size / 100.0)
    log.action[..., JOINT] += shift
    moved = log.state[..., JOINT] + shift
    log.state[..., JOINT] = np.mod(moved + 0.5 * TURN, TURN) - 0.5 * TURN
    return moved >= 0.5 * TURN


def scale(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Write an angle in another unit, or before a gear."""
    log.state[..., JOINT] /= size
    return whole(EPISODES)


def offset(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Calibrate a joint beside its leader."""
    log.state[..., JOINT] += size * rng.choice([-1.0, 1.0])
    return whole(EPISODES)


def calibration_jump(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Calibrate a joint anew before the last episode."""
    rows = ~whole(EPISODES - 1)
    log.state[..., JOINT][rows] += size * rng.choice([-1.0, 1.0])
    return rows


def exchanged_joints(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Exchange two joints' angles in some episodes."""
    rows = whole(size)
    log.state[rows] = log.state[rows][:, [0, OTHER, JOINT, 3]]
    return rows


def late_command(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Log a command some rows late."""
    late = round(size)
    log.action[:, late:, JOINT] = log.action[:, :-late, JOINT].copy()
    log.action[:, :late, JOINT] = log.action[:, late : late + 1, JOINT]
    return whole(EPISODES)


def copied_action(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Log the angle in place of the command in some episodes."""
    rows = whole(size)
    log.action[..., JOINT][rows] = log.state[..., JOINT][rows]
    return rows


def relative_action(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Log the command less the angle in some episodes."""
    rows = whole(size)
    log.action[rows] -= log.state[rows]
    return rows


def missing_rows(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Leave rows out; the stamps tell."""
    rows = scattered(size, rng)
    log.kept &= ~rows
    return rows


def clock_leap(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Set the clock ahead within an episode."""
    rows = none()
    rows[0, ROWS // 2 :] = True
    log.time[rows] += size
    return rows


def clock_disorder(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Write some rows before the one that came first."""
    rows = none()
    for row in np.linspace(30, ROWS - 30, round(size)).astype(np.intp):
        rows[0, row : row + 2] = True
        for values in (log.time, log.action, log.state):
            values[0, [row, row + 1]] = values[0, [row + 1, row]]
    return rows


def play(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Put play behind a joint."""
    for own in log.state[..., JOINT]:
        held = float(own[0])
        for row, angle in enumerate(own.copy()):
            held = min(max(held, angle - 0.5 * size), angle + 0.5 * size)
            own[row] = held
    return whole(EPISODES)


def delay(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Let a joint follow late [ms]."""
    time = np.arange(ROWS) / RATE
    for own in log.state[..., JOINT]:
        own[:] = np.interp(time - 1e-3 * size, time, own)
    return whole(EPISODES)


def held(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Stop a joint at something solid for a share of the time [percent]."""
    stop = np.quantile(log.state[..., JOINT], 1.0 - size / 100.0)
    rows = log.state[..., JOINT] > stop
    log.state[..., JOINT] = np.minimum(log.state[..., JOINT], stop)
    return rows


def motor_off(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Let a joint fall and hang while its motor is off."""
    rows = window(size, log, rng)
    angle = log.state[..., JOINT][rows]
    fall = np.exp(-np.arange(len(angle)) / (0.1 * RATE))
    hangs = -45.0 + 0.05 * rng.normal(size=len(angle))
    log.state[..., JOINT][rows] = hangs + (angle[0] - hangs) * fall
    return rows


def lost_command(log: Log, size: float, rng: np.random.Generator) -> Rows:
    """Freeze a logged command while the joint moves on."""
    rows = window(size, log, rng)
    log.action[..., JOINT][rows] = log.action[..., JOINT][rows][0]
    return rows


def fault(
    spoil: Spoil, unit: str, sizes: tuple[float, float, float], *also: str, every: bool = False
) -> Fault:
    """Return a row of the table, named after its function."""
    words = (spoil.__doc__ or "").split(".")[0].split(" [")[0]
    kind = spoil.__name__.removesuffix("_joint")
    return Fault(
        kind=kind, words=words, unit=unit, sizes=sizes, spoil=spoil, also=also, every=every
    )


EPISODE_COUNTS = (1.0, 2.0, 3.0)
FAULTS: tuple[Fault, ...] = (
    fault(failed_read, "% of rows", (0.5, 2.0, 10.0)),
    fault(neighbour_read, "% of rows", (0.5, 2.0, 10.0), "failed_read"),
    fault(repeated_read, "% of rows", (3.0, 10.0, 25.0)),
    fault(frozen_read, "s", (1.0, 2.0, 5.0)),
    fault(stalled_recorder, "s", (0.5, 1.5, 4.0), "frozen_read", every=True),
    fault(reversed_joint, "episodes", EPISODE_COUNTS),
    fault(seam, "% of rows", (2.0, 10.0, 40.0)),
    fault(scale, "times", (1.5, 3.0, 57.29578)),
    fault(offset, "deg", (7.0, 15.0, 30.0)),
    fault(calibration_jump, "deg", (7.0, 15.0, 30.0)),
    fault(exchanged_joints, "episodes", EPISODE_COUNTS, every=True),
    fault(late_command, "rows", (5.0, 8.0, 12.0)),
    fault(copied_action, "episodes", EPISODE_COUNTS),
    fault(relative_action, "episodes", EPISODE_COUNTS, every=True),
    fault(missing_rows, "% of rows", (2.0, 5.0, 15.0), every=True),
    fault(clock_leap, "s", (12.0, 60.0, 3600.0), every=True),
    fault(clock_disorder, "pairs", (1.0, 5.0, 20.0), every=True),
    fault(play, "deg", (6.0, 9.0, 15.0)),
    fault(delay, "ms", (250.0, 350.0, 500.0)),
    fault(held, "% of time", (5.0, 10.0, 25.0)),
    fault(motor_off, "s", (1.5, 3.0, 7.0)),
    fault(lost_command, "s", (2.0, 4.0, 8.0)),
)
