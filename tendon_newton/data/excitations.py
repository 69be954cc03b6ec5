"""Commands that bring out what a servo and its tendon do: those of the paper.

Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), section II-C for what
a model is fitted to and section IV for what it is tested on.
"""

from collections.abc import Callable
from functools import partial
from math import pi

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import look_up

RATE = 80.0  # Rows per second [Hz]
LARGEST_COMMAND = 2.0 * pi  # End of the command range [rad]; it starts at 0

TEST_ANGLES = (0.0, 2.0, 4.0, 1.0)  # Angles of the paper's test steps [rad]

Excitation = Callable[[Array, np.random.Generator], Array]
"""(time (T,) [s], rng) -> command (T,) [rad], inside [0, 2 pi]."""


def random_steps(time: Array, rng: np.random.Generator) -> Array:
    """Return steps to random angles, each held for 0.5 to 3 s."""
    count = int(time[-1] / 0.5) + 2
    edges = np.cumsum(rng.uniform(0.5, 3.0, count))
    return rng.uniform(0.0, LARGEST_COMMAND, count + 1)[np.searchsorted(edges, time, side="right")]


def sine(time: Array, rng: np.random.Generator) -> Array:
    """Return a sinusoid of amplitude pi/2 about a drawn centre, at pi to 4 pi rad/s."""
    centre = rng.uniform(pi / 2.0, LARGEST_COMMAND - pi / 2.0)
    return centre + pi / 2.0 * np.sin(rng.uniform(pi, 4.0 * pi) * time + rng.uniform(0.0, 2.0 * pi))


def ramps(time: Array, rng: np.random.Generator) -> Array:
    """Return ramps up and down over a drawn range, at 1 to 2 rad/s."""
    slope, top = rng.uniform(1.0, 2.0), rng.uniform(pi, LARGEST_COMMAND)
    return top * np.abs((slope * time / top + 1.0) % 2.0 - 1.0)


def stairs(time: Array, rng: np.random.Generator) -> Array:
    """Return stairs of 0.1 rad up and down over a drawn range, 0.1 s a stair."""
    top = rng.uniform(pi / 2.0, pi)
    stair = np.floor(time / 0.1) * 0.1
    return top * np.abs((stair / top + 1.0) % 2.0 - 1.0)


def slow_ramps(time: Array, rng: np.random.Generator) -> Array:
    """Return ramps slow enough for friction to be all that is dynamic, at 0.3 rad/s."""
    top = rng.uniform(2.0, 4.0)
    return top * np.abs((0.3 * time / top + 1.0) % 2.0 - 1.0)


def long_holds(time: Array, rng: np.random.Generator) -> Array:
    """Return steps held for 4 s, so that what creeps shows."""
    return rng.uniform(0.5, LARGEST_COMMAND, int(time[-1] / 4.0) + 2)[(time / 4.0).astype(int)]


def steps_held(time: Array, rng: np.random.Generator, hold: float) -> Array:
    """Return steps to 0, 2, 4 and 1 rad, held for ``hold`` seconds each, again and again.

    The paper's networks see 1.5 s: what lies within, just beyond, or far beyond.
    """
    return np.array(TEST_ANGLES)[(time / hold).astype(int) % len(TEST_ANGLES)]


def contact_ramp(time: Array, rng: np.random.Generator) -> Array:
    """Return ramps over the whole range at 1.5 rad/s, up and down, which the contact runs use."""
    return LARGEST_COMMAND * np.abs((1.5 * time / LARGEST_COMMAND + 1.0) % 2.0 - 1.0)


def closing_sine(time: Array, rng: np.random.Generator) -> Array:
    """Return a sinusoid of amplitude pi/2 at 0.5 Hz that starts open, at 0."""
    return pi / 2.0 * (1.0 - np.cos(pi * time))


EXCITATIONS: dict[str, Excitation] = {
    "random_steps": random_steps,
    "sine": sine,
    "ramps": ramps,
    "stairs": stairs,
    "slow_ramps": slow_ramps,
    "long_holds": long_holds,
}
"""Commands to fit a model to, and to tell causes apart by."""

TEST_EXCITATIONS: dict[str, Excitation] = {
    **{f"steps_held_{hold}s": partial(steps_held, hold=float(hold)) for hold in (1, 2, 3)},
    "contact_ramp": contact_ramp,
    "closing_sine": closing_sine,
}
"""Commands on which the paper reports errors; the same in every run."""


DESIGNED = "designed"  # Stands for the excitation of a command that was made for one run


def find_excitation(name: str) -> Excitation:
    """Return an excitation of either table; an unknown name is refused."""
    return look_up("excitation", name, EXCITATIONS | TEST_EXCITATIONS)


def excite(
    name: str, duration: float, rng: np.random.Generator, rate: float = RATE
) -> tuple[Array, Array]:
    """Return time [s] and command [rad] of an excitation, shapes (T,).

    Args:
        duration: Length [s].
        rate: Rows per second [Hz].

    Raises:
        UnknownName: No such excitation; the message lists the known ones.
    """
    excitation = find_excitation(name)
    time = np.arange(round(duration * rate)) / rate
    return time, np.clip(excitation(time, rng), 0.0, LARGEST_COMMAND)
