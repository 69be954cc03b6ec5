"""What goes wrong on a bench, by chance or at a set time."""

from __future__ import annotations

from dataclasses import dataclass, fields

from tendon_newton.errors import InvalidParameter, unknown_name

ALERT_BITS = {
    "input_voltage": 0x01,
    "overheating": 0x04,
    "encoder": 0x08,
    "electrical": 0x10,
    "overload": 0x20,
}
"""Hardware errors by word; which of them switch the torque off is register 63's business."""
EVENTS = ("unplug", "alert", "supply_dip", "cell_silence", "reboot")


@dataclass(frozen=True, kw_only=True, slots=True)
class FaultEvent:
    """One mishap."""

    name: str
    """One of ``unplug``, ``alert``, ``supply_dip``, ``cell_silence``, ``reboot``."""
    start: float = 0.0
    """When, on the bench's clock [s]; at once when that has passed."""
    duration: float = 1.0
    """How long, where it lasts [s]."""
    voltage: float = 5.0
    """To what the supply falls [V]; below 4.5 V the servo restarts."""
    alert: str = "overload"
    """Which hardware error an alert latches."""
    servo: int = 0
    """Place of the servo whose alert, restart or silent cell it is; the rest strikes all."""

    def __post_init__(self) -> None:
        if self.name not in EVENTS:
            raise unknown_name("fault event", self.name, EVENTS)
        if self.alert not in ALERT_BITS:
            raise unknown_name("hardware error", self.alert, ALERT_BITS)
        if self.servo < 0:
            raise InvalidParameter(f"A fault's servo is counted from 0; it is {self.servo}")
        if self.duration < 0.0 or self.start < 0.0 or self.voltage < 0.0:
            raise InvalidParameter(
                f"A fault's start, duration and voltage must not be negative; {self.name} has "
                f"{self.start} s, {self.duration} s and {self.voltage} V"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class Faults:
    """How often which fault strikes [1], and which are planned."""

    dropped_replies: float = 0.0
    """Answers of the servo that never come."""
    corrupted_replies: float = 0.0
    """Answers with one bit flipped."""
    line_noise: float = 0.0
    """Answers with a few random bytes before them."""
    garbled_lines: float = 0.0
    """Lines of the load cell with one byte changed."""
    lost_lines: float = 0.0
    """Lines of the load cell that never come."""
    extra_latency: float = 0.0
    """Added to each answer [s]."""
    events: tuple[FaultEvent, ...] = ()

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name != "events" and value < 0.0:
                raise InvalidParameter(f"{each.name} must not be negative; got {value}")
            if each.name not in ("events", "extra_latency") and value > 1.0:
                raise InvalidParameter(f"{each.name} is a share of 0 to 1; got {value}")
