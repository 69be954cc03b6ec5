"""Pictures of curves as files, drawn without a display."""

from pathlib import Path
from typing import Any

from tendon_newton.errors import InvalidOutput

INK, GREY = "#1c2430", "#8a93a0"
COLOURS = ("#1764ab", "#d1495b", "#2f8f5b", "#e08e1a", "#7a4fbf", "#0f8b9d")


def new_figure(width: float, height: float) -> Any:
    """Return a figure of a size [in] that needs no display."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    mpl.rcParams["text.parse_math"] = False  # names of files stand here, and no formulas
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def tidy(axes: Any) -> None:
    """Draw a light grid and no box."""
    axes.grid(color="#e4e6ea", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def save(figure: Any, path: Path, *, dpi: int = 110) -> None:
    """Write a figure.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    try:
        figure.savefig(path, dpi=dpi)
    except OSError as error:
        raise InvalidOutput(
            f"{path}: the picture cannot be written: {error.strerror or error}"
        ) from error
