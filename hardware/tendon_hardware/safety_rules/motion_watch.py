r"""What a servo was told, what it says it does and what its spool does, held against each other.

A servo that pulls otherwise than it is told and an encoder that lies look the same: a spool does
not move as its motor must make it. Whatever the friction, a duty :math:`u`, as a share of the data
sheet's supply, under a string's tension :math:`F` bounds the speed. So does a duty above what a
gear loses. With the free speed :math:`\omega_f`, that without load :math:`\omega_0`, the torque at
standstill :math:`M` and :math:`l = r F / M`:

.. math:: c_f \omega_f \min(0, u - l) \le \omega \le c_f \omega_f \max(0, u - c_l l)

    \omega \ge \omega_0 (c (u - u_0) - l), \qquad -\omega \ge \omega_0 c (-u - u_0)

A way beyond these bounds is summed up, and forgiven slowly: a jump shows at once, a drift later
(E. S. Page, Continuous inspection schemes, Biometrika 1954).

A spool that stands still keeps all bounds, since a gear's friction may hold it. But then it holds
the tension too, as long as no other spool of the finger moves: one that rises and falls with the
duty has a spool that moves.
"""

from collections import deque
from collections.abc import Sequence
from math import exp
from operator import sub

from tendon_hardware.benches.bench import BenchDrive
from tendon_hardware.load_cells.cell_doubt import CERTAIN, FRESH, IDLE, PULL
from tendon_hardware.load_cells.cell_doubt import FAST as QUICK
from tendon_hardware.servos.base import ServoState

FAST = 1.2
"""Greatest speed of a spool, of what follows from the data sheet [1]: torque constants of one model
scatter by a tenth, and so does the supply that a servo tells."""
SURE = 0.65
"""Least share of a load that a motor feels [1]: the data sheet's torque is what the gear leaves."""
FORGIVEN = 0.02
"""Speed beyond the bounds that is forgiven [rad/s]. With it the sound runs of
``python -m tests.faults calm`` leave 0.002 rad, worn gears among them."""
COAST = 2.0  # Time in which a speed follows its duty, of the rotor's time constant [1]
SHOWN = 0.5  # Time in which a load cell shows a tension: one of 10 Hz settles in four readings [s]
SHIFT = 1.0  # Tension that it may show too little [N]
AGREED = 0.1  # Time for which a present duty must differ [s]: a slope takes a quarter of it
STANDS = 0.005
"""Way in which a spool stands still [rad]: three counts of 4096, two of them noise."""
FOLLOWED = 2.0
"""Change of its string's tension meanwhile that follows the duty [N]: one of 36 N/mm on a spool of
11 mm moves it so far."""
FOLLOWED_MIN = 3  # Such changes to and fro in a row: a hand may push in time with a duty once
LOST = 0.2  # Time between two readings in which nobody knows what happened [s]


