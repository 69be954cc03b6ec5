"""The log of one run: what the servo, the load cell and the operator did, as ROS 2 messages."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from hardware import ros_messages as ros
from hardware.background_log import BackgroundLog
from hardware.load_cells.base import LoadCellReading
from hardware.mcap_file import McapFile
from hardware.servos.base import ServoCounters, ServoHealth, ServoState
from tendon_newton.recording_formats.topic_mapping import (
    COMMAND_TOPIC,
    DIAGNOSTICS_TOPIC,
    DUTY_TOPIC,
    FORCE_TOPIC,
    RAW_FORCE_TOPIC,
    SESSION_RECORD,
    STATE_TOPIC,
    TIP_TOPIC,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class TimeBase:
    """How the bench's clock becomes the stamps of a file."""

    start: float
    """Instant on the bench's clock that has the stamp ``epoch`` [s]."""
    epoch: int
    """Nanoseconds since 1970; of a simulated clock, since its start."""

    def stamp(self, instant: float) -> int:
        """Return the stamp [ns] of an instant [s]."""
        return self.epoch + round(1e9 * (instant - self.start))


class Sink(Protocol):
    """Where messages go."""

    @property
    def path(self) -> Path:
        """The file."""
        ...

    def write(self, topic: str, kind: str, stamp: int, message: ros.Message) -> None:
        """Write a message."""
        ...

    def flush(self, *, sync: bool) -> None:
        """Hand what is written to the system."""
        ...

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write the end of the file and close it."""
        ...

    def close(self) -> None:
        """Close the file as it is."""
        ...


class SessionLog:
    """Writes what happens; every instant is one of the bench's clock [s].

    Args:
        sink: Where the messages go.
        time_base: How instants become stamps.
        tendon: Name of the tendon.
    """

    def __init__(self, sink: Sink, time_base: TimeBase, tendon: str = "tendon_0") -> None:
        self.sink = sink
        self.time_base = time_base
        self.tendon = tendon
        self._names = [tendon]

    @property
    def path(self) -> Path:
        """The file."""
        return self.sink.path

    def command(self, instant: float, angle: float) -> None:
        """Write a command [rad] that takes effect at an instant."""
        stamp = self.time_base.stamp(instant)
        message = ros.joint_state(stamp, self._names, [angle])
        self.sink.write(COMMAND_TOPIC, ros.JOINT_STATE, stamp, message)

    def duty(self, instant: float, duty: float) -> None:
        """Write the duty [1] that a loop on the host sends."""
        stamp = self.time_base.stamp(instant)
        self.sink.write(DUTY_TOPIC, ros.NUMBER, stamp, {"data": duty})

    def state(self, state: ServoState) -> None:
        """Write a reading of the servo."""
        stamp = self.time_base.stamp(state.time)
        message = ros.joint_state(
            stamp, self._names, [state.position], [state.velocity], [state.current]
        )
        self.sink.write(STATE_TOPIC, ros.JOINT_STATE, stamp, message)

    def raw_force(self, reading: LoadCellReading) -> None:
        """Write a reading of the load cell as it came; it can be calibrated anew."""
        stamp = self.time_base.stamp(reading.host_time)
        values = (reading.sequence, reading.device_time_us, reading.counts)
        self.sink.write(RAW_FORCE_TOPIC, ros.INTEGERS, stamp, ros.integers(values))

    def force(self, instant: float, arrival: float, newtons: float) -> None:
        """Write a tension [N], its instant and when it arrived."""
        message = ros.wrench(self.time_base.stamp(instant), self.tendon, newtons)
        self.sink.write(FORCE_TOPIC, ros.WRENCH, self.time_base.stamp(arrival), message)

    def tip(self, instant: float, x: float, z: float) -> None:
        """Write where the finger's tip is [m]."""
        stamp = self.time_base.stamp(instant)
        self.sink.write(TIP_TOPIC, ros.POINT, stamp, ros.point(stamp, "base", x, z))

    def health(
        self, instant: float, health: ServoHealth, counters: ServoCounters,
        *, missed: int = 0, skipped: int = 0,
    ) -> None:  # fmt: skip
        """Write voltage, temperature, alerts and what was missed so far.

        Args:
            instant: When this was so [s].
            health: What the servo says of itself.
            counters: What went wrong on its bus.
            missed: Ticks whose reading never came.
            skipped: Ticks for which this computer was late.
        """
        values = {
            "voltage": health.voltage,
            "temperature": health.temperature,
            "hardware_error": health.hardware_error,
            "torque_enabled": int(health.torque_enabled),
            "watchdog_tripped": int(health.watchdog_tripped),
            "missed": missed,
            "retries": counters.retries,
            "corrupted": counters.corrupted,
            "skipped_ticks": skipped,
        }
        level = "error" if health.alerts else "ok"
        words = ", ".join(health.alerts) or "no alert"
        self._diagnose(instant, [ros.status("servo", level, words, self.tendon, values)])

    def event(self, instant: float, source: str, level: str, text: str, **values: Any) -> None:
        """Write that something happened: a gap begins or ends, a limit is passed, a hand comes."""
        self._diagnose(instant, [ros.status(source, level, text, self.tendon, values)])

    def _diagnose(self, instant: float, statuses: Sequence[ros.Message]) -> None:
        stamp = self.time_base.stamp(instant)
        self.sink.write(DIAGNOSTICS_TOPIC, ros.DIAGNOSTICS, stamp, ros.diagnostics(stamp, statuses))

    def finish(self, session: Mapping[str, str]) -> None:
        """Write how it was made and what was missed, and close the file."""
        self.sink.finish({SESSION_RECORD: session})

    def close(self) -> None:
        """Close the file as it is, without an end."""
        self.sink.close()


def open_log(
    path: Path, session: Mapping[str, str], time_base: TimeBase, *, background: bool,
    endless: bool = False,
) -> SessionLog:  # fmt: skip
    """Open a log and write how the run is made.

    Args:
        path: The file; it must not exist.
        session: How the run is made.
        time_base: How instants become stamps.
        background: Whether a thread writes, as beside a real clock it must.
        endless: Whether the run may last for hours.
    """
    file = McapFile(path, {SESSION_RECORD: session}, endless=endless)
    return SessionLog(BackgroundLog(file) if background else file, time_base)
