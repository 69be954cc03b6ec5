"""Whether motors that read as off are off: what their spools and strings do then."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from math import inf

from tendon_hardware.benches.bench import BenchDrive, motors_off
from tendon_hardware.clock import Clock
from tendon_hardware.errors import HardwareFault, MotorStillDriven

WATCHED = 0.6  # Time for which spools and strings are watched [s]
PERIOD = 0.05  # Time between two looks [s]
WOUND = 0.05  # Angle wound in during the second half that is no rest of a motion [rad]
SLOWING = 0.7
"""Greatest way in that half, of the way in the first one, of a spool that coasts [1]: its gear
brakes it, and its string more so."""
HELD = 5.0  # Tension from which it is told that it does not fall [N]
FALLEN = 0.8  # Tension that is left of one that falls, at most [1]
AHEAD = 0.1
"""Time until a spool that its string throws can be braked [s]: the next look, the motor's switching
on, and the way to rest."""
BRAKED = 0.1  # Time that a motor without duty has to brake it [s]; it takes a fifth of that


@dataclass(kw_only=True)
class Rest:
    """What one servo has told since its motor was switched off."""

    drive: BenchDrive
    ways: list[tuple[float, float]] = field(
        default_factory=list[tuple[float, float]]
    )  # Times [s], spool angles [rad]
    tensions: list[float] = field(default_factory=list[float])  # [N]

    def look(self) -> None:
        """Take what can be read."""
        cell, calibration = self.drive.load_cell, self.drive.calibration
        try:
            state = self.drive.servo.read_state()
        except HardwareFault:
            return  # that it cannot be reached is told elsewhere
        self.ways.append((state.time, state.position))
        if cell is not None and calibration is not None:
            self.tensions += [
                float(calibration.force(reading.counts))
                for reading in cell.drain()
                if not reading.saturated
            ]

    @property
    def thrown(self) -> float:
        """Angle that it has come to once it can be braked [rad]; infinite before two looks."""
        if len(self.ways) < 2:
            return inf
        (before, there), (now, here) = self.ways[-2:]
        return here + AHEAD * (here - there) / (now - before)

    @property
    def wound(self) -> float:
        """Angle wound in without slowing down [rad]; zero for a spool that rests or coasts."""
        if len(self.ways) < 3:
            return 0.0
        first, middle, last = (self.ways[k][1] for k in (0, len(self.ways) // 2, -1))
        steady = last - middle > SLOWING * (middle - first)
        return last - middle if steady and last - middle > WOUND else 0.0

    @property
    def holds(self) -> float | None:
        """Tension that does not fall [N]."""
        if not self.tensions:
            return None
        left = min(self.tensions[-3:])
        return left if left > max(HELD, FALLEN * max(self.tensions[:3])) else None


def still_driven(
    drives: Sequence[BenchDrive], clock: Clock, tell: Callable[[str], None], farthest: float = -inf
) -> MotorStillDriven | None:
    """Watch motors that were just switched off; tell and return what shows that one pulls on.

    A tension that does not fall is told only: a gear may hold it.

    Args:
        farthest: Angle beyond which no string may throw its spool [rad]; a motor without duty
            brakes it before.
    """
    rests = [Rest(drive=drive) for drive in drives]
    for rest in rests:
        if rest.drive.load_cell is not None:
            rest.drive.load_cell.drain()
    end = clock.now() + WATCHED
    while clock.now() < end:
        for rest in rests:
            rest.look()
        thrown = [rest.drive for rest in rests if rest.thrown < farthest]
        if thrown:
            brake(thrown, clock, tell)
            return still_driven(drives, clock, tell)
        clock.sleep_until(clock.now() + PERIOD)
    found: MotorStillDriven | None = None
    for rest in rests:
        servo = rest.drive.servo
        if servo.torque_enabled:  # which was told when it could not be switched off
            found = MotorStillDriven(
                f"servo {servo.identifier} must answer that its motor is off; it has not: switch "
                "its supply off"
            )
        elif rest.wound:
            found = MotorStillDriven(
                f"servo {servo.identifier} must rest once its motor is switched off; its spool "
                f"has wound in by {rest.wound:.2f} rad since: switch its supply off"
            )
            tell(f"THE MOTOR PULLS ON, SWITCH ITS SUPPLY OFF: {found}")
        elif rest.holds is not None:
            tell(
                f"Servo {servo.identifier} reads as off, and its string keeps {rest.holds:.1f} N: "
                "its gear holds it, or its motor pulls on. Switch its supply off before you touch "
                "the finger."
            )
    return found


def brake(drives: Sequence[BenchDrive], clock: Clock, tell: Callable[[str], None]) -> None:
    """Let motors without duty bring their spools to rest, and switch them off again."""
    with suppress(HardwareFault):  # whatever keeps one off is told when it is to drive
        for drive in drives:
            drive.servo.enable_torque()
        clock.sleep_until(clock.now() + BRAKED)
    motors_off(drives, tell)
