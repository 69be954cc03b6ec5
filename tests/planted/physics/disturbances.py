"""What differs from one recording to the next: hands, wandering numbers, late commands."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.planted.physics.causes import Causes

Array = NDArray[np.float64]

WANDER_TIME = 2.0  # [s] in which a wandering gain forgets where it was
STUCK_TIME = (0.1, 0.5)  # [s] for which an encoder repeats itself
SWAY_PERIOD = (4.0, 7.0)  # [s] of a friction that comes and goes


@dataclass(frozen=True, kw_only=True)
class Knock:
    """A hand that pushes along the tendon's path: half a sine of force."""

    start: float  # [s]
    width: float  # [s]
    peak: float  # [N], positive closes


@dataclass(frozen=True, kw_only=True)
class Disturbances:
    """What happens to one recording; the defaults are nothing."""

    knocks: tuple[Knock, ...] = ()  # Hands in the way, one after the other
    # Gain at each row against its mean [1], straight lines between rows, shape (T,)
    gain: Array | None = None
    # Further dry friction at each row [N], straight lines between rows, shape (T,)
    friction: Array | None = None
    lateness: Array | None = None  # Further age of each row's command [s], shape (T,)
    # Row whose angle and speed the log repeats at each row, shape (T,)
    logged: NDArray[np.intp] | None = None


def draw_disturbances(rng: np.random.Generator, causes: Causes, time: Array) -> Disturbances:
    """Draw what the causes do to one recording with rows at the given instants [s]."""
    gain = friction = lateness = logged = None
    if causes.gain_wander > 0.0:
        gain = 1.0 + causes.gain_wander * wander(rng, time)
    if causes.friction_sway > 0.0:
        pace = 2.0 * np.pi / rng.uniform(*SWAY_PERIOD)
        phase = rng.uniform(0.0, 2.0 * np.pi)
        friction = 0.5 * causes.friction_sway * (1.0 - np.cos(pace * time + phase))
    if causes.jitter > 0.0:
        lateness = rng.uniform(0.0, causes.jitter, size=time.size)
    if causes.stuck_rate > 0.0:
        logged = stuck_rows(rng, time, causes.stuck_rate)
    return Disturbances(
        knocks=draw_knocks(rng, causes, float(time[-1])),
        gain=gain,
        friction=friction,
        lateness=lateness,
        logged=logged,
    )


def wander(rng: np.random.Generator, time: Array) -> Array:
    """Random walk that is pulled back to 0, of standard deviation 1, shape (T,)."""
    walk = np.empty(time.size)
    walk[0] = rng.standard_normal()
    for k, passed in enumerate(np.diff(time), start=1):
        kept = np.exp(-passed / WANDER_TIME)
        walk[k] = kept * walk[k - 1] + np.sqrt(1.0 - kept**2) * rng.standard_normal()
    return walk


def stuck_rows(rng: np.random.Generator, time: Array, rate: float) -> NDArray[np.intp]:
    """Draw the row that each row repeats, for an encoder that sticks so often a second, (T,)."""
    rows = np.arange(time.size)
    spacing = time[1] - time[0]
    for first in np.flatnonzero(rng.random(time.size) < rate * spacing):
        stuck = slice(first, first + int(rng.uniform(*STUCK_TIME) / spacing))
        rows[stuck] = rows[first]
    return rows


def draw_knocks(rng: np.random.Generator, causes: Causes, duration: float) -> tuple[Knock, ...]:
    """Draw when and how hard the hand knocks, 30 to 80 ms each, either way."""
    knocks: list[Knock] = []
    if causes.knock_rate == 0.0:
        return ()
    start = float(rng.exponential(1.0 / causes.knock_rate))
    while start < duration:
        width = float(rng.uniform(0.03, 0.08))
        peak = causes.knock_peak * float(rng.uniform(0.6, 1.2) * rng.choice([-1.0, 1.0]))
        knocks.append(Knock(start=start, width=width, peak=peak))
        start += width + float(rng.exponential(1.0 / causes.knock_rate))
    return tuple(knocks)
