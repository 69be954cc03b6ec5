"""The layers of an asset that was imported."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.authoring.asset_folder import write_layers
from tendon_newton.mechanisms.authoring.foreign_plan import LAYERS, ForeignPlan

ROUNDING = 1.0e-7  # Share of a vector's largest component that is rounding of float32 [1]


def write_foreign(folder: Path, plan: ForeignPlan) -> Path:
    """Write the layers of an imported asset into a new folder, and return the file to open.

    Raises:
        InvalidOutput: The new folder is there already, or cannot be made.
    """
    filters = {"number": number, "vector": vector}
    return write_layers(folder, "imported_asset", LAYERS, plan, filters)


def number(value: float) -> str:
    """Write a number with the digits of Newton's float32, and no more."""
    return f"{value:.7g}"


def vector(values: Array) -> str:
    """Write a vector; what is but rounding beside its largest component is zero."""
    least = ROUNDING * float(np.max(np.abs(values)))
    return f"({', '.join(number(v) if abs(v) > least else '0' for v in values)})"
