"""Panels of lines over time as an SVG file, which every browser shows; without matplotlib."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, isfinite, log10

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 960, 150  # Size of a panel [px]
LEFT, RIGHT, TOP, GAP = 70, 150, 40, 44
POINTS_MAX = 1500  # Points of a line; beyond the picture's width nobody sees more
BAND_PIECES = 240  # Pieces of a band, 4 px each: more would be a slab of zigzags
COLOURS = ("#1f5fa8", "#c8501e", "#2f8f4e", "#8a4fb0")
Values = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class PanelLine:
    """Curve of one quantity over time."""

    name: str
    time: Values  # [s]
    values: Values
    # Whether it is drawn as its median, between its least and greatest, piece by piece: for what
    # scatters from row to row
    band: bool = False


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Lines of one unit."""

    title: str
    lines: tuple[PanelLine, ...]


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
        if line.band:
            line, area = summarised(line)
            path = polyline(area, (low, high), top, end)
            parts.append(f'<path d="{path}Z" fill="{colour}" fill-opacity="0.2"/>')
        parts.append(
            f'<path d="{polyline(line, (low, high), top, end)}" fill="none" stroke="{colour}" '
            'stroke-width="1.4" stroke-linejoin="round"/>'
            f'<text x="{LEFT + WIDTH + 10}" y="{top + 16 + 18 * place}" fill="{colour}">'
            f"{escape(line.name)}</text>"
        )
    return parts


def summarised(line: PanelLine) -> tuple[PanelLine, PanelLine]:
    """Return a line's medians, piece by piece, and the outline from the least to the greatest."""
    pieces = np.array_split(np.arange(line.time.size), min(BAND_PIECES, line.time.size))
    time = np.array([float(line.time[piece].mean()) for piece in pieces])
    least, median, most = (
        np.array([float(of(line.values[piece])) for piece in pieces])
        for of in (np.min, np.median, np.max)
    )
    outline = np.concatenate([most, least[::-1]])
    return (
        PanelLine(name=f"{line.name}, median", time=time, values=median),
        PanelLine(name=line.name, time=np.concatenate([time, time[::-1]]), values=outline),
    )


def polyline(line: PanelLine, bounds: tuple[float, float], top: float, end: float) -> str:
    """Return a line's path; of many points the least and greatest of each piece."""
    low, high = bounds
    x = LEFT + WIDTH * line.time / end
    y = top + HEIGHT * (high - line.values) / (high - low)
    chosen = np.arange(x.size)
    if x.size > POINTS_MAX:
        pieces = np.array_split(chosen, POINTS_MAX // 2)
        ends = [(part[y[part].argmin()], part[y[part].argmax()]) for part in pieces]
        chosen = np.sort(np.array(ends).ravel())
    words: list[str] = []
    pen = "M"
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