class MotionWatch:
    """Watches one servo.

    Args:
        drive: The servo, whose driver knows what was sent, and its load cell's calibration.
        spool_radius: Radius of its spool [m].
        greatest: Tension that its string may have where no load cell tells it [N].
    """

    def __init__(self, drive: BenchDrive, spool_radius: float, greatest: float) -> None:
        self._servo = drive.servo
        spec, calibration = drive.servo.spec, drive.calibration
        quick = calibration is not None and calibration.rate >= QUICK
        self._fastest = FAST * spec.free_speed
        self._share = spool_radius / spec.stall_torque
        self._coast = COAST * spec.armature * spec.free_speed / spec.stall_torque
        self._greatest = greatest
        self._sure = SURE if quick else 0.0
        self.forget()

    def forget(self) -> None:
        """Begin anew: the servo was not driven, or nobody knows how."""
        self._before: tuple[float, float, float] | None = None
        self._positions: deque[float] = deque(maxlen=3)
        self._tensions: deque[tuple[float, float]] = deque()
        self._differences: deque[tuple[float, float]] = deque()
        self._in = self._out = self._high = self._low = 0.0
        self._stand((), 0.0)

    @property
    def strayed(self) -> float:
        """How far the spool has wound in beyond its bounds, or out where negative [rad]."""
        return self._in if self._in > self._out else -self._out

    @property
    def disobeyed(self) -> float:
        """Least difference of present and sent duty over the last moments [1]."""
        seen = self._differences
        if not seen or seen[-1][0] - seen[0][0] < AGREED:
            return 0.0
        return min(difference for _, difference in seen)

    @property
    def stuck(self) -> str | None:
        """Why the encoder is not believed; None where nothing speaks against it."""
        if self._followed < FOLLOWED_MIN:
            return None
        return (
            f"the spool must move when the tension follows the duty; {self._followed} times it has "
            f"changed by {FOLLOWED:g} N with it, and the spool stands still: look at the encoder"
        )

    def take(self, state: ServoState, tension: float | None, others: Sequence[float] = ()) -> None:
        """Take a reading of the servo, and what is known beside it.

        Args:
            tension: The latest tension [N], where a load cell tells it.
            others: Angles of the finger's other spools [rad].
        """
        servo, now = self._servo, state.time
        if not servo.torque_enabled or (self._before and now - self._before[0] > LOST):
            self.forget()
        self._positions.append(state.position)
        position = sorted(self._positions)[len(self._positions) // 2]  # one wrong reading is none
        if state.duty is not None:
            self._differences.append((now, abs(state.duty - servo.duty)))
        while len(self._differences) > 1 and now - self._differences[1][0] >= AGREED:
            self._differences.popleft()
        if tension is not None:
            self._tensions.append((now, tension))
        while self._tensions and now - self._tensions[0][0] > SHOWN:
            self._tensions.popleft()
        if self._before is not None:
            then, there, duty = self._before
            self._move(now - then, position - there, {duty, servo.duty})
        self._before = (now, position, servo.duty)
        if tension is not None:
            self._follow((position, *others), tension)

    def _stand(self, positions: Sequence[float], tension: float) -> None:
        """Begin to look for a tension [N] that changes while all spools stand still [rad]."""
        self._lowest = self._highest = positions
        self._sign, self._from = 0.0, tension
        self._followed, self._answered = 0, True

    def _follow(self, positions: Sequence[float], tension: float) -> None:
        """Count how often in a row the tension [N] has followed the duty."""
        if len(self._lowest) != len(positions):
            self._stand(positions, tension)
        self._lowest = [*map(min, self._lowest, positions)]
        self._highest = [*map(max, self._highest, positions)]
        if max(map(sub, self._highest, self._lowest)) > STANDS:
            self._stand(positions, tension)
        duty = self._servo.duty
        sign = 1.0 if duty > PULL else -1.0 if duty < PULL / 2.0 else self._sign
        if sign != self._sign:
            self._followed *= self._answered
            self._sign, self._from, self._answered = sign, tension, False
        self._from = sign * min(sign * self._from, sign * tension)
        if not self._answered and sign * (tension - self._from) > FOLLOWED:
            self._followed, self._answered = self._followed + 1, True

    def _move(self, passed: float, way: float, duties: set[float]) -> None:
        """Take a way [rad] made in some time [s] under duties [1]."""
        if passed > FRESH:  # the servo's watchdog may have stopped it
            duties.add(0.0)
        low, high = self._bounds(min(duties), max(duties))
        kept = exp(-passed / self._coast)
        self._high = max(high, high + kept * (self._high - high))
        self._low = min(low, low + kept * (self._low - low))
        self._in = max(0.0, self._in + way - (self._high + FORGIVEN) * passed)
        self._out = max(0.0, self._out - way + (self._low - FORGIVEN) * passed)

    def _bounds(self, least: float, most: float) -> tuple[float, float]:
        """Return the least and greatest speed [rad/s] under duties between two [1]."""
        servo, spec = self._servo, self._servo.spec
        known = spec.supply_range if servo.voltage is None else (servo.voltage, servo.voltage)
        weak, strong = (voltage / spec.supply_voltage for voltage in known)
        least *= strong if least < 0.0 else weak
        most *= strong if most > 0.0 else weak
        told = [tension for _, tension in self._tensions]
        load = self._share * (max(told) + SHIFT if told else self._greatest)
        sure = self._share * (min(told) - SHIFT if told else 0.0)
        high = self._fastest * max(most - self._sure * max(sure, 0.0), 0.0)
        low = self._fastest * (least - load)
        if most < 0.0:
            high = -spec.no_load_speed * max(CERTAIN * (-most - IDLE), 0.0)
        if low > 0.0:
            low = spec.no_load_speed * max(CERTAIN * (least - IDLE) - load, 0.0)
        return low, high
