"""What a recording holds that its bench cannot do."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.measures import names_of, rows_text
from tendon_newton.data.checks.set_checks import LEAST_SLOW, SLOW
from tendon_newton.data.recording import FEW_ROWS, FREE, Array, Recording

PUSH = 0.1  # [N] mean below zero that no load cell's offset explains after taring
LEAST_READINGS = 4.0  # Readings of a cell in a recording, below which it was not asked
STRONGER = 1.5  # [1] times the servo's limit, which no load cell misses by
FEW = 0.05  # [1] of the rows, which noise and impacts reach
ZERO_OFF = 0.075  # [1] of the servo's strongest pull; what less is, a diagnosis names
VARIED = 0.1  # [1] of a mean tension, by which it must vary to tell a slope
LEAST_SLACK = 20  # Rows with a slack string from which their tension counts
AS_STRONG = 4.0  # [1] times what springs and gravity take; friction and hidden stops reach 2
OFTEN = 0.5  # [1] of the rows or of the mean tension, which no offset of a cell makes
OVERSHOOT = 0.05  # [1] of the range, which no end stop gives way by
REACH = 5.0  # [1] times the bench's range, which no spool misses by
OTHER_UNIT = {
    "mass": ("kg", "masses are in kg: divide grams by 1000"),
    "moment_arm": ("m", "moment arms are in m: divide millimetres by 1000"),
    "stiffness": (
        "N m/rad or N/m",
        "stiffnesses are in N m/rad, those of sliders in N/m: one of N m/deg is times 57.3",
    ),
}
"""Number that a recording may state of its bench -> its unit, and what to do."""
ZERO_MEND = (
    "the cell's zero is off: tare it without a string, or say offset for force in the mapping"
)
FAR_OFF = 30.0  # [1] times the asset's number; a degree is 57 times off, and a gram 1000


@dataclass(frozen=True, kw_only=True)
class MotorWay:
    """How far the joints' ranges let a motor go."""

    ends: tuple[float, float]  # Excursions at which all joints that it moves are at an end [m]
    radius: float  # Excursion per angle of the motor [m/rad]
    direct: bool  # Whether a shaft stands in for the string
    arm: float  # Excursion per angle or place of the first joint [m/rad, 1]
    unit: str  # Of that joint's place


@dataclass(frozen=True, kw_only=True)
class BenchFacts:
    """What a bench's asset says of it."""

    name: str
    force_limit: float  # The most that a servo of it pulls [N], or turns with [N m]
    pulls: bool  # Whether strings pull joints that have ends
    ways: tuple[MotorWay, ...] = ()  # Of each motor
    # Gives excursions [m], increasing, and the tension that holds each [N]; None without one string
    holds: Callable[[], tuple[Array, Array] | None] = lambda: None
    # Numbers that a recording may state otherwise, by the key of ``bench_overrides``
    numbers: Mapping[str, tuple[float, ...]] = field(default_factory=dict[str, tuple[float, ...]])


