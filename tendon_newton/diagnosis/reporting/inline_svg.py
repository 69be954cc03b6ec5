"""Matplotlib figures inside a page: text stays text, colours follow the page, names are unique."""

import html
import io
import re
from collections.abc import Callable
from typing import Any

INK, GREY, GRID = "#2b2f36", "#8a8f98", "#e4e6ea"
BEFORE, AFTER = "#d1603d", "#1f6f8b"
FAINT = "#b9c4cc"
VARIABLES = {
    INK: "--ink",
    GREY: "--grey",
    GRID: "--grid",
    BEFORE: "--before",
    AFTER: "--after",
    FAINT: "--faint",
}
"""Colours that the page may choose anew, for a dark background."""

Draw = Callable[[Any], None]


def svg(name: str, label: str, size: tuple[float, float], draw: Draw) -> str:
    """Draw one panel.

    Args:
        name: Unique in the page.
        label: What a reader who cannot see it is told.
        size: Width and height [inch].
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    style: dict[Any, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": name,
        "font.size": 9.0,
        "text.color": INK,
        "axes.edgecolor": GREY,
        "axes.labelcolor": INK,
        "axes.titlecolor": INK,
        "axes.titlesize": 10.0,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "axes.facecolor": "none",
        "grid.color": GRID,
        "grid.linewidth": 0.8,
        "xtick.color": GREY,
        "ytick.color": GREY,
        "xtick.labelcolor": INK,
        "ytick.labelcolor": INK,
        "lines.linewidth": 1.4,
        "path.simplify_threshold": 0.3,
        "legend.frameon": False,
        "axes.unicode_minus": True,
        "text.parse_math": False,
    }
    out = io.StringIO()
    with mpl.rc_context(style):  # pyright: ignore[reportUnknownMemberType]
        figure: Any = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(figure)
        draw(figure.subplots())
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    return embed(out.getvalue(), name, label)


def embed(text: str, name: str, label: str) -> str:
    """Make a stand-alone SVG file part of a page."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' xmlns(:\w+)?="[^"]*"', "", text).replace("xlink:href", "href")
    text = re.sub(r' id="', f' id="{name}-', text)
    text = re.sub(r"url\(#", f"url(#{name}-", text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    text = re.sub(r"font: ([\d.]+px)[^;\"]*", r"font: \1 system-ui, sans-serif", text)
    for colour, variable in VARIABLES.items():
        text = text.replace(colour, f"var({variable})")
    text = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), text)
    opening = re.compile(r'<svg width="[^"]*" height="[^"]*"')
    described = f'<svg role="img" aria-label="{html.escape(label)}"'
    return opening.sub(lambda _: described, text, count=1).strip()
