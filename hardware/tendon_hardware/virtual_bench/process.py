"""Start a virtual bench as a process: ports for the driver, a control channel for faults."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import tempfile
from dataclasses import fields
from pathlib import Path
from typing import Any

from tendon_hardware.virtual_bench.emulation.emulations import SERVO_MODELS
from tendon_hardware.virtual_bench.emulation.plant import PlantState
from tendon_hardware.virtual_bench.emulation.truth import write_plant_file
from tendon_hardware.virtual_bench.faults import FaultEvent, Faults
from tendon_hardware.virtual_bench.lockstep import LockstepBench
from tendon_hardware.virtual_bench.memory.control_table import XC330_T288_T
from tendon_hardware.virtual_bench.physics.unit import BENCHES, draw_unit
from tendon_hardware.virtual_bench.physics.wear import NEW, WEARS, worn
from tendon_hardware.virtual_bench.server import CAMERA, CONTROL, SERVO, load_cell_name
from tendon_newton.errors import TendonNewtonError, listed, look_up
from tendon_newton.safe_path import python_command

WORD = "virtual"  # First part of the word that names a virtual bench in place of a port
DEFAULT_BENCH = "finger"
STOP_TIME = 5.0  # Time that a bench may take to end [s]


class InvalidVirtualBench(TendonNewtonError):
    """The word for a virtual bench means none, or the bench did not start or answer."""


def parse_word(word: str) -> tuple[str, int]:
    """Return bench and seed of ``virtual``, ``virtual:finger`` or ``virtual:finger:3``.

    Raises:
        InvalidVirtualBench: The word has another form.
        UnknownName: No such bench.
    """
    parts = word.split(":")
    if parts[0] != WORD or len(parts) > 4:
        raise InvalidVirtualBench(
            "A virtual bench is named virtual, virtual:BENCH, virtual:BENCH:SEED or "
            f"virtual:BENCH:SEED:WEAR; got {word!r}"
        )
    bench = parts[1] if len(parts) > 1 and parts[1] else DEFAULT_BENCH
    look_up("virtual bench", bench, BENCHES)
    seed = parts[2] if len(parts) > 2 else "0"
    if not seed.isdecimal():
        raise InvalidVirtualBench(f"The seed of a virtual bench is a whole number; got {seed!r}")
    parse_wear(word)
    return bench, int(seed)


def parse_wear(word: str) -> str:
    """Return what is worn of the bench that a word names: ``virtual:finger:3:friction``.

    Raises:
        InvalidVirtualBench: No such wear; the message lists the known ones.
    """
    wear = word.split(":")[3:4]
    if wear and wear[0] not in WEARS:
        raise InvalidVirtualBench(
            f"A virtual bench is worn in one of the ways {listed(WEARS)}; got {word!r}"
        )
    return wear[0] if wear else NEW


def lockstep_of(word: str, servo: str = XC330_T288_T.name) -> LockstepBench:
    """Return the bench of a word such as ``virtual:finger:3:friction``, as fast as its user."""
    bench, seed = parse_word(word)
    unit = worn(draw_unit(bench, seed, servo), parse_wear(word))
    return LockstepBench(unit, model=SERVO_MODELS[servo])


class VirtualPorts:
    """A running virtual bench: use it as a context manager, or close it.

    Args:
        bench: ``spring_weak``, ``spring_strong``, ``finger``, ``finger_antagonist``, ``hand`` or
            ``hand_ball``.
        load_cell_rate: Lines per second: 80, 20 or 10 [Hz].
        wear: What use has done to it: ``new``, ``friction``, ``spool`` or ``planted``.
    """

    def __init__(
        self,
        bench: str = DEFAULT_BENCH,
        seed: int = 0,
        *,
        obstacle: str = "free",
        load_cell_rate: int = 80,
        servo: str = XC330_T288_T.name,
        wear: str = NEW,
    ) -> None:
        self._unit = worn(draw_unit(bench, seed, servo), wear)
        self.folder = Path(tempfile.mkdtemp(prefix="virtual_bench_"))
        self._process = subprocess.Popen(
            python_command(
                *("-m", "tendon_hardware.virtual_bench"),
                *("--bench", bench, "--seed", str(seed), "--folder", str(self.folder)),
                *("--obstacle", obstacle, "--load-cell-rate", str(load_cell_rate)),
                *("--servo", servo, "--worn", wear),
            ),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        assert self._process.stdout is not None
        if self._process.stdout.readline() != b"ready\n":
            _, said = self._process.communicate()
            shutil.rmtree(self.folder, ignore_errors=True)
            last = said.decode(errors="replace").strip().split("\n")[-1]
            raise InvalidVirtualBench(f"The virtual bench {bench}:{seed} did not start: {last}")
        self._control = socket.socket(socket.AF_UNIX)
        self._control.connect(str(self.folder / CONTROL))
        self._answers = self._control.makefile("rb")

    @property
    def servo_port(self) -> str:
        """Path of the servo's serial port; gone while it is unplugged."""
        return str(self.folder / SERVO)

    @property
    def load_cell_port(self) -> str:
        """Path of the load cell's serial port; of several, the first one's."""
        return self.load_cell_ports[0]

    @property
    def load_cell_ports(self) -> tuple[str, ...]:
        """Paths of all load cells' serial ports, in the order of the tendons."""
        count = len(self._unit.lines)
        return tuple(str(self.folder / load_cell_name(place)) for place in range(count))

    @property
    def camera_port(self) -> str:
        """Path of the port of the camera that sees the ball, where there is one."""
        return str(self.folder / CAMERA)

    @property
    def process_id(self) -> int:
        """Number of the process that emulates."""
        return self._process.pid

    def __enter__(self) -> VirtualPorts:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the bench; more than once does no harm."""
        if self._process.stdin is None or self._process.stdin.closed:
            return
        self._answers.close()
        self._control.close()
        self._process.stdin.close()
        try:
            self._process.wait(STOP_TIME)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for stream in (self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def set_faults(self, faults: Faults) -> None:
        """Let other things go wrong from now on, and plan the events."""
        chances = {
            each.name: getattr(faults, each.name)
            for each in fields(faults)
            if each.name != "events"
        }
        self._ask("faults", **chances)
        for event in faults.events:
            self.plan(event)

    def plan(self, event: FaultEvent) -> None:
        """Plan one mishap; a start of zero means now."""
        arguments = {each.name: getattr(event, each.name) for each in fields(event)}
        if not event.start:
            del arguments["start"]
        self._ask("event", **arguments)

    def set_obstacle(self, name: str) -> None:
        """Put something in the mechanism's way from now on."""
        self._ask("obstacle", name=name)

    def hang_mass(self, mass: float | None) -> None:
        """Hang a mass [kg] on the load cell; ``None`` hooks the tendon in again."""
        self._ask("mass", mass=mass)

    def put_ball_back(self) -> None:
        """Lay a hand's ball where it starts."""
        self._ask("ball")

    def state(self) -> PlantState:
        """Return what is true now."""
        answer = self._ask("state")
        for key in ("tip", "joints", "ball"):
            if answer[key] is not None:
                answer[key] = tuple(answer[key])
        return PlantState(**answer)

    def plant_file(self, path: Path) -> None:
        """Write every constant of this unit, and the effects that they amount to, as TOML."""
        write_plant_file(path, self._unit)

    def _ask(self, command: str, **arguments: Any) -> dict[str, Any]:
        """Send one command over the control channel and return its answer."""
        try:
            line = json.dumps({"command": command, "arguments": arguments})
            self._control.sendall(line.encode() + b"\n")
            answer = json.loads(self._answers.readline())
        except (OSError, ValueError) as error:
            raise InvalidVirtualBench(
                f"The virtual bench (process {self._process.pid}) does not answer"
            ) from error
        if "error" in answer:
            raise InvalidVirtualBench(f"The virtual bench refused: {answer['error']}")
        return answer


def open_virtual(word: str) -> VirtualPorts:
    """Start the bench that a word names: ``virtual``, ``virtual:finger:3:friction``.

    Raises:
        InvalidVirtualBench: The word has another form, or the bench did not start.
        UnknownName: No such bench.
    """
    bench, seed = parse_word(word)
    return VirtualPorts(bench, seed, wear=parse_wear(word))
