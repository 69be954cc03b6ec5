"""Evidence that the load cells of several strings are exchanged, or that two are one.

Whichever string a servo winds in alone, the tension that rises most is its own. A few such moments
with another cell's answer, and none with its own, are enough. Two live cells hardly ever send the
same counts.
"""

from collections import deque
from collections.abc import Sequence

from tendon_hardware.load_cells.calibration import LoadCellCalibration
from tendon_hardware.load_cells.cell_doubt import CHANGE, FAST, equal_max

ALONE, STILL = 0.1, 0.05
"""Angle wound in by one servo while all others have wound in less than the second one [rad]."""
SHOWN = 0.1  # Time until its string's tension has risen [s]: twice the converter's filter
MOMENT = 1.5  # Longest time that such a winding takes [s]
RIVAL = 0.5  # Rise of any other tension, of the greatest one [1]
WRONG_MIN = 3  # Answers of another cell, and none of its own, that are enough
NOISES = 4.0  # Standard deviations that noise may add to a rise [1]
RECENT = 4  # Readings of a cell among which another one's are looked for


class CellPlugs:
    """Watches all load cells of a bench; one that is alone, slow or missing is not judged.

    Args:
        calibrations: Calibration of each string's cell, where there is one.
    """

    def __init__(self, calibrations: Sequence[LoadCellCalibration | None]) -> None:
        known = [each for each in calibrations if each is not None and each.rate >= FAST]
        self._judged = len(known) == len(calibrations) > 1
        count = len(calibrations)
        self.faults: list[str | None] = [None] * count  # Reason not to believe each cell
        noise = max((each.noise for each in known), default=0.0)
        self._rise = max(CHANGE, NOISES * noise)
        self._own = [0] * count
        self._wrong = [0] * count
        self._anchor: tuple[float, Sequence[float], Sequence[float]] | None = None
        self._winding: tuple[int, float] | None = None
        sigma = min((each.noise / abs(each.slope) for each in known), default=1.0)
        self._same_max = equal_max(sigma / RECENT)
        self._counts: list[deque[int]] = [deque(maxlen=RECENT) for _ in calibrations]
        self._same: dict[tuple[int, int], int] = {}

    def take(self, now: float, positions: Sequence[float], tensions: Sequence[float]) -> None:
        """Take all spool angles [rad] and tensions [N] of one instant [s]."""
        if self._judged:
            self._answer(now, positions, tensions)

    def hear(self, counts: Sequence[int]) -> None:
        """Take the latest reading of each cell [counts]."""
        for place, told in enumerate(counts):
            if told in self._counts[place]:
                continue  # not a new one
            self._counts[place].append(told)
            for other in range(len(counts)):
                if other != place and self._judged:
                    self._compare(told, place, other)

    def _answer(self, now: float, positions: Sequence[float], tensions: Sequence[float]) -> None:
        """Find moments in which one servo winds in alone, and which cell answers."""
        if self._anchor is None:
            self._anchor = (now, positions, tensions)
        begin, places, befores = self._anchor
        ways = [here - there for here, there in zip(positions, places, strict=True)]
        wound = [place for place, way in enumerate(ways) if way >= ALONE]
        if self._winding is not None:
            winder, since = self._winding
            if now - since < SHOWN:
                return
            self._count(winder, [t - b for t, b in zip(tensions, befores, strict=True)])
        elif len(wound) == 1 and sum(way < STILL for way in ways) == len(ways) - 1:
            self._winding = (wound[0], now)
            return
        elif not wound and now - begin < MOMENT:
            return
        self._winding, self._anchor = None, (now, positions, tensions)

    def _count(self, winder: int, rises: Sequence[float]) -> None:
        """Count whose cell has answered a servo, if one has."""
        *_, second, most = sorted(range(len(rises)), key=rises.__getitem__)
        if rises[most] < self._rise or rises[second] > RIVAL * rises[most]:
            return
        self._own[winder] += most == winder
        self._wrong[winder] += most != winder
        if self._wrong[winder] >= WRONG_MIN and not self._own[winder]:
            self.faults[winder] = (
                f"the tension that rises must be that of the string that is wound in; load cell "
                f"{most} has answered in place of load cell {winder}, {self._wrong[winder]} times: "
                "are their plugs exchanged?"
            )

    def _compare(self, told: int, place: int, other: int) -> None:
        """Count how often a cell has told in a row what another one has [counts]."""
        pair = (place, other)
        self._same[pair] = self._same.get(pair, 0) + 1 if told in self._counts[other] else 0
        if self._same[pair] > self._same_max:
            self.faults[place] = self.faults[other] = (
                f"each load cell must tell its own counts; cell {place} tells those of cell "
                f"{other}: look at their plugs and ports"
            )
