"""The log of one run, as ROS 2 messages: a slow disk must not make the control loop late."""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tendon_hardware.errors import LogNotWritten
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.logs import ros_messages as ros
from tendon_hardware.logs.mcap_file import McapFile
from tendon_hardware.logs.ros_messages import Message
from tendon_hardware.servos.base import ServoCounters, ServoHealth, ServoState
from tendon_newton.data.formats import topic_mapping as topics

WRITE_PERIOD = 0.02
"""Time between two writings [s]. Encoding holds the interpreter, 20 us a message. Ten at a time
make the loop late by 0.2 ms at most, and ten times as many would by 2 ms."""
SYNC_PERIOD = 0.4  # Time between two waits for the disk [s]; what a power cut loses besides
TURNED_TOPIC = "/ball/turned"  # How far a camera has seen a ball turn in its cup [rad]


class BackgroundLog:
    """Takes messages without waiting and writes them in a thread of its own."""

    def __init__(self, file: McapFile) -> None:
        self._file = file
        self._waiting: deque[tuple[str, str, int, Message]] = deque()
        self._failure: LogNotWritten | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    def write(self, topic: str, kind: str, stamp: int, message: Message) -> None:
        """Take a message.

        Raises:
            LogNotWritten: The disk took no more, now or earlier.
        """
        if self._failure is not None:
            raise self._failure
        self._waiting.append((topic, kind, stamp, message))

    def flush(self, *, sync: bool) -> None:
        """Do nothing: the thread flushes by itself."""

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write all that is waiting, then the end of the file."""
        self._stop()
        if self._failure is not None:
            self._file.close()
            raise self._failure
        self._file.finish(metadata)

    def close(self) -> None:
        """Write all that is waiting and close the file as it is."""
        self._stop()
        with contextlib.suppress(LogNotWritten):
            self._file.flush(sync=True)
        self._file.close()

    def _stop(self) -> None:
        self._ending.set()
        self._thread.join()

    def _run(self) -> None:
        synced = time.monotonic()
        while self._failure is None:
            ending = self._ending.wait(WRITE_PERIOD)
            try:
                while self._waiting:
                    self._file.write(*self._waiting.popleft())
                due = time.monotonic() - synced >= SYNC_PERIOD
                self._file.flush(sync=due)
            except LogNotWritten as failure:
                self._failure = failure
                return
            if due:
                synced = time.monotonic()
            if ending:
                return


@dataclass(frozen=True, kw_only=True, slots=True)
class TimeBase:
    """Conversion of the bench's clock into the stamps of a file."""

    start: float  # Instant on the bench's clock that has the stamp ``epoch`` [s]
    epoch: int  # Nanoseconds since 1970; of a simulated clock, since its start

    def stamp(self, instant: float) -> int:
        """Return the stamp [ns] of an instant [s]."""
        return self.epoch + round(1e9 * (instant - self.start))


