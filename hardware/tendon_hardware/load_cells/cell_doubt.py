"""Evidence against a load cell: readings that no live cell would send.

A guard that believes a dead load cell is worse than none. These things give one away that is dead
or lies:

- it is saturated: a broken wire of its bridge, or far too much load;
- it repeats one value: a live converter's noise hardly ever does;
- it is calmer than it was under no load when it was calibrated;
- the motor winds the tendon in against something, or moves a taut one, no other servo does the
  opposite, and the tension does not change;
- the tension is below zero: a tendon cannot push;
- it jumps back and forth with every reading, faster than the converter's filter lets through;
- it jumps between two readings and stays there, which that filter spreads over four;
- it goes on rising when the spool has begun to let the tendon out, time after time;
- it is far less than the motor must be pulling, by its duty and its speed.

A cell that is deaf while the spool rests says nothing wrong: it is found out once the motor pulls.
"""

from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from math import ceil, inf, log, pi, sqrt

from tendon_hardware.load_cells.calibration import LoadCellCalibration
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.servos.base import ServoSpec, ServoState

SATURATED_MAX = 2  # Saturated readings in a row that may be a spike
CHANCE = 1e-12
"""Chance of a live cell to be taken for a stuck one, per reading: once in 400 years at 80 Hz."""
CALM_READINGS = 24  # Readings among which the noise is looked for: 0.3 s at 80 Hz
CALM_SHARE = 0.5
"""Range of those readings that is too small, in standard deviations of the calibration [1]. That of
a live cell is 3.9 on average, and this small by chance once in 1e15."""
COARSE = 4.0
"""Standard deviation below which noise is a matter of single counts, and is not looked for."""
PULL, PULL_PER_SPEED = 0.09, 0.02
"""Share of the motor's strength [1], and more of it per speed [s/rad], at which a tendon is pulled
whatever the gear's friction. On the virtual benches a spool that runs free takes 0.05 at 1.5 rad/s
and 0.09 at 4 rad/s. A spool that pulls 2.5 N takes 0.09."""
PULL_TIME = 0.25  # Time of the mean of that share [s]: an acceleration takes less
WOUND = 0.25  # Angle wound in under such a pull, after which the tension must have changed [rad]
MOVED = 0.6
"""Angle by which a taut tendon is wound in or let out, after which it must have changed [rad]. A
sound hand that turns a ball moves one by 0.32 rad at one tension."""
TAUT = 1.0  # Tension of such a tendon [N]: more than a zero shifts
LAG = 6  # Readings after that which may still show an older tension: an HX711 settles in four
CHANGE = 0.3
"""Least change of the tension [N]: the weakest spring of the benches gives 0.6 N over 0.25 rad."""
NEGATIVE = 1.0
"""Tension below zero that is no shift of a live cell's zero [N]: drift and mounting make 0.4 N."""
WINDOW = 8
"""Readings of which most must be below zero, or jump, before a cell counts as lying [1]: 0.1 s."""
NEGATIVE_MIN = 6
JUMP = 1.5  # Change between two readings that is a jump if the next one goes back as far [N]
JUMPS_MIN = 5  # Fewest such turns in a window; two spikes make three, and a vibration of 20 Hz four
LEAP = 1.0
"""Change between two readings that the filter would have spread over four [N]: of a step it gives
the largest two alike, 0.38 of it."""
BESIDE = 0.15  # Change beside a leap, of the leap [1]; 0.33 at least of one that the filter spread
NOISES = 3.0  # Standard deviations by which noise may add to that [1]
FAST = 60.0
"""Readings per second from which the converter's filter takes every such vibration away [Hz]."""
TURNED = 0.05  # Angle let out after which a spool has turned [rad]
TURN_SHOWN = 0.06  # Time in which a live cell shows the turn [s]: its filter and a reading
LATE_MIN = 3  # Turns after which the tension rises, in a row: a hand may pull at a finger once
IDLE, CERTAIN = 0.08, 0.45
"""Share of the motor's strength [1] that may be lost in a gear, and the least part of the rest that
reaches the tendon [1]. Half an hour of recordings on virtual benches, worn ones among them, kept
1.4 times this tension."""
FREE = 0.04
"""Share of the motor's strength that a spool takes that runs free [1]. Of the rest `gear_yield`
likely reaches the tendon."""
DISAGREEING, LIKELY_MIN = 1.6, 4.0
"""Likely tension over the told one from which the two disagree [1], and the least one that is
judged [N]. In 18 minutes of sound runs a live cell kept 1.58, and 2.3 below that tension."""
SHIFT = 0.5  # Shift of a live cell's zero that is put up with there [N]
FRESH = 0.05
"""Age beyond which nobody knows what the motor does [s]: its watchdog may have stopped it."""
ROTOR = 1.5  # Inertia that a servo may have, of its data sheet's [1]
STILL = 0.01  # Speed below which a spool rests [rad/s]
LET_OUT = 2.0
"""Angle wound in at one tension while another servo lets out, or the other way round, per angle of
that [1]: the opening tendon of `finger_antagonist` moves half as far as the closing one."""


