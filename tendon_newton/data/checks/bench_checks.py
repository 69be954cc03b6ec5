"""What a recording holds that its bench cannot do."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.recording import Array, Recording

PUSH = 0.1  # [N] mean below zero that no load cell's offset explains after taring
STRONGER = 1.5  # [1] times the servo's limit, which no load cell misses by
OVERSHOOT = 0.05  # [1] of the range, which no end stop gives way by
REACH = 5.0  # [1] times the bench's range, which no spool misses by
HEAVIER = 100.0  # [1] times the asset's mass: a thousand is grams for kilograms


@dataclass(frozen=True, kw_only=True)
class BenchFacts:
    """What a bench's asset says of it."""

    name: str
    force_limit: float  # The most that a servo of it pulls [N], or turns with [N m]
    pulls: bool  # Whether strings pull joints that have ends
    reach: float | None  # Turn of the motor from one end of all joints to the other [rad]
    rail: tuple[float, float] | None = None  # Range of a cart [m]; None for anything else
    per_angle: float = 0.0  # Place of the cart per angle of its motor [m/rad]
    masses: tuple[float, ...] = ()  # Masses of its links [kg]


def against(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """Say what a recording holds that its bench cannot do."""
    yield from too_heavy(recording, bench)
    if recording.force is not None:
        yield from too_strong(recording, recording.force, bench)
        yield from beyond_rail(recording, bench)
        if bench.pulls:
            yield from pushed(recording, recording.force)
            yield from beyond_reach(recording, bench)


def too_heavy(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """A mass that is stated far from the asset's."""
    masses = recording.bench_overrides.mass or ()
    for stated, own in zip(masses, bench.masses, strict=False):
        if not 1.0 / HEAVIER < stated / own < HEAVIER:
            yield Examined(recording.name, "bench_overrides").defect(
                f"say a mass of {stated:g} kg, and the asset of {bench.name} {own:.3g} kg",
                "masses are in kg: divide grams by 1000, or mend the asset",
            )
            return


def too_strong(recording: Recording, force: Array, bench: BenchFacts) -> Iterator[Finding]:
    """A force that is far beyond what the asset lets its servo give."""
    most = float(np.abs(force).max())
    if most > STRONGER * bench.force_limit:
        yield Examined(recording.name, "force").defect(
            f"reaches {most:.4g}, and the servo of {bench.name} gives at most "
            f"{bench.force_limit:.4g} by its asset",
            "a simulation stops at the asset's limit: raise tendon:forceLimit there "
            "(--force-limit of asset new), or the force is in another unit",
        )


def beyond_rail(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """A cart that stands where its rail has ended."""
    if bench.rail is None:
        return
    place = recording.motor_position[:, 0] * bench.per_angle
    low, high = bench.rail
    beyond = float(max(low - place.min(), place.max() - high))
    if beyond > OVERSHOOT * (high - low):
        yield Examined(recording.name, "theta").defect(
            f"lies up to {beyond:.3g} m beyond the range of {bench.name}, {low:.3g} to {high:.3g} "
            "m",
            "its zero is another one (offset in the mapping), or the range is (--range of asset "
            "new)",
        )


def pushed(recording: Recording, force: Array) -> Iterator[Finding]:
    """A tension below zero: a string cannot push."""
    mean = float(force.mean())
    if mean < -PUSH:
        share = float((force < 0.0).mean())
        yield Examined(recording.name, "force").defect(
            f"{mean:.2f} N on average, below zero in {100.0 * share:.0f} % of the rows",
            "a string cannot push: its sign is the other one (sign = -1 in the mapping), or its "
            "zero is off",
        )


def beyond_reach(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """A motor that turns much farther than its bench reaches."""
    span = float(np.ptp(recording.motor_position, axis=0).max())
    if bench.reach is not None and span > REACH * bench.reach:
        yield Examined(recording.name, "theta").defect(
            f"spans {span:.3g} rad, and the whole range of {bench.name} is {bench.reach:.3g} rad",
            'theta is in degrees (unit = "deg" in the mapping), or the bench is another one',
        )
