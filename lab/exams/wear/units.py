"""Virtual servos over ten days, of which one part wears or none: the plant of `oscillations`.

The plant has two masses on an elastic gear with play, LuGre friction, a limited duty and a string
that holds the joint against a spring. It shares no law with what looks at its logs. Temperature
changes friction and damping from day to day, and a payload changes inertia and balance.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lab.exams.oscillations.plant import Array, Loops, run

PARTS = ("play", "friction", "string", "gain")
DAYS = 10
DURATIONS = (20.0, 30.0)  # Of a day's log [s]
GROWN = (1.4, 3.0)  # Times that an effect grows in ten days [1]
COUNT = 2.0 * np.pi / 4096


@dataclass(frozen=True, kw_only=True)
class Unit:
    """One servo, its logs of ten days, and the truth."""

    part: str  # ``none`` where nothing wears
    effect: Array  # Size of the worn part's effect against the first day [1], shape (10,)
    row: float  # Time between rows [s]
    command: tuple[Array, ...]  # Of each day [rad]
    angle: tuple[Array, ...]  # Likewise

    @property
    def doubled(self) -> int:
        """First day on which the effect has doubled; the number of days where on none."""
        return int(np.argmax(self.effect >= 2.0)) if (self.effect >= 2.0).any() else DAYS


def drawn_units(seed: int, each: int) -> Iterator[Unit]:
    """Draw units, so many of each part, and as many in all of which nothing wears."""
    rng = np.random.default_rng(seed)
    parts = [part for part in (*PARTS, *(len(PARTS) * ["none"])) for _ in range(each)]
    number, shape = len(parts), (DAYS, len(parts))

    def spread(low: float, high: float) -> Array:
        return np.exp(rng.uniform(np.log(low), np.log(high), number))

    damping, top, pace = spread(15.0, 60.0), spread(4.0, 14.0), rng.uniform(0.15, 0.4, number)
    stiffness = damping**2 * pace  # duty and torque of one radian, by inertia [1/s^2]
    friction, load = spread(6e-3, 3e-2), spread(0.15, 0.6)
    soft = rng.uniform(0.35, 0.75, number)  # share of the string in what gives way
    # wear that slows down, or hurries
    share = np.linspace(0.0, 1.0, DAYS)[:, None] ** spread(0.7, 1.6)
    effect = 1.0 + (spread(*GROWN) - 1.0) * share
    worn = {name: np.where([part == name for part in parts], effect, 1.0) for name in PARTS}
    warm = np.exp(0.1 * rng.normal(size=shape))  # colder days: both frictions
    loaded = rng.uniform(0.85, 1.15, shape)  # inertia
    coulomb = friction * stiffness * worn["friction"] * warm / loaded
    servo_gain = damping * pace / top
    row = 1.0 / rng.choice([30.0, 50.0, 80.0, 100.0], number)
    zero = np.zeros(shape)
    days = Loops(
        outer=zero,
        servo_gain=zero + servo_gain,
        servo_integral=zero,
        strength=stiffness / servo_gain / worn["gain"] / loaded,
        damping=damping * warm / loaded,
        coulomb=coulomb,
        static=coulomb * rng.uniform(1.1, 1.6, number),
        slow=zero + spread(0.05, 0.3),
        play=spread(0.008, 0.03) * worn["play"],
        load=zero + rng.uniform(0.1, 0.4, number),
        gear=zero + 2.0 * np.pi * spread(40.0, 80.0),
        delay=zero + spread(4e-3, 3e-2),
        gain=zero,
        integral=zero,
        row=zero + row,
        spring=load * stiffness / (1.0 + soft * (worn["string"] - 1.0)) / loaded,
        rest=rng.uniform(-0.15, 0.15, number) + 0.02 * rng.normal(size=shape),
    )
    durations = rng.uniform(*DURATIONS, shape)
    steps = round(1e3 * float(durations.max()))
    goal = np.stack([teleoperated(rng, steps) for _ in range(DAYS * number)], axis=1)
    flat = Loops(**{name: np.ravel(values) for name, values in vars(days).items()})
    noise = rng.normal(size=goal.shape) * np.tile(spread(1e-4, 1e-3), DAYS)
    _, angle, _ = run(flat, goal, noise, COUNT)
    for k, part in enumerate(parts):
        places = k + number * np.arange(DAYS)
        every = round(1e3 * float(row[k]))
        rows = [np.arange(0, round(1e3 * duration), every) for duration in durations[:, k]]
        yield Unit(
            part=part,
            effect=worn[part][:, k] if part in PARTS else np.ones(DAYS),
            row=1e-3 * every,
            command=tuple(goal[r, p] for r, p in zip(rows, places, strict=True)),
            angle=tuple(angle[r, p] for r, p in zip(rows, places, strict=True)),
        )


def teleoperated(rng: np.random.Generator, steps: int) -> Array:
    """Draw a hand's motion: reaches with bell-shaped speed, pauses, and a slight tremor [rad]."""
    time = 1e-3 * np.arange(steps)
    knots, levels = [0.0], [float(rng.uniform(-0.3, 0.3))]
    while knots[-1] < time[-1]:
        knots.append(knots[-1] + float(rng.choice([0.05, 0.4])) * float(rng.exponential()) + 0.02)
        levels.append(levels[-1])
        level = float(rng.uniform(-0.6, 0.6))
        knots.append(knots[-1] + 0.25 + float(rng.uniform(0.8, 3.0)) * abs(level - levels[-1]))
        levels.append(level)
    at = np.searchsorted(knots, time, side="right") - 1
    at = np.minimum(at, len(knots) - 2)
    start, end = np.array(knots)[at], np.array(knots)[at + 1]
    share = (time - start) / (end - start)
    bell = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    low, high = np.array(levels)[at], np.array(levels)[at + 1]
    tremor = 2e-3 * np.sin(2.0 * np.pi * 8.0 * time + rng.uniform(0.0, 6.0))
    return low + (high - low) * bell + tremor
