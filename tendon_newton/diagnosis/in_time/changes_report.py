"""``changes.html`` and ``changes.json``: what changed since a day, in words and numbers."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.together import together, with_hashes
from tendon_newton.data.plain_numbers import estimate_text, quantity
from tendon_newton.data.servo_names import servo_of
from tendon_newton.diagnosis.in_time.changes import Change, Changes
from tendon_newton.diagnosis.in_time.log_events import Event
from tendon_newton.diagnosis.in_time.walks import MENDED, walk_of
from tendon_newton.diagnosis.reporting.inline_svg import AFTER, FAINT, INK, svg
from tendon_newton.diagnosis.reporting.page import write_page

SCHEMA = 1
CHANGES = "changes.json"
TEMPLATE = "changes.html.jinja"
STRANGE = 3.0
"""Errors of the last day's model, in those of the first day's on its own day, from which something
else is the matter [1]: another command plan makes one and a half."""
SIZE = (3.6, 1.9)  # Width and height of the picture of a number's course [inch]
DayByDay = Mapping[str, Changes]
"""Name of a day -> what changed until then, in the order of the days."""


def sentence(change: Change) -> str:
    """Say how far a number moved, and the next step; or whether a mend moved it."""
    walk, by = walk_of(change.cause), change.value - change.before
    servo = servo_of(change.cause)
    owner = "" if servo is None else f" of servo {servo}"
    grown = f"has {'grown' if by > 0.0 else 'fallen'} by"
    if math.isinf(by):
        how = f"is now {quantity(change.value, change.unit)}"
    elif change.unit == "1" and change.before:
        how = f"{grown} {100.0 * abs(by / change.before):.1f} %"
    else:
        how = f"{grown} {quantity(abs(by), change.unit)}"
    if change.mended and not change.moved:
        value, interval = estimate_text(change.cause, change.name, change)
        return (
            f"The {walk.what}{owner} was mended and has not moved, as far as these recordings can "
            f"tell: it was {quantity(change.before, change.unit)}, and is {value} ({interval})."
        )
    if change.mended:
        return f"The {walk.what}{owner} {how}, as it was mended: take the new model."
    step = MENDED if walk.wears * by < 0.0 else walk.mend
    others = " or ".join(walk_of(rival).what for rival in change.rivals)
    doubt = f" (or the {others} instead)" if others else ""
    return f"The {walk.what}{owner} {how}{doubt}: {step}."


def steps_of(changes: Changes) -> list[str]:
    """Say what to do next: a doubt about the whole comes first."""
    return [*filter(None, [doubt(changes)]), *map(sentence, told(changes))]


def told(changes: Changes) -> list[Change]:
    """Return the numbers that moved, and those that somebody mended."""
    return [change for change in changes.numbers if change.moved or change.mended]


EVENTS = {
    "slip": "The string slipped by {size}",
    "skip": "The angle skipped by {size}",
    "knock": "Something pushed with {size}",
    "dip": "The supply fell by {size}",
}
"""Kind of an event -> what happened, in words."""


def event_sentence(event: Event) -> str:
    """Say what happened in a recording, and when."""
    share = f"{100.0 * event.size:.0f} %"
    size = share if event.kind == "dip" else quantity(event.size, event.unit)
    words = EVENTS[event.kind].format(size=f"at least {size}" if event.at_least else size)
    until = "" if event.end is None else f" to {event.end:.2f} s"
    return f"{words} at {event.start:.2f} s{until} in {event.recording}."


def answer_lines(days: DayByDay) -> list[str]:
    """Return what a terminal shows of some days."""
    return [
        line
        for name, changes in days.items()
        for line in (
            f"{name}: {headline(changes)}",
            *(f"  {step}" for step in steps_of(changes)),
            *(f"  {event_sentence(event)}" for event in changes.events),
        )
    ]


def headline(changes: Changes) -> str:
    """Return the answer in one sentence."""
    moved = [walk_of(change.cause).what for change in changes.moved]
    if not moved:
        return "Nothing has changed, as far as these recordings can tell."
    return f"Changed: {', '.join(dict.fromkeys(moved))}."


def doubt(changes: Changes) -> str:
    """Say that what moved does not account for the errors that are left; empty where it does."""
    now, usual = changes.after, changes.usual
    if usual is None:
        return ""
    pairs = [(now.theta_rmse, usual.theta_rmse, "rad")]
    if now.force_rmse is not None and usual.force_rmse is not None:
        pairs.append((now.force_rmse, usual.force_rmse, "N"))
    left, before, unit = max(pairs, key=lambda pair: pair[0] / max(pair[1], 1e-12))
    if left <= STRANGE * before:
        return ""
    return (
        f"With these numbers the model still errs by {quantity(left, unit)}, on its own day by "
        f"{quantity(before, unit)}. This is another bench, or something else changed: diagnose "
        "these recordings without --against."
    )


def number_json(change: Change) -> dict[str, Any]:
    """Return what a program reads of a number; None stands for infinity, which JSON has not."""
    finite = [x if math.isfinite(x) else None for x in (change.before, change.value, *change.ci95)]
    before, value, *ends = finite
    return {**asdict(change), "before": before, "value": value, "ci95": ends}


def to_json(changes: Changes) -> dict[str, Any]:
    """Return what a program reads of one day."""
    return {
        "numbers": [number_json(change) for change in changes.numbers],
        "next_steps": [sentence(change) for change in told(changes)],
        "doubt": doubt(changes),
        "events": [asdict(event) for event in changes.events],
        "before": asdict(changes.before),
        "after": asdict(changes.after),
        "on_its_own_day": None if changes.usual is None else asdict(changes.usual),
    }


def write_changes(out: Path, days: DayByDay, against: str) -> None:
    """Write both files.

    Raises:
        InvalidOutput: A file cannot be written.
    """
    last = list(days.values())[-1]
    table = {name: to_json(changes) for name, changes in days.items()}
    changes = {"schema": SCHEMA, "against": against, "days": table}
    content = {
        "headline": headline(last),
        "subject": f"{', '.join(days)}, against {against}",
        "steps": steps_of(last),
        "events": [event_sentence(e) for changes in days.values() for e in changes.events],
        "rows": [row(change) for change in last.numbers],
        "panels": [course(days, k) for k in range(len(last.numbers))] if len(days) > 1 else [],
    }
    with together() as drafts:
        write_json(out / CHANGES, with_hashes(changes, drafts, out))
        write_page(out / "changes.html", "tendon_newton.diagnosis.in_time", TEMPLATE, content)


def row(change: Change) -> dict[str, Any]:
    """Return what the table shows of a number."""
    value, interval = estimate_text(change.cause, change.name, change)
    return {
        "name": f"{change.cause}: {change.name}".replace("_", " "),
        "before": quantity(change.before, change.unit),
        "after": value,
        "interval": interval,
        "probability": f"{100.0 * change.probability:.0f} %",
        "moved": change.moved,
    }


def course(days: DayByDay, place: int) -> str:
    """Draw one number with its interval on every day that has it, beside where it stood before."""
    last = list(days.values())[-1].numbers[place]
    places = {
        day: change
        for day, changes in days.items()
        for change in changes.numbers
        if (change.cause, change.name) == (last.cause, last.name)
    }

    def draw(axes: Any) -> None:
        axes.axhline(last.before, color=FAINT)
        for k, change in enumerate(places.values()):
            axes.plot([k, k], change.ci95, color=AFTER, linewidth=5, alpha=0.35)
            axes.plot(k, change.value, "o", color=AFTER if change.moved else FAINT, markersize=5)
        axes.set_xlim(-0.5, len(places) - 0.5)
        axes.set_xticks(range(len(places)), list(places), rotation=30, ha="right")
        axes.set_ylabel("" if last.unit == "1" else last.unit)
        axes.set_title(f"{last.cause}: {last.name}".replace("_", " "), color=INK)

    label = f"course of {last.cause} {last.name} over {len(places)} days"
    return svg(f"course-{last.cause}-{last.name}".replace(" ", "-"), label, SIZE, draw)
