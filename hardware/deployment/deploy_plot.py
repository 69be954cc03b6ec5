"""A log as a picture, without a display and without matplotlib: SVG, which every browser shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, isfinite, log10
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hardware.deployment.deploy_log import STEP_TOPIC, TIMING_FIELDS, TIMING_TOPIC, servo_count_of
from tendon_newton.data.cards.policy_observation import goal_angle
from tendon_newton.data.formats.mcap_file import McapReading, read_mcap
from tendon_newton.data.formats.topic_mapping import STATE_TOPIC

WIDTH, HEIGHT = 960, 150
"""Size of a panel [px]."""
LEFT, RIGHT, TOP, GAP = 70, 150, 40, 44
POINTS_MAX = 1500
"""Points of a line; beyond the picture's width nobody sees more."""
COLOURS = ("#1f5fa8", "#c8501e", "#2f8f4e")
Values = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Line:
    """Curve of one quantity over time."""

    name: str
    time: Values
    """[s]"""
    values: Values


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Lines of one unit."""

    title: str
    lines: tuple[Line, ...]


def panels_of(path: Path) -> tuple[Panel, ...]:
    """Gather what a log shows: goal and tip, spool, tension, timing."""
    log = read_mcap(path, bench="finger")
    goals, late = logged_lines(path)
    if log.tip is not None:
        tip = np.degrees(goal_angle(log.tip[:, 0], log.tip[:, 1]))
        goals.append(Line(name="tip", time=log.time, values=tip))
    servos = log.motor_position.shape[1]
    panels = [Panel(title="goal angle [deg]", lines=tuple(goals))]
    for d in range(servos):
        of = f" of servo {d}" if servos > 1 else ""
        spool = [Line(name="measured", time=log.time, values=log.motor_position[:, d])]
        if log.command is not None:
            spool.insert(0, Line(name="command", time=log.time, values=log.command[:, d]))
        panels.append(Panel(title=f"spool angle{of} [rad]", lines=tuple(spool)))
    force = []
    if log.force is not None:
        force = [
            Line(name=f"load cell {d}" if servos > 1 else "load cell", time=log.time, values=column)
            for d, column in enumerate(log.force.T)
        ]
    panels.append(Panel(title="tension [N]", lines=tuple(force)))
    panels.append(Panel(title="loop timing [ms]", lines=tuple(late)))
    return tuple(panel for panel in panels if panel.lines)


def logged_lines(path: Path) -> tuple[list[Line], list[Line]]:
    """Return goals and timing of a deployment; any other log has neither."""
    first: int | None = None
    goals: list[tuple[float, float]] = []
    timing: list[tuple[float, float, float]] = []
    with path.open("rb") as file:
        wanted = {STATE_TOPIC, STEP_TOPIC, TIMING_TOPIC}
        for topic, stamp, message in McapReading(file, path.name).messages(wanted):
            first = stamp if first is None else first
            seconds = 1e-9 * (stamp - first)
            if topic == STEP_TOPIC and (place := goal_place(len(message.data))) is not None:
                goals.append((seconds, np.degrees(message.data[place])))
            elif topic == TIMING_TOPIC and len(message.data) == len(TIMING_FIELDS):
                timing.append((seconds, 1e3 * message.data[1], 1e3 * message.data[2]))
    time, alpha = columns(goals, 2)
    instants, lateness, length = columns(timing, 3)
    return (
        [Line(name="goal", time=time, values=alpha)] if goals else [],
        [
            Line(name="lateness", time=instants, values=lateness),
            Line(name="tick's length", time=instants, values=length),
        ]
        if timing
        else [],
    )


def goal_place(width: int) -> int | None:
    """Return where the goal stands among the numbers of a step; none if it is no step of ours."""
    servos = servo_count_of(width)
    return None if servos is None else 4 * servos


def columns(rows: Sequence[tuple[float, ...]], width: int) -> Values:
    """Return rows as columns."""
    return np.array(rows, dtype=np.float64).reshape(-1, width).T


def draw(panels: Sequence[Panel], title: str) -> str:
    """Draw panels one below the other, over the same time, as the text of an SVG file."""
    end = max((float(line.time[-1]) for panel in panels for line in panel.lines), default=1.0)
    height = TOP + len(panels) * (HEIGHT + GAP)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + WIDTH + RIGHT} {height}" '
        'font-family="sans-serif" font-size="12" fill="#2b2f36">',
        '<rect width="100%" height="100%" fill="white"/>',
        f'<text x="{LEFT}" y="22" font-size="15">{escape(title)}</text>',
    ]
    for place, panel in enumerate(panels):
        parts += draw_panel(panel, TOP + 14 + place * (HEIGHT + GAP), max(end, 1e-3))
    return "\n".join([*parts, "</svg>", ""])


def draw_panel(panel: Panel, top: float, end: float) -> list[str]:
    """Draw axes, names and lines of a panel."""
    finite = np.concatenate([line.values[np.isfinite(line.values)] for line in panel.lines])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    margin = 0.05 * (high - low) or 0.5
    low, high = low - margin, high + margin
    parts = [f'<text x="{LEFT}" y="{top - 6}" font-weight="bold">{escape(panel.title)}</text>']
    for value in ticks(low, high):
        y = top + HEIGHT * (high - value) / (high - low)
        parts.append(
            f'<path d="M{LEFT} {y:.1f}h{WIDTH}" stroke="#e4e6ea"/>'
            f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>'
        )
    for value in ticks(0.0, end):
        x = LEFT + WIDTH * value / end
        parts.append(
            f'<text x="{x:.1f}" y="{top + HEIGHT + 16}" text-anchor="middle">{value:g} s</text>'
        )
    for place, line in enumerate(panel.lines):
        colour = COLOURS[place % len(COLOURS)]
        parts.append(
            f'<path d="{polyline(line, (low, high), top, end)}" fill="none" stroke="{colour}" '
            'stroke-width="1.4" stroke-linejoin="round"/>'
            f'<text x="{LEFT + WIDTH + 10}" y="{top + 16 + 18 * place}" fill="{colour}">'
            f"{escape(line.name)}</text>"
        )
    return parts


def polyline(line: Line, bounds: tuple[float, float], top: float, end: float) -> str:
    """Return a line's path; of many points the least and greatest of each piece."""
    low, high = bounds
    x = LEFT + WIDTH * line.time / end
    y = top + HEIGHT * (high - line.values) / (high - low)
    chosen = np.arange(x.size)
    if x.size > POINTS_MAX:
        pieces = np.array_split(chosen, POINTS_MAX // 2)
        ends = [(part[y[part].argmin()], part[y[part].argmax()]) for part in pieces]
        chosen = np.sort(np.array(ends).ravel())
    words, pen = [], "M"
    for k in chosen:
        if isfinite(y[k]):
            words.append(f"{pen}{x[k]:.1f} {y[k]:.1f}")
            pen = "L"
        else:
            pen = "M"
    return "".join(words)


def ticks(low: float, high: float) -> list[float]:
    """Return four to ten round numbers between two."""
    raw = (high - low) / 5.0
    power = 10.0 ** floor(log10(raw))
    step = power * min(factor for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= raw)
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [round(k * step, 10) for k in range(first, last + 1)]
