"""What makes a loop shake: what calms the identified loop when it is taken away or made less.

A loop that shakes without play and sticking shakes by its gain and its delay. Delay is the cause
where the least that no loop can do without (`least_delay`) would be calm at the same gain; else the
gain is. A loop that is calm without play, or without sticking and its integral, shakes by that.

A log leaves room for several loops. A change is proposed that calms all that tell it nearly as well
as the best.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.oscillations.servo_loop import NAMES, RANGES, Feedback, closed
from tendon_newton.data.recording import Array, Mask

QUICK_LOOP = 0.012  # Delay that a servo's own loop cannot do without [s]
PERIODS = 40.0  # Of a simulation
TAIL = 0.3  # Share of it that is looked at [1]
CALM = 0.35  # Share of the amplitude that was seen, below which a loop does not shake [1]
QUIET = 0.2  # Likewise, to which a proposed change brings it [1]
SAME = 0.35  # Share by which the loop's own frequency may be off [1]
SHARES = np.array([0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0])
"""What is left of a number that is made less [1], in the order in which it is tried."""
MARGIN = 0.5  # Of what just calms the loop, which is proposed [1]
A_PERIOD = 200  # Steps of a period


@dataclass(frozen=True, kw_only=True)
class ShakingLoop:
    """An identified loop that shakes."""

    numbers: Array  # In the order of `servo_loop.NAMES`, shape (9,)
    others: tuple[Array, ...] = ()  # Of loops that tell the log nearly as well, likewise
    feedback: Feedback
    frequency: float  # At which it was seen to shake [Hz]
    amplitude: float  # Likewise [rad]

    def number(self, name: str) -> float:
        """Return one of the servo's numbers."""
        return float(self.numbers[NAMES.index(name)])

    @property
    def least_delay(self) -> float:
        """Delay that no such loop can do without [s]: a row under a policy."""
        return QUICK_LOOP + (self.feedback.row if self.feedback.outer else 0.0)


@dataclass(frozen=True, kw_only=True)
class CalmingChange:
    """One number made less, as far as calms the loop."""

    what: str  # ``gain``, ``delay``, ``play``, ``integral`` or ``sticking``
    share: float  # What is left of it [1]


@dataclass(frozen=True, kw_only=True)
class Explained:
    """What makes a loop shake."""

    cause: str | None  # ``gain``, ``delay``, ``play`` or ``sticking``; None where not told
    own_frequency: float  # Of the identified loop by itself [Hz]; 0 where it is calm
    changes: tuple[CalmingChange, ...]  # What calms it alone; the cause's own first


LESSENED = ("gain", "delay", "play", "integral")
NONE = {name: least for name, (least, _) in RANGES.items()}
Tried = tuple[Mapping[str, float], float, float]
"""Numbers of the servo by name, and factors of the gain and of the integral."""


def explain(loop: ShakingLoop) -> Explained:
    """Find what makes a loop shake, and what would calm it."""
    linear = {"play": NONE["play"], "sticking": NONE["sticking"]}
    least = min(loop.least_delay, float(loop.number("delay")))
    trials: list[Tried] = [
        ({}, 1.0, 1.0),
        (linear, 1.0, 1.0),
        ({**linear, "delay": least}, 1.0, 1.0),
        ({"play": NONE["play"]}, 1.0, 1.0),
        ({"sticking": NONE["sticking"]}, 1.0, 1.0),
        ({}, 1.0, 0.0),
    ]
    shaking, paces = simulated(loop, trials)
    own = float(paces[0])
    if not shaking[0]:
        return Explained(cause=None, own_frequency=0.0, changes=())
    cause = cause_of([bool(one) for one in shaking])
    if abs(own / loop.frequency - 1.0) > SAME:
        cause = None
    head = "integral" if cause == "sticking" else cause
    ordered = sorted(calming(loop), key=lambda change: change.what != head)
    return Explained(cause=cause, own_frequency=own, changes=tuple(ordered))