class SessionLog:
    """Writes what happens; every instant is one of the bench's clock [s]."""

    def __init__(
        self, sink: McapFile | BackgroundLog, time_base: TimeBase, tendons: int = 1
    ) -> None:
        self.sink = sink
        self.time_base = time_base
        self._names = [f"tendon_{d}" for d in range(tendons)]

    def command(self, instant: float, *angles: float) -> None:
        """Write the command [rad] of each servo that takes effect at an instant."""
        stamp = self.time_base.stamp(instant)
        message = ros.joint_state(stamp, self._names, angles)
        self.sink.write(topics.COMMAND_TOPIC, ros.JOINT_STATE, stamp, message)

    def duty(self, instant: float, duty: float, place: int = 0) -> None:
        """Write the duty [1] that a loop on the host sends to a servo."""
        stamp = self.time_base.stamp(instant)
        self.sink.write(own_topic(topics.DUTY_TOPIC, place), ros.NUMBER, stamp, {"data": duty})

    def state(self, *states: ServoState) -> None:
        """Write a reading of each servo, dated by the middle of all."""
        stamp = self.time_base.stamp(sum(state.time for state in states) / len(states))
        message = ros.joint_state(
            stamp,
            self._names,
            [state.position for state in states],
            [state.velocity for state in states],
            [state.current for state in states],
        )
        self.sink.write(topics.STATE_TOPIC, ros.JOINT_STATE, stamp, message)

    def raw_force(self, reading: LoadCellReading, place: int = 0) -> None:
        """Write a reading of a load cell as it came; it can be calibrated anew."""
        stamp = self.time_base.stamp(reading.host_time)
        values = (reading.sequence, reading.device_time_us, reading.counts)
        topic = own_topic(topics.RAW_FORCE_TOPIC, place)
        self.sink.write(topic, ros.INTEGERS, stamp, ros.integers(values))

    def force(self, instant: float, arrival: float, newtons: float, place: int = 0) -> None:
        """Write the tension [N] of a tendon, its instant and when it arrived."""
        message = ros.wrench(self.time_base.stamp(instant), self._names[place], newtons)
        self.sink.write(topics.FORCE_TOPIC, ros.WRENCH, self.time_base.stamp(arrival), message)

    def tip(self, instant: float, x: float, z: float) -> None:
        """Write where the finger's tip is in its plane [m]."""
        stamp = self.time_base.stamp(instant)
        self.sink.write(topics.TIP_TOPIC, ros.POINT, stamp, ros.point(stamp, "base", x, 0.0, z))

    def ball(self, instant: float, arrival: float, place: Sequence[float], turned: float) -> None:
        """Write when and where a camera saw the ball, from its start [m], and its turn [rad]."""
        stamp = self.time_base.stamp(arrival)
        message = ros.point(self.time_base.stamp(instant), "ball_start", *place)
        self.sink.write(topics.BALL_TOPIC, ros.POINT, stamp, message)
        self.sink.write(TURNED_TOPIC, ros.NUMBER, stamp, {"data": turned})

    def truth(self, instant: float, ball: Sequence[float], joints: Sequence[float]) -> None:
        """Write the ball's true place [m] and quaternion (x, y, z, w), and joint angles [rad]."""
        stamp = self.time_base.stamp(instant)
        self.sink.write(topics.TRUTH_TOPIC, ros.NUMBERS, stamp, ros.numbers([*ball, *joints]))

    def health(
        self,
        instant: float,
        health: ServoHealth,
        counters: ServoCounters,
        *further: tuple[ServoHealth, ServoCounters],
        missed: int = 0,
        skipped: int = 0,
    ) -> None:
        """Write voltage, temperature, alerts and what was missed so far.

        Args:
            instant: Instant of the reading [s].
        """
        entries = zip(self._names, ((health, counters), *further), strict=True)
        self._diagnose(instant, [health_status(*each, missed, skipped) for each in entries])

    def event(
        self, instant: float, source: str, level: str, text: str, *, place: int = 0, **values: Any
    ) -> None:
        """Write that something happened: a gap begins or ends, a limit is passed, a hand comes."""
        self._diagnose(instant, [ros.status(source, level, text, self._names[place], values)])

    def _diagnose(self, instant: float, statuses: Sequence[ros.Message]) -> None:
        stamp = self.time_base.stamp(instant)
        self.sink.write(
            topics.DIAGNOSTICS_TOPIC, ros.DIAGNOSTICS, stamp, ros.diagnostics(stamp, statuses)
        )

    def finish(self, session: Mapping[str, str]) -> None:
        """Write how it was made and what was missed, and close the file."""
        self.sink.finish({topics.SESSION_RECORD: session})

    def close(self) -> None:
        """Close the file as it is, without an end."""
        self.sink.close()


def health_status(
    tendon: str, entry: tuple[ServoHealth, ServoCounters], missed: int, skipped: int
) -> ros.Message:
    """Return what a servo says of itself as a status."""
    health, counters = entry
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
    return ros.status("servo", level, ", ".join(health.alerts) or "no alert", tendon, values)


def own_topic(topic: str, place: int) -> str:
    """Return the topic of one tendon's messages that name none; the first one's is as it stands."""
    if place == 0:
        return topic
    head, *rest = topic.removeprefix("/").split("/")
    return "/".join(["", f"{head}_{place}", *rest])


def open_log(
    path: Path,
    session: Mapping[str, str],
    time_base: TimeBase,
    *,
    background: bool,
    endless: bool = False,
    tendons: int = 1,
) -> SessionLog:
    """Open a log and write how the run is made.

    Args:
        path: The file; it must not exist.
        background: Whether a thread writes, as beside a real clock it must.
        endless: Whether the run may last for hours.
    """
    file = McapFile(path, {topics.SESSION_RECORD: session}, endless=endless)
    return SessionLog(BackgroundLog(file) if background else file, time_base, tendons)
