"""What many results come to: names, errors and information, investigation against plan, paired."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from examples.studies.investigation.one_unit import BUDGETS, QUICK, Result

FACTOR = 2.0  # Within which information that came counts as predicted [1]
LEAST = 0.05  # Information below which nothing was predicted [bit]
RESAMPLES = 10_000  # Bootstrap draws of units


def unit_table(results: Sequence[Result]) -> str:
    """Return a row for each result."""
    lines = ["unit  way          planted  deserved of named    mrad       N  the end"]
    lines += [
        f"{r.unit:4d}  {r.way:11s}  {len(r.found)} of {len(r.planted)}   {r.deserved:3d} of "
        f"{r.named:2d}          {1e3 * r.theta:6.1f}  {r.force:6.3f}  {r.ended}"
        for r in sorted(results, key=lambda r: (r.unit, r.way))
    ]
    return "\n".join(lines)


def comparison(results: Sequence[Result]) -> str:
    """Return how investigations do against the plan on the same units."""
    found = {(r.unit, r.way): r for r in results}
    lines: list[str] = []
    for way, seconds in BUDGETS.items():
        pairs = [(own, found[unit, QUICK]) for (unit, how), own in found.items()
                 if how == way and (unit, QUICK) in found]  # fmt: skip
        if pairs:
            lines += compared(pairs, f"investigation of {seconds:.0f} s less plan")
    return "\n".join(lines) or "no unit was looked at in both ways"


def compared(pairs: Sequence[tuple[Result, Result]], what: str) -> list[str]:
    """Return lines that compare pairs of results."""
    lines = [f"{len(pairs)} units, {what} (95 % interval over units):"]
    for words, values in (
        ("planted causes named", [len(own.found) - len(plan.found) for own, plan in pairs]),
        ("deserved names", [own.deserved - plan.deserved for own, plan in pairs]),
        ("undeserved names", [
            own.named - own.deserved - plan.named + plan.deserved for own, plan in pairs
        ]),
        ("log2 of held-out error", [math.log2(own.error / plan.error) for own, plan in pairs]),
    ):  # fmt: skip
        low, high = interval(values)
        own = sum(v > 0 for v in values), sum(v < 0 for v in values)
        lines.append(
            f"  {words}: mean {np.mean(values):+.2f} [{low:+.2f}, {high:+.2f}]; more on {own[0]}, "
            f"fewer on {own[1]}"
        )
    return lines


def interval(values: Sequence[float]) -> tuple[float, float]:
    """Return the 95 % interval of a mean over units, by bootstrap."""
    draws = np.random.default_rng(0).choice(np.array(values), size=(RESAMPLES, len(values)))
    low, high = np.quantile(draws.mean(axis=1), (0.025, 0.975))
    return float(low), float(high)


def information(results: Sequence[Result]) -> str:
    """Return how many designed runs brought what was predicted, and what they took to compute."""
    runs = [run for result in results for run in result.runs]
    if not runs:
        return "no run has information expected and brought"
    lines = [f"{len(runs)} designed runs, information that came of that which was predicted:"]
    for word in ("names", "task"):
        own = [(run[word], run[f"{word}_came"]) for run in runs if run[word] > LEAST]
        good = sum(e / FACTOR <= came <= FACTOR * e for e, came in own)
        expected, came = (float(np.sum([pair[i] for pair in own])) for i in (0, 1))
        lines.append(
            f"  {word}: {good} of {len(own)} within a factor of {FACTOR:g}; {came:.1f} of "
            f"{expected:.1f} bits in all"
        )
    if seconds := [run["seconds"] for run in runs if "seconds" in run]:
        middle, most = np.median(seconds), max(seconds)
        lines.append(f"  time of one core for each: median {middle:.0f} s, most {most:.0f} s")
    return "\n".join(lines)
