"""Counts of registers whose sign was lost: negative ones stand far above the rest."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COMPLEMENTS = (16, 32)  # Bits of a register in two's complement that was read as unsigned
SIGN_BITS = (15, 31, 11, 10)
"""Bits that say the sign of a size: 15 of Feetech's speed, current and place, 10 of its load and of
Dynamixel's protocol 1, 11 of a homing offset."""
ROUNDING = 1e-12  # Share of the greatest value below which two values are one [1]
MULTIPLES = (1, 2, 3, 4)  # Counts that the least distance of two values may be
LEAST_LEVELS = 6  # Values of a register; fewer are a switch
LONE = 2  # Values on a side of zero from which they are no one word of a failed read
GRID, ROUGH = 1e-2, 1e-5  # Counts, and share of them, that rounded files are off their grid [1]
SMALL = 0.25
"""Share of the period that a step through zero stays below; of all its way for a lone value [1]."""
LARGE = 0.5  # Share of the period that a lost sign makes of it [1]


@dataclass(frozen=True, kw_only=True)
class LostSign:
    """Rows of a column whose negative values stand above all others."""

    rows: NDArray[np.bool_]  # Shape (T,)
    period: float  # What stands above zero there [column's unit]
    bits: int
    sized: bool  # Whether the rest is the size, and no complement

    def mended(self, values: Array) -> Array:
        """Return the column with its negative values, shape (T,)."""
        side = -1.0 if values[self.rows].min() < 0.0 else 1.0  # a mapping may have turned all
        above = side * values - self.period
        return np.where(self.rows, -side * np.abs(above) if self.sized else side * above, values)

    @property
    def text(self) -> str:
        """What happened and what mends it."""
        if self.sized:
            return (
                f"bit {self.bits} is the sign of a size: take {self.period:.6g} off and turn the "
                "sign there"
            )
        return f"negative {self.bits}-bit counts were read as unsigned: subtract {self.period:.6g}"


def lost_sign(values: Array, unit: float | None = None) -> LostSign | None:
    """Find rows whose value is negative and was read as a number without sign.

    A value that passes through zero then jumps by the period, and does not where they are mended.

    Args:
        values: A column, shape (T,).
        unit: Value of one count; the least distance of two values unless given.
    """
    side = -1.0 if values.max() <= 0.0 else 1.0
    values = side * values
    levels = np.unique(values)
    if levels[0] < 0.0 or levels.size < LEAST_LEVELS:
        return None
    low = levels[: max(LEAST_LEVELS // 2, int(np.count_nonzero(levels < SMALL * levels[-1])))]
    gaps = np.diff(low)  # the greatest values are rounded most
    gaps = gaps[gaps > ROUNDING * levels[-1]]
    if unit is None and not gaps.size:
        return None
    least = unit or float(gaps.min())
    for count in MULTIPLES if unit is None else (1,):
        counts = low * count / least
        if np.abs(counts - np.round(counts)).max() > max(GRID, ROUGH * counts[-1]):
            continue  # on no grid of a register
        found = [lost for lost in candidates(values, least / count) if passes_zero(values, lost)]
        if found:
            return min(found, key=lambda lost: np.abs(np.diff(lost.mended(values))).sum())
    return None


def candidates(values: Array, unit: float) -> Iterator[LostSign]:
    """Give every way in which a sign may have been lost."""
    most = float(values.max())
    for sized, all_bits in ((False, COMPLEMENTS), (True, SIGN_BITS)):
        for bits in all_bits:
            period = unit * 2.0**bits
            lowest, end = (period, 2.0 * period) if sized else (0.5 * period, period)
            if lowest <= most < end - 0.5 * unit * (not sized):
                rows = values > lowest - 0.5 * unit
                yield LostSign(rows=rows, period=period, bits=bits, sized=sized)


def passes_zero(values: Array, lost: LostSign) -> bool:
    """Tell whether a column is smooth with its signs alone."""
    across = np.diff(lost.rows.astype(np.int8)) != 0
    if not across.any():
        return False
    mended = lost.mended(values)
    before, after = np.abs(np.diff(values))[across], np.abs(np.diff(mended))[across]
    lone = min(np.unique(values[rows]).size for rows in (lost.rows, ~lost.rows)) < LONE
    period = float(np.ptp(mended)) if lone else lost.period
    return bool(before.min() > LARGE * lost.period and after.max() < SMALL * period)