def against(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """Say what a recording holds that its bench cannot do."""
    yield from another_unit(recording, bench)
    yield from beyond_ends(recording, bench)
    yield from upside_down(recording, bench)
    if recording.force is not None:
        yield from too_strong(recording, recording.force, bench)
        if bench.pulls:
            yield from pushed(recording, recording.force, bench)
            angles = [*slack(recording, recording.force, bench), *beyond_reach(recording, bench)]
            yield from angles or weighed(recording, recording.force, bench)


def another_unit(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """A number of the bench that is stated far from the asset's, and a rate that is a period."""
    rate = recording.load_cell_rate
    if rate is not None and rate * recording.duration < LEAST_READINGS:
        yield Examined(recording.name, "load_cell_rate").defect(
            f"is {rate:g} Hz, {rate * recording.duration:.2g} readings in all",
            "it is how many readings a second the cell gives, not the time between two",
        )
    for key, (unit, mend) in OTHER_UNIT.items():
        told = recording.bench_overrides.given.get(key, ())
        pairs = zip(told, bench.numbers.get(key, ()), strict=False)
        for stated, own in (pair for pair in pairs if all(pair)):
            if not 1.0 / FAR_OFF < abs(stated / own) < FAR_OFF:
                yield Examined(recording.name, "bench_overrides").defect(
                    f"say a {key} of {stated:g} {unit}, and the asset of {bench.name} {own:.3g} "
                    f"{unit}",
                    f"{mend}, or mend the asset",
                )
                break


def too_strong(recording: Recording, force: Array, bench: BenchFacts) -> Iterator[Finding]:
    """A force that is far beyond what the asset lets its servo give."""
    most, beyond = (
        float(np.abs(force).max()),
        np.abs(force).max(axis=1) > STRONGER * bench.force_limit,
    )
    if 0.0 < beyond.mean() <= FEW_ROWS:
        yield Examined(recording.name, "force").defect(
            f"{rows_text(beyond, recording.time)} lie beyond what the servo of {bench.name} gives, "
            f"at up to {most:.4g}",
            "the load cell was not read there: leave those rows out",
        )
    elif beyond.any():
        yield Examined(recording.name, "force").defect(
            f"reaches {most:.4g}, and the servo of {bench.name} gives at most "
            f"{bench.force_limit:.4g} by its asset",
            "a simulation stops at the asset's limit: raise tendon:forceLimit there "
            "(--force-limit of asset new), or the force is in another unit",
        )


def beyond_ends(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """A motor that goes on where the stated ranges of all joints have ended.

    A string that is slack leaves its motor free, so that it has one end alone.
    """
    stated = recording.actuator_overrides.get("spool_radius")
    columns = zip(names_of(recording, "theta"), recording.motor_position.T, strict=True)
    for way, (column, theta) in zip(bench.ways, columns, strict=False):
        low, high = way.ends
        wound = theta * (stated or way.radius)
        beyond = max(float(wound.max()) - high, low - float(wound.min()) if way.direct else 0.0)
        if not OVERSHOOT * (high - low) < beyond < REACH * (high - low):
            continue
        seen, arm = Examined(recording.name, column), way.arm
        if way.direct:
            yield seen.defect(
                f"lies up to {beyond / arm:.3g} {way.unit} beyond the range of {bench.name}, "
                f"{low / arm:.3g} to {high / arm:.3g} {way.unit}",
                "its zero is another one (offset in the mapping), or the range is (--range of "
                "asset new)",
            )
        else:
            yield seen.caution(
                f"winds in {1e3 * wound.max():.3g} mm, and all joints of {bench.name} are at their "
                f"ends at {1e3 * high:.3g} mm",
                "a simulation is stopped there: mend the joints' ranges (--range of asset new), "
                "spool_radius or the zero of theta, unless the string stretches so far",
            )


def upside_down(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """An angle that stays above the horizontal, of a mass that hangs from its shaft at 0."""
    columns = zip(names_of(recording, "theta"), recording.motor_position.T, strict=True)
    for way, (column, theta) in zip(bench.ways, columns, strict=False):
        hangs = way.direct and way.unit == "rad" and np.isinf(way.ends).all()
        if hangs and recording.command is not None and np.cos(theta).max() < 0.0:
            yield Examined(recording.name, column).caution(
                f"lies from {theta.min():.2f} to {theta.max():.2f} rad, and the mass of "
                f"{bench.name} hangs straight down at 0",
                "its zero is another one, unless the mass is held up there: counts of 4096 a turn "
                "have it at 2048 (offset = -3.14159 in the mapping, of theta_d too)",
            )


def pushed(recording: Recording, force: Array, bench: BenchFacts) -> Iterator[Finding]:
    """A tension below zero: a string cannot push."""
    mean = float(force.mean())
    if mean < -PUSH:
        share = float((force < 0.0).mean())
        yield Examined(recording.name, "force").defect(
            f"{mean:.2f} N on average, below zero in {100.0 * share:.0f} % of the rows",
            "a string cannot push: its sign is the other one (sign = -1 in the mapping), or its "
            "zero is off",
        )
    elif (below := np.min(force, axis=1) < -ZERO_OFF * bench.force_limit).mean() > FEW:
        yield Examined(recording.name, "force").defect(
            f"{rows_text(below, recording.time)} lie below zero, down to {force.min():.3g} N",
            ZERO_MEND,
        )


def weighed(recording: Recording, force: Array, bench: BenchFacts) -> Iterator[Finding]:
    """A tension at rest that is far from what springs and gravity take there."""
    held = bench.holds() if recording.obstacle == FREE else None
    if held is None:
        return
    radius = recording.actuator_overrides.get("spool_radius") or bench.ways[0].radius
    wound = recording.motor_position[:, 0] * radius
    slow = np.abs(np.gradient(recording.motor_position[:, 0], recording.time)) < SLOW
    taut, closed = held[0][[0, -1]]
    loose = slow & (wound < taut - OVERSHOOT * (closed - taut))
    if loose.sum() >= LEAST_SLACK and np.median(force[loose]) > ZERO_OFF * bench.force_limit:
        yield Examined(recording.name, "force").defect(
            f"is {np.median(force[loose]):.3g} N in the middle of "
            f"{rows_text(loose, recording.time)}, where theta lies below {taut / radius:.3g} rad "
            "and the string is slack",
            f"{ZERO_MEND}, or mend the zero of theta",
        )
    slow &= (wound > taut) & (wound < closed)
    needed, told = np.interp(wound, *held)[slow], force[slow, 0]
    if slow.sum() < LEAST_SLOW or np.std(needed) < VARIED * needed.mean():
        return
    times = float(told.mean() / needed.mean())
    grows = float((needed - needed.mean()) @ told / (needed.size * np.var(needed)))
    weak = times > 0.0 and max(times, grows) < 1.0 / AS_STRONG
    if weak or min(times, grows) > AS_STRONG:
        yield Examined(recording.name, "force").defect(
            f"is {told.mean():.3g} N in the mean of {slow.sum()} slow rows "
            f"({100.0 * slow.mean():.0f} %), where springs and gravity of {bench.name} take "
            f"{needed.mean():.3g} N, and grows {grows:.2g} times as fast",
            'force is in another unit (unit = "kgf" in the mapping), the scale of its cell is off, '
            "or the asset's springs and moment arms are",
        )
    elif times > 0.0 > grows:
        yield Examined(recording.name, "force").caution(
            f"falls in {slow.sum()} slow rows ({100.0 * slow.mean():.0f} %) where springs and "
            f"gravity of {bench.name} take more",
            "it is another run's or another motor's, or its clock differs: map the column of the "
            "same rows",
        )


def slack(recording: Recording, force: Array, bench: BenchFacts) -> Iterator[Finding]:
    """A tension of a string whose motor has let it go slack."""
    columns = zip(names_of(recording, "theta"), recording.motor_position.T, force.T, strict=True)
    for way, (column, theta, tension) in zip(bench.ways, columns, strict=False):
        low, high = way.ends
        let_go = theta * way.radius < low - OVERSHOOT * (high - low)
        if let_go.mean() > OFTEN and tension[let_go].mean() > OFTEN * tension.mean() > PUSH:
            yield Examined(recording.name, column).defect(
                f"is below {low / way.radius:.3g} rad in {100.0 * let_go.mean():.0f} % of the "
                f"rows, where a string of {bench.name} is slack, and pulls "
                f"{tension[let_go].mean():.3g} N",
                "angles grow as the string is wound in, from 0 where it is just taut: turn theta "
                "(sign = -1 in the mapping; theta_d too if it lies as low), or mend its zero",
            )


def beyond_reach(recording: Recording, bench: BenchFacts) -> Iterator[Finding]:
    """A motor that turns much farther than its bench reaches."""
    span = float(np.ptp(recording.motor_position, axis=0).max())
    reach = max((way.ends[1] - way.ends[0]) / way.radius for way in bench.ways)
    if span > REACH * reach:
        yield Examined(recording.name, "theta").defect(
            f"spans {span:.3g} rad, and the whole range of {bench.name} is {reach:.3g} rad",
            'theta is in degrees (unit = "deg" in the mapping), or the bench is another one',
        )
    elif 0.0 < span < reach / FAR_OFF:
        yield Examined(recording.name, "theta").caution(
            f"spans {1e3 * span:.3g} mrad, and the whole range of {bench.name} is {reach:.3g} rad",
            'theta and theta_d were in rad and taken for degrees (unit = "rad" in the mapping), or '
            "record a wider motion",
        )
