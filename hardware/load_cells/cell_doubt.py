"""Evidence against a load cell: readings that no live cell would send.

A guard that believes a dead load cell is worse than none. Four things give a dead one away:

- it is saturated: a broken wire of its bridge, or far too much load;
- it repeats one value: a live converter's noise hardly ever does;
- it is calmer than it was under no load when it was calibrated;
- the motor winds the tendon in against something, no other servo lets its own out, and the tension
  does not change.
"""

from collections import deque
from collections.abc import Sequence
from math import ceil, log, pi, sqrt

from hardware.load_cells.base import LoadCellReading
from hardware.load_cells.calibration import LoadCellCalibration
from hardware.servos.base import ServoSpec, ServoState

SATURATED_MAX = 2
"""Saturated readings in a row that may be a spike."""
CHANCE = 1e-12
"""Chance of a live cell to be taken for a stuck one, per reading: once in 400 years at 80 Hz."""
CALM_READINGS = 24
"""Readings among which the noise is looked for: 0.3 s at 80 Hz."""
CALM_SHARE = 0.5
"""Range of those readings that is too small, in standard deviations of the calibration [1]. That of
a live cell is 3.9 on average, and this small by chance once in 1e15."""
COARSE = 4.0
"""Standard deviation below which noise is a matter of single counts, and is not looked for."""
PULL, PULL_PER_SPEED = 0.09, 0.02
"""Share of the motor's strength [1], and more of it per speed [s/rad], at which a tendon is pulled
whatever the gear's friction. On the virtual benches a spool that runs free takes 0.05 at 1.5 rad/s
and 0.09 at 4 rad/s. A spool that pulls 2.5 N takes 0.09."""
PULL_TIME = 0.25
"""Time of the mean of that share [s]: an acceleration takes less."""
WOUND = 0.25
"""Angle wound in under such a pull, after which the tension must have changed [rad]."""
LAG = 6
"""Readings after that which may still show an older tension: an HX711 settles in four."""
CHANGE = 0.3
"""Least change of the tension [N]: the weakest spring of the benches gives 0.6 N over 0.25 rad."""
LET_OUT = 2.0
"""Angle wound in at one tension while another servo lets out, per angle of that [1]: the opening
tendon of `finger_antagonist` moves half as far as the closing one."""


class CellDoubt:
    """Collects the evidence against one load cell.

    Args:
        calibration: Calibration of the cell; without one only a stuck cell is told from a live one.
        servo: Servo that winds the cell's tendon.
    """

    def __init__(self, calibration: LoadCellCalibration | None, servo: ServoSpec) -> None:
        self.fault: str | None = None
        """Reason not to believe the cell; None where there is none."""
        sigma = 1.0 if calibration is None else calibration.noise / abs(calibration.slope)
        self._sigma = sigma
        self._equal_max = equal_max(sigma)
        self._servo = servo
        self._equal = self._saturated = 0
        self._latest: deque[int] = deque(maxlen=CALM_READINGS)
        self._way: deque[tuple[float, float, float]] = deque()
        self._wound = self._felt = 0.0
        self._late = 0
        self._before: float | None = None
        self._anchor: float | None = None
        self._others: Sequence[float] = ()
        self._others_before: Sequence[float] = ()

    def hear(self, reading: LoadCellReading) -> None:
        """Take a reading as it came."""
        self._equal = self._equal + 1 if self._latest and reading.counts == self._latest[-1] else 1
        self._saturated = self._saturated + 1 if reading.saturated else 0
        self._latest.append(reading.counts)
        full = len(self._latest) == CALM_READINGS and self._sigma >= COARSE
        spread = max(self._latest) - min(self._latest)
        if self._saturated > SATURATED_MAX:
            self.fault = (
                f"the load cell must stay inside its range; it is saturated, "
                f"{reading.counts} counts: look at its wires and its load"
            )
        elif self._equal > self._equal_max:
            self.fault = (
                f"the load cell must be alive; {self._equal} readings in a row are "
                f"{reading.counts} counts: look at its converter"
            )
        elif full and spread < CALM_SHARE * self._sigma:
            self.fault = (
                f"the load cell must be as noisy as when it was calibrated, {self._sigma:.0f} "
                f"counts; {CALM_READINGS} readings lie within {spread}: look at its converter"
            )

    def feel(self, force: float, instant: float) -> None:
        """Take a tension [N] and when it came [s]; one that changes is one that reacts."""
        self._felt = instant
        if self._anchor is None or abs(force - self._anchor) >= CHANGE:
            self._anchor, self._wound, self._late = force, 0.0, 0
            self._others_before = self._others
        elif self._wound > WOUND + LET_OUT * self._let_out():
            self._late += 1
            if self._late >= LAG:
                self.fault = (
                    f"the tension must change while the motor winds in; it has stayed at "
                    f"{self._anchor:.1f} N over {self._wound:.1f} rad: look at the load cell"
                )

    def move(self, state: ServoState, duty: float, others: Sequence[float] = ()) -> None:
        """Take where the spool is, the duty [1] that winds it, and where other spools are [rad]."""
        self._others = others
        if len(self._others_before) != len(others):
            self._others_before = others
        self._way.append((state.time, state.position, duty))
        while state.time - self._way[0][0] > PULL_TIME:
            self._way.popleft()
        turned = 0.0 if self._before is None else state.position - self._before
        self._before = state.position
        if state.time - self._felt > PULL_TIME:  # its silence is another matter
            self._anchor = None
        if self._anchor is None or not self._pulls():
            return
        self._wound = max(0.0, self._wound + turned)  # an encoder at rest goes back and forth

    def _let_out(self) -> float:
        """Return how far other servos let out since the tension last changed [rad]."""
        ways = zip(self._others_before, self._others, strict=True)
        return sum(max(before - now, 0.0) for before, now in ways)

    def _pulls(self) -> bool:
        """Tell whether the motor lately needed more of its strength than to turn freely."""
        begin, first, _ = self._way[0]
        end, last, _ = self._way[-1]
        if end - begin < 0.8 * PULL_TIME:
            return False
        duty = sum(each for _, _, each in self._way) / len(self._way)
        speed = (last - first) / (end - begin)
        return duty - speed / self._servo.no_load_speed > PULL + PULL_PER_SPEED * abs(speed)


def equal_max(sigma: float) -> int:
    r"""Return how many equal readings in a row a live cell may send.

    Two readings of a normal scatter :math:`\sigma` [counts] are equal with a chance of
    :math:`1 / (2 \sqrt{\pi} \sigma)`.
    """
    chance = min(1.0 / (2.0 * sqrt(pi) * max(sigma, 1.0)), 0.5)
    return 1 + ceil(log(CHANCE) / log(chance))