def calming(loop: ShakingLoop) -> list[CalmingChange]:
    """Find numbers that calm a loop, and all that tell the log nearly as well, when made less.

    Where none calms them all, those count that calm the loop itself.
    """
    loops = [loop, *(replace(loop, numbers=numbers, others=()) for numbers in loop.others)]
    trials = [tried(one, what, float(s)) for one in loops for what in LESSENED for s in SHARES]
    bases = [one for one in loops for _ in range(len(LESSENED) * len(SHARES))]
    shaking, _ = simulated(loop, trials, bases, QUIET)
    tables = shaking.reshape(len(loops), len(LESSENED), len(SHARES))
    for chosen in (tables, tables[:1]):
        changes: list[CalmingChange] = []
        for k, what in enumerate(LESSENED):
            least = min(calm_share(one) for one in chosen[:, k])
            possible = least >= 0.0 and (what != "gain" or least > 0.0)  # no loop without a gain
            if what == "delay":
                possible &= least * loop.number("delay") > 0.5 * loop.least_delay
            if possible:
                changes.append(CalmingChange(what=what, share=MARGIN * least))
        if changes:
            return changes
    return []


def calm_share(shakes: Mask) -> float:
    """Return the greatest share below which a loop stays calm; -1 where none calms it."""
    calm = [k for k in range(len(shakes)) if not shakes[k]]
    steady = [k for k in calm if not shakes[k:].any()] or calm
    return float(SHARES[steady[0]]) if steady else -1.0


def cause_of(shakes: Sequence[bool]) -> str | None:
    """Return the cause by which of the first trials shake."""
    _, linear, in_time, tight, slippery, proportional = shakes[:6]
    if linear:
        return "gain" if in_time else "delay"
    if not tight and slippery:
        return "play"
    if not slippery and tight:
        return "sticking"
    if not tight and not slippery:  # either alone calms it
        return "play" if proportional else "sticking"
    return None


def simulated(
    loop: ShakingLoop,
    trials: Sequence[Tried],
    bases: Sequence[ShakingLoop] = (),
    share: float = CALM,
) -> tuple[Mask, Array]:
    """Tell which changed loops shake, and at what frequency [Hz], shape (N,) each.

    Args:
        bases: What each trial changes; the loop unless given.
        share: Of the amplitude that was seen, from which a loop shakes [1].
    """
    step, angles = run(loop, trials, bases)
    tail = angles[int((1.0 - TAIL) * len(angles)) :]
    middle = 0.5 * (tail.max(axis=0) + tail.min(axis=0))
    size = 0.5 * np.ptp(tail, axis=0)
    paces = np.array([crossings(column, step) for column in (tail - middle).T])
    shakes = (size > share * loop.amplitude) & (paces > 0.0)
    return shakes, paces


def tried(loop: ShakingLoop, what: str, share: float) -> Tried:
    """Return a loop of which a share of one number is left."""
    if what in ("delay", "play"):
        return {what: share * loop.number(what)}, 1.0, 1.0
    if what == "integral":
        return {}, 1.0, share
    return {}, share, 1.0 if loop.feedback.outer else share


def run(
    loop: ShakingLoop, trials: Sequence[Tried], bases: Sequence[ShakingLoop] = ()
) -> tuple[float, Array]:
    """Return the step [s] and the angles of changed loops that begin beside their goal [rad]."""
    numbers = np.array([one.numbers for one in bases or [loop] * len(trials)])
    gains = np.ones((len(trials), 2))
    for k, (changed, gain, integral) in enumerate(trials):
        for name, value in changed.items():
            numbers[k, NAMES.index(name)] = value
        gains[k] = gain, integral
    row = loop.feedback.row
    step = 1.0 / (A_PERIOD * loop.frequency)
    if loop.feedback.outer:
        step = row / max(1, int(np.ceil(row / step)))
    count = int(PERIODS / loop.frequency / step)
    kick = max(2.0 * loop.amplitude, 2.0 * loop.number("play"))
    return step, closed(numbers, loop.feedback, kick, step, count, gains=gains)


def crossings(angle: Array, step: float) -> float:
    """Return how often a second an angle about 0 swings from below a third to above [Hz]."""
    band = 0.33 * float(np.abs(angle).max(initial=0.0))
    side = np.where(angle > band, 1, np.where(angle < -band, -1, 0))
    far = np.flatnonzero(side)
    up = far[1:][(side[far[1:]] > 0) & (side[far[:-1]] < 0)]
    return (len(up) - 1) / (step * float(up[-1] - up[0])) if len(up) > 2 else 0.0
