"""Mechanisms of several equal chains, each of which the kernels see as one of its own."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tendon_newton.data.recording import Array, Indices


@dataclass(frozen=True, kw_only=True)
class ChainLayout:
    """How recordings of K equal chains stand as K R recordings of one, chain by chain.

    A hand then compiles in the time of a finger.
    """

    count: int  # Number of chains K
    rows: Indices  # Number of rows of each recording, shape (R,)

    def by_world(self, values: Any) -> Any:
        """Return numbers of recordings, shape (R, ...), as those of their chains, (K R, ...)."""
        if values.ndim == 1:
            return np.repeat(values, self.count)
        return values.reshape(len(values) * self.count, -1)

    def by_row(self, values: Any) -> Any:
        """Return numbers of all rows, shape (S, ...), as those of the rows of all chains."""
        if self.count == 1:
            return values
        laid = []
        for block in np.split(values, np.cumsum(self.rows)[:-1]):
            same = block.ndim == 1
            laid += [block] * self.count if same else np.split(block, self.count, axis=1)
        return np.concatenate(laid)

    def beside(self, values: Array) -> Array:
        """Return rows of all chains, shape (N, K S, ...), with those of a recording in a line."""
        if self.count == 1:
            return values
        place = self.by_row(np.arange(int(self.rows.sum())))
        rows = np.argsort(place, kind="stable").reshape(-1, self.count)
        return values[:, rows].reshape(len(values), len(rows), -1)
