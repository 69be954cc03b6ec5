"""Programs that are killed while their motor pulls: it must be without force a moment later.

Every verb that drives a motor runs in a process of its own, on the ports of a virtual bench that
outlives it, in real time. The bench's clock and its true duty are the judge.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from hardware.virtual_bench import VirtualPorts
from tests.hardware.deploy.policies import Proportional, card_of, write_onnx
from tests.hardware.deploy.runs import calibration_files

START = 90.0
"""Longest start of a program on a busy machine [s]."""
ATTEMPTS = 3
"""Runs before a busy machine is no excuse: it may stop any of them for 0.2 s, which is a rule."""
BUSY = (
    "no instruction came for",
    "has been silent for",
    "must answer to",
    "computer is too busy",
    "must not be older than",
    "must answer that its motor",
)
"""What a run says that such a machine has ended."""
ALLOWED = 0.25
"""From the kill to a motor without force [s]."""
PULLING = 0.05
"""Duty from which a motor pulls [1]."""
UP = b"\x1b[A"
"""What the arrow key sends that winds in."""


@dataclass(frozen=True, kw_only=True)
class Driving:
    """A way to drive a motor."""

    words: tuple[str, ...]
    """Verb and options besides ports and folder."""
    by_hand: bool = False
    """Whether keys must be pressed for the motor to pull."""


WAYS: dict[str, Driving] = {
    "deploy": Driving(
        words=("deploy", "--policy", "{policy}", "--goals", "1.2", "--load-cell-rate", "80")
    ),
    "collect": Driving(words=("collect", "--excitation", "contact_ramp", "--duration", "60")),
    "jog": Driving(words=("deploy", "--jog", "--load-cell-rate", "80"), by_hand=True),
}
"""Everything that drives a motor, and so every mode that there is."""


@dataclass(kw_only=True)
class Program:
    """The program in a process of its own, at a terminal, on the ports of a bench."""

    ports: VirtualPorts
    way: Driving
    out: Path
    policy: Path
    further: tuple[str, ...] = ()
    said: bytes = field(default=b"", init=False)
    """What it has printed so far."""

    def __enter__(self) -> Self:
        """Start it."""
        self.begin = time.monotonic()
        words = [word.format(policy=self.policy) for word in self.way.words]
        cell = calibration_files("finger", 80)[0]
        self.terminal, slave = os.openpty()
        os.set_blocking(self.terminal, False)
        os.write(self.terminal, b"\n")  # what it asks for is done
        self.process = subprocess.Popen(
            [
                *(sys.executable, "-m", "tendon_newton"),
                *words,
                *self.further,
                *("--port", self.ports.servo_port, "--load-cell-port", self.ports.load_cell_port),
                *("--calibration", str(cell), "--out", str(self.out), "--retries", "8"),
            ],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
        )
        os.close(slave)
        return self

    def __exit__(self, *_: object) -> None:
        """End it, if it still runs."""
        self.process.kill()
        self.process.wait()
        os.close(self.terminal)

    def listen(self) -> None:
        """Take what it has printed, so that it never waits for a reader."""
        try:
            while data := os.read(self.terminal, 65536):
                self.said += data
        except OSError:  # nothing more now, or the program has ended
            return

    def end(self) -> str:
        """Wait until it has ended and return all that it has printed."""
        deadline = time.monotonic() + START
        while self.process.poll() is None and time.monotonic() < deadline:
            self.listen()
            time.sleep(0.02)
        self.listen()
        return self.said.decode(errors="replace")

    def await_pull(self) -> bool:
        """Wait until the motor pulls; return whether it does, or the program has ended."""
        while self.ports.state().duty < PULLING:
            assert time.monotonic() - self.begin < START, self.said[-2000:]
            self.listen()
            if self.process.poll() is not None:
                return False
            if self.way.by_hand and b"\r" in self.said:
                os.write(self.terminal, UP)
            time.sleep(0.02)
        return True

    def kill(self) -> float:
        """Kill it without warning; return how long the motor ran on, on the bench's clock [s]."""
        begin = self.ports.state().time
        self.process.kill()
        self.process.wait()
        while (state := self.ports.state()).duty != 0.0 and state.time - begin < 2.0:
            time.sleep(0.002)
        return state.time - begin


def killed(ports: VirtualPorts, way: Driving, folder: Path, policy: Path, delay: float) -> float:
    """Let a program pull for a while [s], kill it, and return how long the motor pulled on [s]."""
    for attempt in range(ATTEMPTS):
        with Program(ports=ports, way=way, out=folder / str(attempt), policy=policy) as program:
            if program.await_pull():
                time.sleep(delay)
                program.listen()
                if program.process.poll() is None and ports.state().duty >= PULLING:
                    took = program.kill()
                    time.sleep(0.5)
                    assert ports.state().duty == 0.0, "it stays without force"
                    return took
            said = program.end()
            assert any(word in said for word in BUSY), said[-2000:]
    raise AssertionError(f"the program did not pull {ATTEMPTS} times: {said[-2000:]}")


def policy_file(folder: Path) -> Path:
    """Write a policy that closes the finger."""
    return write_onnx(folder / "policy.onnx", Proportional(), card_of().to_json())
