"""The force network of a learned actuator, run by ONNX Runtime."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.exports.runtime.facts import FOLDER, NETWORK


class Network:
    """A force network and what it has been shown.

    An ONNX file, asked at a rate [Hz] with a window of samples.
    """

    def __init__(self, path: Path, rate: float, window: int) -> None:
        import onnxruntime  # here, since only a model with a network needs it

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(str(path), options)
        self.rate, self.window = rate, window
        self.samples: Any = None

    def fill(self, samples: Any) -> None:
        """Begin as if the samples (D, 3) had always been there."""
        self.samples = np.repeat(samples[:, None], self.window, axis=1)

    def show(self, samples: Any) -> None:
        """Add samples (D, 3)."""
        self.samples = np.concatenate([self.samples[:, 1:], samples[:, None]], axis=1)

    def ask(self) -> Any:
        """Return the forces [N] that it answers with, shape (D,)."""
        return self.session.run(["tension"], {"window": self.samples})[0]


def open_network() -> Any:
    """Return the model's force network, None of an equation."""
    return None if NETWORK is None else Network(FOLDER / NETWORK["file"], *NETWORK["asked"])
