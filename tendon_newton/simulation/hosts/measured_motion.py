"""Rate and acceleration of a shaft whose angle was measured, by cubics through its rows."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tendon_newton.data.checks.measures import encoder_count
from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms

REACHES = (2, 3, 4, 6, 8, 11, 16, 22, 32)
"""Rows on either side of a window's own: by their power 5/2 the noise of an acceleration falls."""
ORDER = 3
WIDER = 1.05
"""Growth of what cubics leave beyond which they cut off corners of the path, not only noise [1]."""


def motion_of(time: Array, angle: Array) -> tuple[Array, Array]:
    """Return the rate [rad/s] and the acceleration [rad/s2] of an angle [rad], shapes (T,).

    They are those of a cubic through the rows around each, as many as leave no more of the angle
    than its own noise, or its encoder's counts. Nothing is shifted in time.
    """
    fitting = [reach for reach in REACHES if 2 * reach + 1 <= len(time)]
    if not fitting:
        return np.gradient(angle, time), np.zeros_like(angle)
    rate, acceleration, left = cubics(time, angle, fitting[0])
    counted = encoder_count(angle) / np.sqrt(12.0)
    for reach in fitting[1:]:
        wider = cubics(time, angle, reach)
        if wider[2] > WIDER * max(left, counted):
            break
        rate, acceleration, left = *wider[:2], min(left, wider[2])
    return rate, acceleration


def cubics(time: Array, angle: Array, reach: int) -> tuple[Array, Array, float]:
    """Fit a cubic to each row and those within a reach; near the ends, to as many.

    Returns:
        Rates and accelerations in the rows, shapes (T,), and the noise [rad] that the cubics leave.
    """
    rows, width = np.arange(len(time)), 2 * reach + 1
    windows = np.clip(rows - reach, 0, len(time) - width)
    scale = (time[-1] - time[0]) * reach / (len(time) - 1)
    since = (sliding_window_view(time, width)[windows] - time[:, None]) / scale
    about = sliding_window_view(angle, width)[windows] - angle[:, None]
    powers = np.stack([(since**k).sum(axis=1) for k in range(2 * ORDER + 1)])
    sums = np.stack([(since**k * about).sum(axis=1) for k in range(ORDER + 1)], axis=1)
    places = np.arange(ORDER + 1)
    inverse = np.linalg.inv(np.moveaxis(powers[places[:, None] + places], 2, 0))
    found = np.einsum("tij,tj->ti", inverse, sums)
    left = rms(found[:, 0] / np.sqrt(1.0 - inverse[:, 0, 0]))
    return found[:, 1] / scale, 2.0 * found[:, 2] / scale**2, left
