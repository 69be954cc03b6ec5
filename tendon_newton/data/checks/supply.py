"""The supply voltage of a recording, as far as its register tells it."""

import numpy as np

from tendon_newton.data.recording import Array, Recording

FEWEST = 8.0  # Readings [1] below which nothing tells noise from a supply that moves
LIKE_NOISE = 4.0  # Standard errors by which the variance of noise alone may differ [1]
BEND = 0.1  # Share of a typical slope by which a new reading changes the slope at least [1]


def supply_of(recording: Recording) -> Array | None:
    r"""Return the supply voltage [V], shape (T,), without the scatter of its register.

    A converter that samples within the period of a PWM scatters by several percent, and a simulated
    motor follows every reading. Readings :math:`V_k + e_k` of a supply that walks,
    :math:`V_{k+1} = V_k + w_k`, differ over k of them by :math:`2 \sigma_e^2 + k \sigma_w^2` in the
    mean square. Where they scatter as noise alone does, their mean is the supply. Else it is an
    exponential mean over both sides, the best for such a walk; readings without noise stay.

    Source: Muth, Optimal properties of exponentially weighted forecasts of time series with
    permanent and transitory components, J. Am. Stat. Assoc. 55 (1960).
    """
    voltage = recording.voltage
    if voltage is None:
        return None
    rows = rows_of_a_reading(recording.time, voltage)
    readings = len(voltage) / rows
    if readings < FEWEST:
        return voltage
    near, far = (
        0.5 * float(np.mean((voltage[k:] - voltage[:-k]) ** 2)) for k in (2 * rows, 4 * rows)
    )
    noise, excess = 2.0 * near - far, float(np.var(voltage)) - near
    if excess <= near * LIKE_NOISE / np.sqrt(readings):
        return np.full_like(voltage, voltage.mean())
    if noise <= 0.0:
        return voltage
    ratio = 6.0 * excess / readings / noise  # a walk of n steps varies by n / 6 of a step
    kept = 1.0 + 0.5 * ratio - np.sqrt(ratio + 0.25 * ratio**2)
    return two_sided_mean(voltage, kept ** (1.0 / rows))


def rows_of_a_reading(time: Array, voltage: Array) -> int:
    """Return over how many rows a reading is drawn out to the next, at least; half where held."""
    slopes = np.diff(voltage) / np.diff(time)
    bends = np.abs(np.diff(slopes)) > BEND * np.sqrt(np.mean(slopes**2))
    return max(1, round(len(voltage) / (1 + int(bends.sum()))))


def two_sided_mean(signal: Array, kept: float) -> Array:
    """Return means whose weights fall by a share [1] from row to row on both sides, shape (T,)."""
    far = np.arange(1 - len(signal), len(signal))
    weights = np.fft.rfft(np.float64(kept) ** np.abs(far), 3 * len(signal))

    def spread(values: Array) -> Array:
        whole = np.fft.irfft(np.fft.rfft(values, 3 * len(signal)) * weights, 3 * len(signal))
        return whole[len(signal) - 1 :][: len(signal)]

    return spread(signal) / spread(np.ones_like(signal))
