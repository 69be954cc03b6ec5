"""The exact answer of a first-order lag to an input that moves in a straight line."""

import warp as wp

from tendon_newton.device_code.placeholders import real
from tendon_newton.device_code.templates import device_template


@device_template
def share_kept(elapsed: real, time_constant: real) -> real:
    """Return how much of its old value a lag keeps [1]; one without a time constant keeps none.

    Way and travel may take the place of both times.
    """
    share = real(0.0)
    if time_constant > real(0.0):
        share = wp.exp(-elapsed / time_constant)
    return share


@device_template
def lagged(before: real, target: real, rate: real, elapsed: real, time_constant: real) -> real:
    """Return y after `elapsed` [s] of tau y' = u - y, with u at the end and the rate of u known."""
    out = target
    if time_constant > real(0.0):
        keep = wp.exp(-elapsed / time_constant)
        behind = time_constant * (real(1.0) - keep) - keep * elapsed
        out = keep * before + (real(1.0) - keep) * target - rate * behind
    return out
