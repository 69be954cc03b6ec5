"""The force network of a learned actuator, run by ONNX Runtime."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.exports.runtime.facts import FOLDER, NETWORK


class Network:
    """A force network and what it has been shown.

    An ONNX file, asked at a rate [Hz] with a window of samples, or streaming with a state.
    """

    def __init__(self, path: Path, rate: float, window: int, streaming: bool) -> None:
        import onnxruntime  # here, since only a model with a network needs it

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(str(path), options)
        self.rate, self.window, self.streaming = rate, window, streaming
        self.samples: Any = None
        self.state: Any = None
        self.answer: Any = None

    def fill(self, samples: Any) -> None:
        """Begin as if the samples (D, 3) had always been there."""
        self.samples = np.repeat(samples[:, None], self.window, axis=1)
        self.answer = None
        if self.streaming:
            size = next(i.shape[1] for i in self.session.get_inputs() if i.name == "state")
            self.state = np.zeros((len(samples), size), dtype=np.float32)
            for _ in range(self.window):
                self.advance(samples)

    def advance(self, samples: Any) -> None:
        """Show a network with a state one sample of each servo (D, 3)."""
        given = {"sample": samples, "state": self.state}
        self.answer, self.state = self.session.run(["tension", "new_state"], given)

    def show(self, samples: Any) -> None:
        """Add samples (D, 3)."""
        if self.streaming:
            self.advance(samples)
        else:
            self.samples = np.concatenate([self.samples[:, 1:], samples[:, None]], axis=1)

    def ask(self) -> Any:
        """Return the forces [N] that it answers with, shape (D,)."""
        if self.streaming:
            return self.answer
        return self.session.run(["tension"], {"window": self.samples})[0]


def open_network() -> Any:
    """Return the model's force network, None of an equation."""
    return None if NETWORK is None else Network(FOLDER / NETWORK["file"], *NETWORK["asked"])
