"""A virtual bench as a process of its own, in real time.

The process waits for bytes alone. Each request brings the plant up to the present. A timer does so
every few milliseconds, so that no request finds much to catch up with.
"""

import argparse
import contextlib
import fcntl
import heapq
import json
import os
import select
import signal
import socket
import struct
import sys
import termios
import time
import tty
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from tendon_hardware.virtual_bench.emulation.emulations import SERVO_MODELS
from tendon_hardware.virtual_bench.faults import FaultEvent
from tendon_hardware.virtual_bench.memory.control_table import XC330_T288_T
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_hardware.virtual_bench.physics.wear import NEW, worn
from tendon_hardware.virtual_bench.served_bench import VirtualBench
from tendon_newton.errors import TendonNewtonError

BAUD_CODES = {
    getattr(termios, f"B{baud}"): baud
    for baud in (
        *(9_600, 38_400, 57_600, 115_200, 500_000),
        *(1_000_000, 2_000_000, 3_000_000, 4_000_000),
    )
}
BACKLOG = 3000
"""Bytes that nobody has read after which the oldest are thrown away, as a driver's ring does."""


class PtyPort:
    """One end for a server; the other is a path that any serial program opens.

    The server keeps the client's end open as well, so that closing and opening the port again is
    no hang-up. Unplugging closes both: the client gets an input/output error and the path is gone
    until the adapter is back.

    Args:
        path: Symbolic link to the terminal that a client opens.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._server = self._client = -1
        self.plug()

    @property
    def is_plugged(self) -> bool:
        """Whether the path is there."""
        return self._server >= 0

    def plug(self) -> None:
        """Make the terminal and the path to it."""
        if self.is_plugged:
            return
        self._server, self._client = os.openpty()
        for end in (self._server, self._client):
            tty.setraw(end)
        os.set_blocking(self._server, False)
        os.chmod(os.ttyname(self._client), 0o666)  # noqa: PTH101  # a device, not a file
        fresh = self.path.with_suffix(".new")
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(os.ttyname(self._client))
        fresh.replace(self.path)

    def unplug(self) -> None:
        """Hang up and take the path away."""
        if not self.is_plugged:
            return
        self.path.unlink(missing_ok=True)
        os.close(self._server)
        os.close(self._client)
        self._server = self._client = -1

    def fileno(self) -> int:
        """Return the server's end, for ``select``."""
        return self._server

    @property
    def baud(self) -> int | None:
        """Speed that the client has set [bit/s]; ``None`` for one that no servo knows."""
        return BAUD_CODES.get(termios.tcgetattr(self._client)[5])

    def read(self) -> bytes:
        """Return what the client has sent, empty where it has sent nothing."""
        try:
            return os.read(self._server, 4096)
        except OSError:  # nothing there
            return b""

    def write(self, data: bytes) -> None:
        """Send bytes to the client, throwing away the oldest where nobody reads."""
        if not self.is_plugged:
            return
        waiting = struct.unpack("i", fcntl.ioctl(self._client, termios.FIONREAD, b"\0" * 4))[0]
        if waiting + len(data) > BACKLOG:
            termios.tcflush(self._client, termios.TCIFLUSH)
        with contextlib.suppress(BlockingIOError):
            os.write(self._server, data)


SERVO, LOAD_CELL, CAMERA, CONTROL = "servo", "load_cell", "camera", "control"
"""Names of the files in the process's folder; further load cells are numbered."""
KEEP_UP = 4e-3  # Longest time that the plant falls behind the clock [s]
PRIORITY = 1  # Priority among processes in real time, where the system grants it: 4 % of a core
LONGEST_LAG = 1.0
"""Behind by more, the process was suspended: the bench's clock stops for as long [s]."""


def load_cell_name(place: int) -> str:
    """Return the name of the port of the load cell in one of the tendons."""
    return LOAD_CELL if place == 0 else f"{LOAD_CELL}_{place}"


