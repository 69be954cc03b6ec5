"""The layers of an asset that was imported."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tendon_newton.errors import InvalidOutput
from tendon_newton.mechanisms.foreign_plan import LAYERS, ForeignPlan
from tendon_newton.recording import Array

ROUNDING = 1.0e-7
"""Share of a vector's largest component that is rounding of float32 [1]."""


def write_foreign(folder: Path, plan: ForeignPlan) -> Path:
    """Write the layers of an imported asset into a new folder, and return the file to open.

    Raises:
        InvalidOutput: The new folder is there already, or cannot be made.
    """
    from jinja2 import Environment, PackageLoader

    pages = Environment(
        loader=PackageLoader("tendon_newton.mechanisms", "imported_asset"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    pages.filters.update(number=number, vector=vector)
    home = folder / plan.name
    try:
        home.mkdir(parents=True)
        for layer in LAYERS:
            text = pages.get_template(f"{layer}.usda.jinja").render(plan=plan)
            name = plan.name if layer == "interface" else layer
            (home / f"{name}.usda").write_text(text, encoding="utf-8")
    except FileExistsError as error:
        raise InvalidOutput(
            f"{home}: a new asset gets a new folder; it is there already"
        ) from error
    except OSError as error:
        raise InvalidOutput(
            f"{home}: an asset needs a folder; {error.strerror or error}"
        ) from error
    return home / f"{plan.name}.usda"


def number(value: float) -> str:
    """Write a number with the digits of Newton's float32, and no more."""
    return f"{value:.7g}"


def vector(values: Array) -> str:
    """Write a vector; what is but rounding beside its largest component is zero."""
    least = ROUNDING * float(np.max(np.abs(values)))
    return f"({', '.join(number(v) if abs(v) > least else '0' for v in values)})"
