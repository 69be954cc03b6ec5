"""The size of errors, as every score of the program has it."""

import numpy as np
from numpy.typing import ArrayLike


def rms(values: ArrayLike) -> float:
    """Return the root mean square of all values, in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))
