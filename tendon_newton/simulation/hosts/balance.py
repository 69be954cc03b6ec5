"""Where the force of a network and the mechanism that it pulls are in balance."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

BALANCING_STEPS = 12
"""Steps of the search; it ends at the rounding of float32."""


def find_root(
    f: Callable[[Tensor], Tensor], lower: Tensor, upper: Tensor, steps: int = BALANCING_STEPS
) -> Tensor:
    """Return where functions that are >= 0 at one end and <= 0 at the other are zero.

    By false position with the Illinois rule: the end that stays counts half the next time.
    Source: Dowell and Jarratt, A modified regula falsi method, BIT 11 (1971).
    """
    low, high = lower.clone(), upper.clone()
    at_low, at_high = f(low), f(high)
    middle = low
    kept = torch.zeros_like(low)
    for _ in range(steps):
        span = at_low - at_high
        share = torch.where(span > 0.0, at_low / span, torch.zeros_like(span)).clamp(0.0, 1.0)
        middle = low + share * (high - low)
        value = f(middle)
        above = value > 0.0
        low, at_low_new = torch.where(above, middle, low), torch.where(above, value, at_low)
        high, at_high_new = torch.where(above, high, middle), torch.where(above, at_high, value)
        side = torch.where(above, 1.0, -1.0)
        again = side == kept
        at_high = torch.where(again & above, 0.5 * at_high_new, at_high_new)
        at_low = torch.where(again & ~above, 0.5 * at_low_new, at_low_new)
        kept = side
    return middle
