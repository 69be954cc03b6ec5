"""Predictions of a network on recordings, row by row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from tendon_newton.data.cards.force_network_card import ForceNetworkCard
from tendon_newton.data.recording import Array, Indices, Recording
from tendon_train.actuator.samples.windows import Windows, WindowShape, extract_windows, to_device

BATCH = 8192


@dataclass(frozen=True, kw_only=True)
class ForcePrediction:
    """Measured and predicted tension on one recording, where a window ends."""

    recording: Recording
    tendon: int
    rows: Indices  # Rows that were predicted, shape (N,)
    measured: Array  # Tension at these rows [N]
    predicted: Array  # Force of the model [N]

    @property
    def time(self) -> Array:
        """Instants of the rows [s]."""
        return self.recording.time[self.rows]

    @property
    def key(self) -> tuple[str, int]:
        """Recording and tendon that were predicted."""
        return self.recording.name, self.tendon

    def at(self, rows: Indices) -> ForcePrediction:
        """Return the part at some of its rows."""
        kept = np.searchsorted(self.rows, rows)
        return replace(
            self, rows=rows, measured=self.measured[kept], predicted=self.predicted[kept]
        )

    @property
    def error(self) -> Array:
        """Measured minus predicted [N]."""
        return self.measured - self.predicted


def predict(
    network: Any, card: ForceNetworkCard, recordings: Sequence[Recording]
) -> tuple[ForcePrediction, ...]:
    """Ask a network, or its file's module, for tensions at every row that ends a window."""
    windows = extract_windows(recordings, WindowShape(window=card.window, rate=card.rate))
    tension = ask(network, windows)
    tension = np.clip(tension, 0.0, card.force_limit)
    owners = [(r, tendon) for r in recordings for tendon in range(r.tendon_count)]
    starts = np.cumsum([0, *(r.sample_count for r, _ in owners)])
    predictions = []
    for source, (recording, tendon) in enumerate(owners):
        own = windows.source == source
        rows = windows.last[own]
        predictions.append(
            ForcePrediction(
                recording=recording,
                tendon=tendon,
                rows=rows - starts[source],
                measured=windows.force[rows],
                predicted=tension[own],
            )
        )
    return tuple(p for p in predictions if p.rows.size)


def ask(network: Any, windows: Windows) -> Array:
    """Return the tension at the end of each window [N], shape (W,)."""
    method = getattr(network, "last_query", network)
    data = to_device(windows, "cpu")
    everything = torch.arange(windows.window_count)
    with torch.no_grad():
        parts = [method(data.batch(part)) for part in everything.split(BATCH)]
    return torch.cat(parts).double().numpy()
