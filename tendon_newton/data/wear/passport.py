"""The passport of a joint: its numbers day by day, which part wears, and when it is worn out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from tendon_newton.data.wear.day_fit import NUMBERS, DayFit, fit_days
from tendon_newton.data.wear.days import Day, stretches_of
from tendon_newton.data.wear.worn_parts import LEAST_DAYS, PARTS, TOLD, Trend, trends_of

DEGREE = np.pi / 180.0
INTERVAL = 1.96  # Deviations of a 95 % interval [1]
OPEN = 0.5  # Deviation of a number's logarithm from which a log does not tell it [1]
FOREVER = 3650.0  # Days after which a limit is no matter
COLUMNS = {"delay": (1e3, "ms", 0), "lag": (1e3, "ms", 0), "friction": (1.0 / DEGREE, "deg", 2),
           "play": (1.0 / DEGREE, "deg", 2), "gain": (100.0, "%", 1)}  # fmt: skip
"""What is shown of a day: factor, unit and digits."""


@dataclass(frozen=True, kw_only=True)
class Passport:
    """What the days tell of a joint."""

    joint: str
    days: tuple[Day, ...]  # That tell
    fits: tuple[DayFit, ...]  # Of each of them
    silent: tuple[str, ...]  # Days that do not tell, each with the reason
    trends: tuple[Trend, ...]  # Of every part; none where days are too few

    @property
    def wears(self) -> tuple[Trend, ...]:
        """Parts that wear, the first one ahead."""
        return tuple(one for one in self.trends if one.wears)

    @property
    def verdict(self) -> str:
        """``wears``, ``nothing wears`` or ``cannot tell``."""
        if self.wears:
            return "wears"
        told = bool(self.trends) and all(one.told for one in self.trends)
        return "nothing wears" if told else "cannot tell"


def passport_of(joint: str, place: int, days: Sequence[Day]) -> Passport:
    """Return the passport of one joint, by its place in the recordings."""
    stretches = [stretches_of(day, place) for day in days]
    silent = [
        f"{day.name}: it hardly moves, or for less than 4 s without a gap"
        for day, own in zip(days, stretches, strict=True)
        if not own
    ]
    moved = [(day, own) for day, own in zip(days, stretches, strict=True) if own]
    fits = fit_days([own for _, own in moved]) if moved else []
    told: list[tuple[Day, DayFit]] = []
    for (day, _), fit in zip(moved, fits, strict=True):
        if fit.told < TOLD:
            silent.append(f"{day.name}: a servo under a load tells {100.0 * fit.told:.0f} % of it")
        else:
            told.append((day, fit))
    used, fits = [day for day, _ in told], [fit for _, fit in told]
    trends: list[Trend] = []
    if len(used) >= LEAST_DAYS:
        trends = trends_of(np.array([day.day for day in used]), fits)
    return Passport(
        joint=joint, days=tuple(used), fits=tuple(fits), silent=tuple(silent), trends=tuple(trends)
    )


def number_of(fit: DayFit, name: str) -> tuple[float, float] | None:
    """Return a number with the half of its 95 % interval [SI]; None where the log leaves it open.

    Args:
        name: One of ``NUMBERS``, or ``gain``: the share of a command that the angle reaches.
    """
    source = name if name in NUMBERS else "load"
    value, spread = fit.number(source), fit.spread(source)
    if source != name:
        return 1.0 / (1.0 + value), INTERVAL * spread * value / (1.0 + value) ** 2
    return (value, INTERVAL * spread * value) if spread < OPEN else None


def passport_lines(seen: Passport) -> Iterator[str]:
    """Say what the days tell of a joint, a line each."""
    width = max([len("day"), *(len(day.name) for day in seen.days)])
    yield f"{seen.joint}:"
    yield f"  {'day':{width}}" + "".join(f"{name:>18}" for name in COLUMNS)
    for day, fit in zip(seen.days, seen.fits, strict=True):
        yield f"  {day.name:{width}}" + "".join(f"{cell(fit, name):>18}" for name in COLUMNS)
    yield from (f"  not told: {one}" for one in seen.silent)
    if not seen.trends:
        yield f"  cannot tell: {LEAST_DAYS} days that tell are needed, these are {len(seen.days)}"
        return
    span = seen.days[-1].day - seen.days[0].day
    for k, one in enumerate(seen.wears):
        yield from wear_lines(one, seen.days, first=k == 0)
    kept = [one for one in seen.trends if not one.wears]
    for one in kept:
        if one.told:
            seen_from = 100.0 * one.seen_from / span
            yield f"  {one.part}: does not wear; {seen_from:.1f} % a day would have shown"
    for one in kept:
        if not one.told:
            yield f"  {one.part}: cannot tell; not even a double effect would have shown"
    if not seen.wears:
        yield f"  {seen.verdict}"


def cell(fit: DayFit, name: str) -> str:
    """Return a number with the half of its interval."""
    found = number_of(fit, name)
    if found is None:
        return "not told"
    factor, unit, digits = COLUMNS[name]
    return f"{factor * found[0]:.{digits}f} +-{factor * found[1]:.{digits}f} {unit}"


def wear_lines(one: Trend, days: Sequence[Day], *, first: bool) -> Iterator[str]:
    """Say that a part wears, at what rate, and when it is worn out."""
    part = PARTS[one.part]
    low, high = (100.0 * share for share in one.ci95)
    yield (
        f"  wears {'first' if first else 'too'}: {one.part}, by {100.0 * one.rate:.1f} % a day "
        f"({low:.1f} to {high:.1f} with 95 %): {part.words}"
    )
    assert one.ends is not None
    where = (
        f"{one.part} of {part.ceiling / DEGREE:.0f} deg"
        if part.ceiling
        else "twice the first day's"
    )
    when, early, late = (day_text(at, days) for at in one.ends)
    yield f"    replace at {where} ({part.reason}): {when}, with 95 % from {early} to {late}"


def day_text(at: float, days: Sequence[Day]) -> str:
    """Return a day as a date, or as a count where the logs have no dates."""
    last = days[-1]
    if at - last.day > FOREVER:
        return "in over ten years"
    if last.day < FOREVER:
        return f"{at - last.day:+.0f} days from {last.name}"
    return date.fromordinal(int(np.ceil(at))).isoformat()