class CellDoubt:
    """Collects the evidence against one load cell.

    Args:
        calibration: Calibration of the cell; without one only a stuck cell is told from a live one.
        spool_radius: Radius of its spool [m].
    """

    def __init__(
        self, calibration: LoadCellCalibration | None, servo: ServoSpec, spool_radius: float
    ) -> None:
        self.fault: str | None = None  # Reason not to believe the cell; None where there is none
        self.likely = 0.0  # Tension that the motor likely makes, by its duty and its speed [N]
        sigma = 1.0 if calibration is None else calibration.noise / abs(calibration.slope)
        self._sigma = sigma
        self._equal_max = equal_max(sigma)
        self._servo = servo
        self._strength = servo.stall_torque / spool_radius
        self._fast = calibration is not None and calibration.rate >= FAST
        self._tensions: deque[float] = deque(maxlen=WINDOW + 1)
        self._least = 0.0
        self._short = 0
        self._equal = self._saturated = 0
        self._latest: deque[int] = deque(maxlen=CALM_READINGS)
        self._leap = inf if calibration is None else LEAP / abs(calibration.slope)
        self._row: deque[tuple[int, int]] = deque(maxlen=4)
        self._way: deque[tuple[float, float, float]] = deque()
        self._wound = self._in = self._out = self._felt = 0.0
        self._late = 0
        self._before: float | None = None
        self._anchor: float | None = None
        self._turn: tuple[float, float] | None = None
        self._lowest = self._shown = inf
        self._judged = True
        self._turns_late = 0
        self._others: Sequence[float] = ()
        self._others_before: Sequence[float] = ()

    def hear(self, reading: LoadCellReading) -> None:
        """Take a reading as it came."""
        self._equal = self._equal + 1 if self._latest and reading.counts == self._latest[-1] else 1
        self._saturated = self._saturated + 1 if reading.saturated else 0
        self._latest.append(reading.counts)
        self._row.append((reading.sequence, reading.counts))
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
        elif self._fast and self._leaps():
            self.fault = (
                f"the load cell must change as its converter does, over four readings; between two "
                f"it has gone from {self._row[1][1]} to {self._row[2][1]} counts and stays there: "
                "look at its wires and its converter"
            )

    def feel(self, force: float, instant: float) -> None:
        """Take a tension [N] and when it came [s]; one that changes is one that reacts."""
        self._felt = instant
        self._tensions.append(force)
        known = self._least > 0.0 and instant - self._way[-1][0] < FRESH
        self._short = self._short + 1 if known and force < self._least else 0
        if sum(each < -NEGATIVE for each in self._tensions) >= NEGATIVE_MIN:
            self.fault = (
                f"the tension must not be below zero, since a tendon cannot push; it is "
                f"{force:.1f} N: look at the load cell's wires, and calibrate anew"
            )
        elif self._fast and turns(self._tensions) >= JUMPS_MIN:
            self.fault = (
                f"the tension must not jump back and forth; it does so between "
                f"{min(self._tensions):.1f} and {max(self._tensions):.1f} N: look at the load "
                "cell's wires"
            )
        elif self._short >= LAG:
            self.fault = (
                f"the tension must be at least {self._least:.1f} N while the motor pulls so hard; "
                f"it is {force:.1f} N: look at the load cell, its calibration, the gear and "
                "the encoder"
            )
        elif self._fast and self._is_late(force, instant):
            self.fault = (
                f"the tension must fall when its spool lets the tendon out; {LATE_MIN} times it "
                "has gone on rising: the load cell's readings are late, look at its converter"
            )
        if self._anchor is None or abs(force - self._anchor) >= CHANGE:
            self._anchor, self._late = force, 0
            self._wound = self._in = self._out = 0.0
            self._others_before = self._others
            return
        taut = self._anchor > TAUT
        way = max(
            self._wound - WOUND - LET_OUT * self._others_way(-1.0),
            (self._in - MOVED - LET_OUT * self._others_way(-1.0)) * taut,
            (self._out - MOVED - LET_OUT * self._others_way(1.0)) * taut,
        )
        self._late += way > 0.0
        if self._late >= LAG:
            self.fault = (
                f"the tension must change while the motor moves its tendon; it has stayed at "
                f"{self._anchor:.1f} N over {way:.1f} rad more than it may: look at the load cell"
            )

    def move(
        self,
        state: ServoState,
        duty: float,
        others: Sequence[float] = (),
        voltage: float | None = None,
    ) -> None:
        """Take what a servo does.

        Args:
            duty: Duty that winds it [1].
            others: Angles of other spools [rad].
            voltage: Supply [V], where it is known.
        """
        self._others = others
        if len(self._others_before) != len(others):
            self._others_before = others
        self._way.append((state.time, state.position, duty))
        while state.time - self._way[0][0] > PULL_TIME:
            self._way.popleft()
        turned = 0.0 if self._before is None else state.position - self._before
        self._before = state.position
        self._in, self._out = max(0.0, self._in + turned), max(0.0, self._out - turned)
        if state.time - self._felt > PULL_TIME:  # its silence is another matter
            self._anchor = None
        self._least = self.likely = 0.0
        if (pulled := self._pull()) is None:
            return
        servo, (duty, speed, acceleration) = self._servo, pulled
        free = speed / servo.no_load_speed
        if voltage is not None and speed > -STILL:  # a gear holds back what a spool lets out
            rotor = ROTOR * servo.armature * max(acceleration, 0.0) / servo.stall_torque
            share = duty * voltage / servo.supply_voltage - free - rotor
            self._least = max(CERTAIN * self._strength * (share - IDLE) - SHIFT, 0.0)
            self.likely = max(servo.gear_yield * self._strength * (share - FREE), 0.0)
        pulls = self._anchor is not None and duty - free > PULL + PULL_PER_SPEED * abs(speed)
        if pulls or turned < 0.0:  # what is let out has not been wound in, pulled or not
            self._wound = max(0.0, self._wound + turned)

    def _is_late(self, force: float, instant: float) -> bool:
        """Tell whether the tension [N] has gone on rising after turns of a spool that is alone."""
        if not self._way or self._others:
            return False
        now, position, _ = self._way[-1]
        if self._turn is None or position >= min(self._turn[1], self._lowest + TURNED):
            self._turn = (now, position)
            self._lowest, self._shown, self._judged = position, inf, False
        self._lowest = min(self._lowest, position)
        if self._judged or instant < self._turn[0] + TURN_SHOWN:
            return False
        if self._shown == inf:
            self._shown = force
        if self._turn[1] - position < TURNED or abs(force - self._shown) < CHANGE:
            return False
        self._judged = True
        self._turns_late = self._turns_late + 1 if force > self._shown else 0
        return self._turns_late >= LATE_MIN

    def _leaps(self) -> bool:
        """Tell whether the latest readings, none of them missing, leap between still ones."""
        numbers = [number for number, _ in self._row]
        if self._saturated or len(numbers) < 4 or numbers[-1] - numbers[0] != 3:
            return False
        before, leap, after = (abs(b - a) for (_, a), (_, b) in pairwise(self._row))
        beside = BESIDE * leap + NOISES * self._sigma
        return leap > self._leap and before < beside and after < beside

    def _others_way(self, sign: float) -> float:
        """Return how far others wound in, or let out, since the tension last changed [rad]."""
        ways = zip(self._others_before, self._others, strict=True)
        return sum(max(sign * (now - before), 0.0) for before, now in ways)

    def _pull(self) -> tuple[float, float, float] | None:
        """Return mean duty [1], speed [rad/s] and acceleration [rad/s2] of the last moments."""
        begin, first, _ = self._way[0]
        end, last, _ = self._way[-1]
        if (passed := end - begin) < 0.8 * PULL_TIME:
            return None
        duty = sum(each for _, _, each in self._way) / len(self._way)
        _, middle, _ = self._way[len(self._way) // 2]
        bend = first - 2.0 * middle + last
        return duty, (last - first) / passed, 4.0 * bend / passed**2


def turns(tensions: Sequence[float]) -> int:
    """Count how often readings [N] jump and jump back at once."""
    steps = [later - earlier for earlier, later in pairwise(tensions)]
    return sum(a * b < 0.0 and min(abs(a), abs(b)) > JUMP for a, b in pairwise(steps))


def equal_max(sigma: float) -> int:
    r"""Return how many equal readings in a row a live cell may send.

    Two readings of a normal scatter :math:`\sigma` [counts] are equal with a chance of
    :math:`1 / (2 \sqrt{\pi} \sigma)`.
    """
    chance = min(1.0 / (2.0 * sqrt(pi) * max(sigma, 1.0)), 0.5)
    return 1 + ceil(log(CHANCE) / log(chance))
