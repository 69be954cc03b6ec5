"""The angle of a spool over several turns, from a register that a restart cuts to one."""

from tendon_hardware.servos.base import ServoSpec

WIND_MAX = 1.0  # Greatest angle by which a spool turns on while its motor is off [rad]


class SpoolAngle:
    """Counts of a servo as angles from home; the servo itself keeps no home.

    A servo whose register begins anew with each turn is followed: between two reads its spool turns
    by less than half a turn.

    Args:
        counts_turns: Whether its register goes on over a turn.
    """

    def __init__(self, spec: ServoSpec, *, counts_turns: bool = True) -> None:
        self._counts_turns = counts_turns
        self._unit = spec.position_unit
        self._turn = spec.counts_per_turn
        self._home = 0
        self._last = 0
        self.has_home = False

    def set_home(self, counts: int, angle: float) -> None:
        """Call the place where the register holds these counts an angle [rad]."""
        self._home = counts - round(angle / self._unit)
        self._last = counts
        self.has_home = True

    def angle(self, counts: int) -> float:
        """Return the angle of counts that were just read [rad]."""
        if not self._counts_turns:
            half = self._turn // 2
            counts = self._last + (counts - self._last + half) % self._turn - half
        self._last = counts
        return (counts - self._home) * self._unit

    def restore_turns(self, counts: int) -> None:
        """Put back the turns that a restart has made the servo forget.

        The servo knows its angle within one turn. Without a motor the tendon unwinds the spool.
        The turn is chosen with which the spool has turned back by less than a turn, and on by no
        more than a little.

        Args:
            counts: Content of the register after the restart.
        """
        latest = self._last + round(WIND_MAX / self._unit)
        self._home -= (latest - counts) // self._turn * self._turn
        self._last = counts
