"""Programs, keepers and cables that fail while a motor pulls: it must be without force soon.

Every verb that drives a motor runs in a process of its own, on the ports of a virtual bench that
outlives it, in real time. The bench's clock and its true duty are the judge.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Timer
from typing import Self

from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.servos.family import ServoFamily
from tendon_hardware.servos.host_position_loop import HostPositionLoop, no_stronger
from tendon_hardware.virtual_bench import FaultEvent, VirtualPorts
from tests.hardware.deploy.policies import Proportional, card_of, write_onnx
from tests.hardware.deploy.runs import calibration_files

START = 90.0  # Longest start of a program on a busy machine [s]
ATTEMPTS = 3
"""Runs before a busy machine is no excuse: it may stop any of them for 0.2 s, which is a rule."""
BUSY = (
    "must be mended before it is recorded", "no instruction came for", "has been silent for",
    "must answer to", "computer is too busy", "must not be older than",
    "must answer that its motor",
)  # fmt: skip
"""What a run says that such a machine has ended."""
ALLOWED = 0.25  # From the fault to a motor without force [s]
FORGOTTEN = 0.6
"""The same where nothing but the firmware of a servo without a watchdog ends its pull [s]."""
RESTING = 0.05  # Time without duty that is no rest of a driver that goes on [s]
STAYS = 2.5  # Time after a fault in which a motor must not pull again [s]
PLUGGED_AGAIN = 1.5  # Length of an interruption [s]
PULLING = 0.05  # Duty from which a motor pulls [1]
UP = b"\x1b[A"  # What the arrow key sends that winds in


@dataclass(frozen=True, kw_only=True)
class Driving:
    """A way to drive a motor."""

    words: tuple[str, ...]  # Verb and options besides ports and folder
    by_hand: bool = False  # Whether keys must be pressed for the motor to pull
    goes_on: bool = False  # Whether it goes on once its adapter is back, and says so
    # Whether the policy's card names the servo, and an answer is asked for as often as usual
    by_card: bool = False


WAYS: dict[str, Driving] = {
    "deploy": Driving(
        words=("deploy", "--policy", "{policy}", "--goals", "1.2", "--load-cell-rate", "80")
    ),
    "collect": Driving(
        words=("collect", "--excitation", "random_steps", "--duration", "60"), goes_on=True
    ),
    "evaluate-policy": Driving(words=("evaluate-policy", "{policy}"), by_card=True),
    "jog": Driving(words=("deploy", "--jog", "--load-cell-rate", "80"), by_hand=True),
}
"""Everything that drives a motor."""


@dataclass(kw_only=True)
class Program:
    """The program in a process of its own, at a terminal, on the ports of a bench."""

    ports: VirtualPorts
    way: Driving
    out: Path
    policy: Path
    servo: str = "xc330_t288_t"
    further: tuple[str, ...] = ()
    said: bytes = field(default=b"", init=False)  # What it has printed so far

    @property
    def pulling(self) -> float:
        """Duty from which the motor pulls, beyond what its firmware takes for a pull [1]."""
        least = 0.0 if (forgets := self.family.forgets) is None else 1.2 * forgets.duty
        loop = HostPositionLoop()
        share = no_stronger(loop, SERVOS[self.servo]).gain / loop.gain
        return max(share * PULLING, least)

    @property
    def family(self) -> ServoFamily:
        """Family of its servo."""
        return FAMILIES[SERVOS[self.servo].family]

    def __enter__(self) -> Self:
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
                *("--calibration", str(cell), "--out", str(self.out)),
                *(() if self.way.by_card else ("--servo", self.servo, "--retries", "8")),
            ],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
        )
        os.close(slave)
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        self.signal_keeper(signal.SIGCONT)
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
        while self.ports.state().duty < self.pulling:
            assert time.monotonic() - self.begin < START, self.said[-2000:]
            self.listen()
            if self.process.poll() is not None:
                return False
            if self.way.by_hand and b"\r" in self.said:
                os.write(self.terminal, UP)
            time.sleep(0.02)
        return True

    def kill(self) -> None:
        """Kill it without warning."""
        self.process.kill()

    def unplug(self) -> None:
        """Take the adapter away for a while."""
        self.ports.plan(FaultEvent(name="unplug", duration=PLUGGED_AGAIN))

    def signal_keeper(self, number: int) -> None:
        """Send a signal to the process that watches over the motor."""
        port = self.ports.servo_port.encode()
        for process in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                words = (process / "cmdline").read_bytes().split(b"\0")
                if port in words and any(b"keeper_process" in word for word in words):
                    os.kill(int(process.name), number)

    def interrupt(self) -> None:
        """Stop it for two seconds, as a debugger or a closed lid does."""
        self.process.send_signal(signal.SIGSTOP)
        Timer(2.0, self.process.send_signal, [signal.SIGCONT]).start()


@dataclass(frozen=True, kw_only=True)
class Harm:
    """What happens to a program that pulls."""

    act: Callable[[Program], None]
    allowed: float = ALLOWED  # Longest time to a motor without force [s]
    # Whether nothing but the firmware ends it where a servo has no watchdog
    forgotten: bool = False
    passes: bool = False  # Whether it is over before a program that waits for its adapter gives up
    kept: bool = False  # Whether it concerns a process that watches over a servo without a watchdog

    def limit(self, family: ServoFamily) -> float:
        """Return the longest time to a motor without force [s]."""
        return FORGOTTEN if self.forgotten and family.forgets is not None else self.allowed


def kill_both(program: Program) -> None:
    """Kill the program and what watches over it, as the end of a container does."""
    program.signal_keeper(signal.SIGKILL)
    program.kill()


def kill_unwatched(program: Program) -> None:
    """Stop what watches over a program, then kill the program."""
    program.signal_keeper(signal.SIGSTOP)
    program.kill()


def kill_unplugged(program: Program) -> None:
    """Unplug the adapter and kill the program."""
    program.unplug()
    program.kill()


HARMS: dict[str, Harm] = {
    "killed": Harm(act=Program.kill),
    "stopped for 2 s": Harm(act=Program.interrupt),
    "unplugged for 1.5 s": Harm(act=Program.unplug, forgotten=True, passes=True),
    "unplugged for 1.5 s and killed": Harm(act=kill_unplugged, forgotten=True),
    "killed with its keeper": Harm(act=kill_both, forgotten=True, kept=True),
    "killed, its keeper stopped": Harm(act=kill_unwatched, forgotten=True, kept=True),
    "robbed of its keeper": Harm(
        act=lambda program: program.signal_keeper(signal.SIGKILL), kept=True
    ),
    "robbed of its keeper's attention": Harm(
        act=lambda program: program.signal_keeper(signal.SIGSTOP), allowed=1.5, kept=True
    ),
}
"""Everything that happens to programs here."""


@dataclass(frozen=True, kw_only=True)
class Release:
    """How a motor came to be without force."""

    took: float  # Time from the fault to no duty [s]
    held: float  # Greatest tension meanwhile [N]


def let_go(program: Program, harm: Harm) -> Release:
    """Let something happen, and require a motor without force in time, which stays so."""
    ports, held = program.ports, []
    begin = ports.state().time
    harm.act(program)
    now, off = begin, None
    while off is None or now - off < RESTING:
        state = ports.state()
        now = state.time
        assert now - begin < 4.0, "it pulls on"
        if state.duty != 0.0:
            held.append(state.tension)
            off = None
        elif off is None:
            off = now
        time.sleep(0.002)
    took = off - begin
    while (state := ports.state()).time - begin < took + STAYS:
        back = harm.passes and program.way.goes_on
        assert state.duty <= 0.0 or back, f"it pulls again after {state.time - begin:.2f} s"
        program.listen()
        time.sleep(0.02)
    limit = harm.limit(program.family)
    assert took <= limit, f"{took:.3f} s, of {limit:g} s allowed"
    return Release(took=took, held=max(held, default=0.0))


def released(
    ports: VirtualPorts,
    way: Driving,
    harm: Harm,
    folder: Path,
    delay: float,
    servo: str = "xc330_t288_t",
) -> Release:
    """Let a program pull for a while [s] and something happen; return how the motor let go."""
    said = ""
    folder.mkdir(parents=True, exist_ok=True)
    policy = policy_file(folder, servo)
    for attempt in range(ATTEMPTS):
        out = folder / str(attempt)
        with Program(ports=ports, way=way, out=out, policy=policy, servo=servo) as program:
            if program.await_pull():
                time.sleep(delay)
                program.listen()
                if program.await_pull():  # a command has calm seconds as well
                    release = let_go(program, harm)
                    break
            said = program.end()
            assert any(word in said for word in BUSY), said[-2000:]
    else:
        raise AssertionError(f"the program did not pull {ATTEMPTS} times: {said[-2000:]}")
    switched = BusServo(SERVOS[servo], ports.servo_port, retries=8)
    switched.open()  # an alert that the harm has left would be the next program's
    switched.configure()
    assert switched.close()
    return release


def policy_file(folder: Path, servo: str = "xc330_t288_t") -> Path:
    """Write a policy that closes the finger."""
    return write_onnx(folder / "policy.onnx", Proportional(), card_of(servo=servo).to_json())
