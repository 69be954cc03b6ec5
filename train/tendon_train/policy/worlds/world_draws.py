"""Random numbers that each world draws for itself: what one draws changes no other's."""

from math import pi

import torch
from torch import Tensor

STEP = -7046029254386353131
"""0x9E3779B97F4A7C15, the odd number by which a world's counter moves, as a signed integer."""
MIXERS = ((30, -4658895280553007687), (27, -7723592293110705685))
"""Shifts and factors of SplitMix64: 0xBF58476D1CE4E5B9 and 0x94D049BB133111EB."""
LAST_SHIFT = 31
BITS = 24  # Bits of a number, which float32 holds exactly


class WorldDraws:
    r"""A sequence of numbers for each of W worlds, fixed by the seed and the world.

    The n-th number of a world is :math:`\mathrm{mix}(s + n \gamma)` with the finaliser of
    SplitMix64, where s comes from seed and world by the same function.

    Source: Steele, Lea and Flood, Fast splittable pseudorandom number generators (2014).

    Args:
        worlds: Number of worlds W.
    """

    def __init__(self, worlds: int, device: torch.device | str = "cpu", *, seed: int = 0) -> None:
        self._numbers = torch.arange(1, worlds + 1, dtype=torch.int64, device=device)
        self.manual_seed(seed)

    @property
    def device(self) -> torch.device:
        """Torch device of the numbers."""
        return self._numbers.device

    def manual_seed(self, seed: int) -> None:
        """Begin all sequences anew."""
        self._state = mixed(self._numbers * STEP + mixed(torch.full_like(self._numbers, seed)))

    def uniform(self, *shape: int, worlds: Tensor | None = None) -> Tensor:
        """Return numbers from 0 up to 1 for each world, shape (W, *shape).

        Args:
            *shape: Shape of one world's numbers.
            worlds: Mask of the worlds that draw, shape (W,); all unless given. The others' numbers
                mean nothing, and they come again when they do draw.
        """
        count = int(torch.Size(shape).numel())
        steps = torch.arange(1, count + 1, dtype=torch.int64, device=self._state.device) * STEP
        bits = mixed(self._state[:, None] + steps)
        moved = self._state + torch.full_like(self._state, count) * STEP  # wraps around
        self._state = moved if worlds is None else torch.where(worlds, moved, self._state)
        share = shifted(bits, 64 - BITS).to(torch.float32) * 2.0**-BITS
        return share.reshape(-1, *shape)

    def normal(self, *shape: int) -> Tensor:
        """Return standard normal numbers for each world, shape (W, *shape).

        Source: Box and Muller, A note on the generation of random normal deviates (1958).
        """
        distance, angle = self.uniform(2, *shape).unbind(dim=1)
        return (-2.0 * torch.log1p(-distance)).sqrt() * torch.cos(2.0 * pi * angle)


def mixed(bits: Tensor) -> Tensor:
    """Return integers of 64 bits whose every bit depends on all bits of others."""
    for shift, factor in MIXERS:
        bits = (bits ^ shifted(bits, shift)) * factor
    return bits ^ shifted(bits, LAST_SHIFT)


def shifted(bits: Tensor, shift: int) -> Tensor:
    """Shift integers to the right as if they had no sign."""
    return (bits >> shift) & ((1 << (64 - shift)) - 1)
