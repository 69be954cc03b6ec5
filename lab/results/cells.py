"""What cells of tables are made of."""

from collections.abc import Iterable, Mapping, Sequence
from statistics import mean
from typing import Any

from lab.results.record import Record

Records = Mapping[str, Record]
ASKED = (30, 60, 90)  # Rates that hands are asked for [rad/min]
BESIDE = {
    "in_plant_or_class": ("constant", "in_plant"),
    "material_faults_named": ("constant", "faults"),
    "planted_found": ("constant_planted",),
}
"""Where a summary has what constant answers reach of a rate."""


def table(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a Markdown table."""
    lines = (heads, ["---"] * len(heads), *rows)
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def about(values: Sequence[float], digits: int = 1) -> str:
    """Return mean and range."""
    low, high = min(values), max(values)
    return f"{mean(values):.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def hands(record: Record, policy: str) -> list[float]:
    """Return what a policy turns on each hand [rad/min]."""
    return [hand["turned_rad_per_min"] for hand in record.figures[policy]["hands"]]


def of_rate(rate: Mapping[str, Any] | None) -> str:
    """Return a count as a rate with its lower 95 % bound; nothing for what cannot be counted."""
    if not rate or not rate["of"]:
        return ""
    return f"{rate['hits']} of {rate['of']}: {rate['rate']:.0%} ({rate['at_least']:.0%})"


def with_interval(ends: Sequence[float], digits: int = 2) -> str:
    """Return a number with its 95 % interval, of the number and both ends."""
    value, low, high = (f"{x:.{digits}f}" for x in ends)
    return f"{value} [{low}, {high}]"


def share(value: float | None) -> str:
    """Return a share in percent; nothing where it means nothing."""
    return "" if value is None else f"{value:.0%}"


def constant(total: Mapping[str, Any], name: str) -> str:
    """Return what a fixed answer and random ones reach of a rate, where it means something."""
    found: Any = total if name in BESIDE else {}
    for key in BESIDE.get(name, ()):
        found = found.get(key, {})
    words = {"fixed": "fixed", "random": "random", "class": "class of three"}
    told = [f"{words[key]} {share(value)}" for key, value in found.items() if value is not None]
    return ", ".join(told)