class BenchServer:
    """Serves one bench on its pseudo-terminals and a control socket."""

    def __init__(self, bench: VirtualBench, folder: Path) -> None:
        self._bench = bench
        self._folder = folder
        self._servo = PtyPort(folder / SERVO)
        self._cells = [
            PtyPort(folder / load_cell_name(place)) for place in range(len(bench.servos))
        ]
        self._camera = None if bench.plant.camera is None else PtyPort(folder / CAMERA)
        self._control = socket.socket(socket.AF_UNIX)
        self._control.bind(str(folder / CONTROL))
        self._control.listen()
        self._clients: dict[socket.socket, bytes] = {}
        self._replies: list[tuple[float, int, int, bytes]] = []
        self._sent = 0
        self._start = time.monotonic()

    def serve(self, parent: int | None = None) -> None:
        """Serve until a signal comes or the pipe closes that the parent process holds."""
        sources: list[Any] = [self._control] + ([] if parent is None else [parent])
        while True:
            now = self._now()
            self._deliver(now)
            if self._bench.plugged:
                self._servo.plug()
            else:
                self._servo.unplug()
                self._replies.clear()
            watched = sources + list(self._clients)
            if self._servo.is_plugged:
                watched.append(self._servo)
            ready, _, _ = select.select(watched, [], [], self._rest())
            if parent in ready and not os.read(parent or 0, 64):
                return
            if self._servo in ready:
                self._hear()
            if self._control in ready:
                self._clients[self._control.accept()[0]] = b""
            for client in [each for each in ready if each in self._clients]:
                self._obey(client)

    def close(self) -> None:
        """Take ports and socket away."""
        self._servo.unplug()
        for port in (*self._cells, *([] if self._camera is None else [self._camera])):
            port.unplug()
        self._control.close()
        (self._folder / CONTROL).unlink(missing_ok=True)
        with suppress(OSError):  # it was ours alone, unless somebody put a file there
            self._folder.rmdir()

    def _now(self) -> float:
        """Return the bench's time [s]."""
        now = time.monotonic() - self._start
        if now - self._bench.time > LONGEST_LAG:
            self._start += now - self._bench.time
            now = self._bench.time
        return now

    def _rest(self) -> float:
        """Return how long nothing is due [s]; select is late by 60 us, less than USB's scatter."""
        if not self._replies:
            return KEEP_UP
        return max(0.0, min(KEEP_UP, self._replies[0][0] - self._now()))

    def _hear(self) -> None:
        """Take what the client has sent to the servo."""
        data = self._servo.read()
        if not data:
            return
        baud = self._servo.baud or 0
        for reply in self._bench.receive(data, self._now(), baud):
            self._sent += 1
            heapq.heappush(self._replies, (reply.due, self._sent, baud, reply.data))

    def _deliver(self, now: float) -> None:
        """Send what is due; a client that has changed its speed since would hear noise."""
        while self._replies and self._replies[0][0] <= now:
            _, _, baud, data = heapq.heappop(self._replies)
            if baud == self._servo.baud:
                self._servo.write(data)
        for place, cell in enumerate(self._cells):
            for line in self._bench.cell_lines(now, place):
                cell.write(line.data)
        if self._camera is not None:
            for line in self._bench.camera_lines(now):
                self._camera.write(line.data)

    def _obey(self, client: socket.socket) -> None:
        """Carry out one line from a client of the control socket and answer it."""
        data = b""
        with suppress(OSError):
            data = client.recv(65_536)
        if not data:
            del self._clients[client]
            client.close()
            return
        *lines, self._clients[client] = (self._clients[client] + data).split(b"\n")
        for line in lines:
            try:
                answer = self._command(json.loads(line))
            except (TendonNewtonError, ValueError, TypeError, KeyError) as error:
                answer = {"error": " ".join(str(error).split())}
            with suppress(OSError):
                client.sendall(json.dumps(answer).encode() + b"\n")

    def _command(self, words: dict[str, Any]) -> dict[str, Any]:
        """Carry out one command of the control channel."""
        bench = self._bench
        bench.advance(self._now())
        kind = words["command"]
        arguments: dict[str, Any] = words.get("arguments", {})
        if kind == "faults":
            bench.set_faults(replace(bench.faults, **arguments))
        elif kind == "event":
            arguments.setdefault("start", bench.time)
            bench.plan(FaultEvent(**arguments))
        elif kind == "obstacle":
            bench.set_obstacle(arguments["name"])
        elif kind == "mass":
            bench.hang_mass(arguments["mass"])
        elif kind == "ball":
            bench.put_ball_back()
        elif kind != "state":
            known = "faults, event, obstacle, mass, ball, state"
            return {"error": f"no command {kind!r}; known: {known}"}
        return asdict(bench.state())


def main() -> None:
    """Serve the bench that the arguments name."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bench", default="finger")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--load-cell-rate", type=int, default=80)
    parser.add_argument("--obstacle", default="free")
    parser.add_argument("--servo", default=XC330_T288_T.name)
    parser.add_argument("--worn", default=NEW)
    arguments = parser.parse_args()
    with suppress(PermissionError):  # a servo never waits for another program; ours may have to
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
    signal.signal(signal.SIGTERM, lambda _number, _frame: sys.exit(0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal's Ctrl-C is the parent's business
    bench = VirtualBench(
        worn(draw_unit(arguments.bench, arguments.seed, arguments.servo), arguments.worn),
        obstacle=arguments.obstacle,
        load_cell_rate=arguments.load_cell_rate,
        model=SERVO_MODELS[arguments.servo],
    )
    server = BenchServer(bench, arguments.folder)
    try:
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        server.serve(parent=sys.stdin.fileno())
    finally:
        server.close()
