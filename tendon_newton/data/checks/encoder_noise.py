"""The noise of an encoder, from its readings alone."""

import numpy as np

from tendon_newton.data.recording import Array

USUAL_COUNT = 2.0 * np.pi / 4096.0  # Of the encoders of most servos [rad]


def encoder_noise(angle: Array) -> float:
    """Return the noise [rad] of one encoder's readings, shape (T,).

    It is that of its counts, or of its scatter if it has none.
    """
    moves = np.abs(np.diff(angle))
    moves = moves[moves > 1.0e-7]
    if len(moves) == 0:  # an angle that never changes tells no count
        return USUAL_COUNT / np.sqrt(12.0)
    step = float(np.quantile(moves, 0.02))
    few = moves[moves < 10.5 * step] / step
    counted = np.mean(np.abs(few - np.round(few)) < 0.05) > 0.9
    return step / np.sqrt(12.0) if counted else difference_noise(angle)


def difference_noise(signal: Array) -> float:
    """Return the noise of a smooth signal from its second differences, shape (T,), robustly."""
    bend = np.diff(signal, 2)
    return float(1.4826 * np.median(np.abs(bend - np.median(bend))) / np.sqrt(6.0))
