"""The tension where no load cell is: what a force network makes of commands and motion."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tendon_hardware.control.policy_runner import onnx_session, read_content
from tendon_hardware.errors import PolicyFailure
from tendon_newton.data.cards.force_network_card import ForceNetworkCard
from tendon_newton.data.cards.policy_card import CARD_KEY
from tendon_newton.data.files.guarded import TooMuch, guarded
from tendon_newton.errors import InvalidNetworkFile, InvalidPolicyFile, first_line


class ForceEstimate:
    """Estimates tension [N] from windows of command, position and velocity, (1, window, 3)."""

    def __init__(self, card: ForceNetworkCard, run: Callable[..., Any]) -> None:
        self.card = card
        self._run = run
        self._window: deque[tuple[float, float, float]] = deque(maxlen=card.window)

    def __call__(self, command: float, position: float, velocity: float) -> float:
        """Enter a sample [rad, rad, rad/s] and return the tension [N], cut to what is possible.

        Before the first sample the servo is taken to have rested in its state.

        Raises:
            PolicyFailure: The network could not be run.
        """
        self._window.append((command, position, velocity))
        while len(self._window) < self.card.window:
            self._window.append(self._window[-1])
        window = np.array([self._window], dtype=np.float32)
        try:
            tension = float(np.asarray(self._run(window)).reshape(-1)[0])
        except Exception as error:  # each engine fails in its own ways
            raise PolicyFailure(
                f"a force network must tell a tension at every step; it failed: {first_line(error)}"
            ) from error
        return min(max(tension, 0.0), self.card.force_limit)

    def anew(self) -> ForceEstimate:
        """Return the same network with a history of its own, for another servo."""
        return ForceEstimate(self.card, self._run)


def load_estimate(path: Path, rate: float, servo: str | None = None) -> ForceEstimate:
    """Read a force network's ONNX file for use at a rate [Hz].

    Args:
        servo: Kind of servo that it is to guard; None for any.

    Raises:
        InvalidNetworkFile: The file is no force network, runs at another rate, is of another servo,
            or needs its state kept.
    """
    try:
        content = read_content(path)
        guarded(try_content, content, rate)
        estimate = open_content(content, rate)
        if servo and (trained := estimate.card.servo or servo) != servo:
            raise InvalidNetworkFile(f"this network knows the servo {trained}; here is a {servo}")
        return estimate
    except (InvalidPolicyFile, InvalidNetworkFile, TooMuch) as error:
        raise InvalidNetworkFile(f"{path}: {error}") from error


def try_content(content: bytes, rate: float) -> None:
    """Refuse a file that is no force network for this rate [Hz], or does not run."""
    estimate = open_content(content, rate)
    try:
        estimate(0.0, 0.0, 0.0)
    except MemoryError:
        raise
    except Exception as error:  # the engine fails in its own ways
        raise InvalidNetworkFile(
            f"must take windows of {estimate.card.window} samples, as its card says; a test call "
            f"failed: {first_line(error)}"
        ) from error


def open_content(content: bytes, rate: float) -> ForceEstimate:
    """Read card and network."""
    metadata, run = onnx_session(content)
    if CARD_KEY not in metadata:
        raise InvalidNetworkFile("a force network's metadata has its card; there is none")
    card = ForceNetworkCard.from_json(metadata[CARD_KEY])
    if abs(card.rate - rate) > 1e-6:
        raise InvalidNetworkFile(
            f"a force network that guards a run takes windows at {rate:g} Hz; this one runs at "
            f"{card.rate:g} Hz"
        )
    return ForceEstimate(card, run)
