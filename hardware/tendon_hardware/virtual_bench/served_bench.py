"""A virtual bench with its two wires: bytes in, bytes out, and faults on the way."""

import random
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace

from tendon_hardware.virtual_bench.emulation.emulations import AnyEmulator, AnyModel
from tendon_hardware.virtual_bench.emulation.firmware import TICK
from tendon_hardware.virtual_bench.emulation.plant import DriveLine, Plant, PlantState
from tendon_hardware.virtual_bench.faults import ALERT_BITS, FaultEvent, Faults
from tendon_hardware.virtual_bench.memory.control_table import XC330_T288_T
from tendon_hardware.virtual_bench.physics.load_cell import BANNER
from tendon_hardware.virtual_bench.physics.obstacle import BenchObstacle, grips
from tendon_hardware.virtual_bench.physics.unit import BenchUnit

USB_LATENCY = 0.5e-3
"""From the servo's last bit to the host's first byte [s]: an FTDI whose latency timer is 1 ms."""
CELL_LATENCY = 1.2e-3  # From the end of a conversion to the host [s]: line time at 115200 and USB
CELL_JITTER = 0.6e-3  # Mean of what USB adds to that [s]
BROWNOUT = 4.5  # Supply below which the servo's processor restarts [V]; assumed


@dataclass(frozen=True, kw_only=True, slots=True)
class Reply:
    """Bytes for the host and the instant at which they arrive [s]."""

    due: float
    data: bytes


class VirtualBench:
    """Servos, load cells and plant on one clock that starts at zero.

    Args:
        unit: Its constants, such as those that `draw_unit` draws.
        obstacle: Obstacle in the mechanism's way: ``free``, ``tape_roll``, ``hand`` or
            ``hand_perturbation``.
        load_cell_rate: Lines per second: 80, 20 or 10 [Hz].
        model: Its servos, of the kind for which the unit was drawn.
        still: Whether nothing gives line, as while masses hang on the load cells.
    """

    def __init__(
        self,
        unit: BenchUnit,
        *,
        faults: Faults | None = None,
        obstacle: str = "free",
        load_cell_rate: int = 80,
        model: AnyModel = XC330_T288_T,
        still: bool = False,
    ) -> None:
        self.unit = unit
        self.plant = Plant(unit, model=model, load_cell_rate=load_cell_rate, still=still)
        self.servos = tuple(
            emulator_of(line, unit.seed, place) for place, line in enumerate(self.plant.lines)
        )
        """All servos on the bus; their IDs count from 1."""
        self.servo = self.servos[0]
        self._random = random.Random(f"bench {unit.seed}")
        self._parser = self.plant.lines[0].family.parser()
        self._cells = tuple(deque([Reply(due=0.0, data=BANNER)]) for _ in self.servos)
        self._frames: deque[Reply] = deque()
        self._faults = Faults()
        self._events: list[FaultEvent] = []
        self._unplugged_until = self._dip_until = 0.0
        self._silent_until = [0.0 for _ in self.servos]
        self.set_faults(faults or Faults())
        self.set_obstacle(obstacle)

    @property
    def time(self) -> float:
        """The bench's clock [s]."""
        return self.plant.time

    @property
    def plugged(self) -> bool:
        """Whether the servo's adapter is in its socket."""
        return self.time >= self._unplugged_until

    @property
    def unplugged_until(self) -> float:
        """When the adapter comes back [s]."""
        return self._unplugged_until

    @property
    def faults(self) -> Faults:
        """What goes wrong by chance."""
        return self._faults

    def set_faults(self, faults: Faults) -> None:
        """Take other chances, and plan the events besides those already planned."""
        self._faults = replace(faults, events=())
        for event in faults.events:
            self.plan(event)

    def plan(self, event: FaultEvent) -> None:
        """Plan one mishap."""
        self._events.append(event)
        self._events.sort(key=lambda each: each.start)

    def set_obstacle(self, name: str) -> None:
        """Put something in the mechanism's way from now on."""
        stays = grips(name, self.unit.seed)
        now = self.time
        later = tuple(
            replace(stay, start=stay.start + now if stay.start else 0.0, end=stay.end + now)
            for stay in stays
        )
        self.plant.obstacle = BenchObstacle(later)

    def hang_mass(self, mass: float | None) -> None:
        """Hang a mass [kg] on each load cell; ``None`` hooks the tendons in again."""
        for line in self.plant.lines:
            line.load_cell.mass = mass

    def put_ball_back(self) -> None:
        """Lay the ball where it starts, as a hand would; without a ball nothing happens."""
        self.plant.put_ball_back()

    def state(self) -> PlantState:
        """Return what is true now."""
        return self.plant.state()

    def advance(self, time: float) -> None:
        """Let everything happen up to an instant [s]."""
        plant = self.plant
        while (plant.ticks + 1) * TICK <= time + 1e-9:  # rounding of the instant
            lines = plant.tick()
            if self._events or self._dip_until:
                self._happen(plant.time)
            for place, line in enumerate(lines):
                if line:
                    self._cells[place].extend(self._sent(place, line, plant.time))
            if plant.camera is not None and (frame := plant.look()):
                due = plant.time + plant.camera.delay
                self._frames.append(Reply(due=due, data=frame))

    def _sent(self, place: int, line: bytes, time: float) -> Iterable[Reply]:
        """Return a load cell's line on its way to the host, unless it is lost."""
        faults, rng, cell = self._faults, self._random, self._cells[place]
        if time < self._silent_until[place] or rng.random() < faults.lost_lines:
            return ()
        if rng.random() < faults.garbled_lines:
            line = changed(line, rng)
        due = time + CELL_LATENCY + rng.expovariate(1.0 / CELL_JITTER)
        if cell:  # one wire: lines never overtake each other
            due = max(due, cell[-1].due)
        return (Reply(due=due, data=line),)

    def receive(self, data: bytes, time: float, baud: int | None = None) -> list[Reply]:
        """Take bytes from the host and return the servos' answers.

        Args:
            time: When their last one reached the servo [s].
            baud: Speed at which they were sent; at another than the servo's own they are noise.
        """
        self.advance(time)
        listening = [
            (servo, line)
            for servo, line in zip(self.servos, self.plant.lines, strict=True)
            if baud is None or baud == servo.baud
        ]
        if not self.plugged or not listening:
            return []
        replies: list[Reply] = []
        due = time
        for instruction in self._parser.feed(data):
            for servo, line in listening:  # of one instruction for all, one after the other
                answer = servo.answer(instruction, self.time, line.encoder.count)
                if not answer:
                    continue
                answer = self._on_the_line(answer)
                due += servo.return_delay + 10.0 / servo.baud * len(answer)
                if answer:
                    late = USB_LATENCY + self._faults.extra_latency
                    replies.append(Reply(due=due + late, data=answer))
                    if self._strikes(self._faults.doubled_replies):
                        due += 10.0 / servo.baud * len(answer)
                        replies.append(Reply(due=due + late, data=answer))
        return replies

    def _strikes(self, chance: float) -> bool:
        """Draw, where there is a chance at all: what else is drawn stays as it was without it."""
        return chance > 0.0 and self._random.random() < chance

    def _on_the_line(self, answer: bytes) -> bytes:
        """Return an answer as it arrives, empty where it is dropped."""
        faults, rng = self._faults, self._random
        if rng.random() < faults.dropped_replies:
            return b""
        if rng.random() < faults.corrupted_replies:
            answer = changed(answer, rng)
        if rng.random() < faults.line_noise:
            answer = rng.randbytes(rng.randint(1, 6)) + answer
        return answer

    def cell_lines(self, time: float, place: int = 0) -> list[Reply]:
        """Return what a load cell's board has sent up to an instant [s], line by line."""
        self.advance(time)
        return come(self._cells[place], time)

    def camera_lines(self, time: float) -> list[Reply]:
        """Return what the camera's program has sent up to an instant [s], line by line."""
        self.advance(time)
        return come(self._frames, time)

    def _happen(self, time: float) -> None:
        """Let the events that are due happen."""
        if self._dip_until and time >= self._dip_until:
            self._dip_until = 0.0
            for servo, line in zip(self.servos, self.plant.lines, strict=True):
                if line.motor.supply < BROWNOUT:
                    servo.restart(time, line.encoder.count)
                line.motor.supply = line.constants.servo.supply_voltage
        while self._events and self._events[0].start <= time:
            event = self._events.pop(0)
            end = time + event.duration
            place = min(event.servo, len(self.servos) - 1)
            servo, line = self.servos[place], self.plant.lines[place]
            if event.name == "unplug":
                self._unplugged_until = end
                self._parser.reset()
            elif event.name == "cell_silence":
                self._silent_until[place] = end
            elif event.name.startswith("cell"):
                line.load_cell.disturb(event.name, end, event.counts)
            elif event.name == "alert":
                bits = line.registers.model.alert_bits or ALERT_BITS
                line.registers.raise_error(bits[event.alert])
            elif event.name == "reboot":
                servo.restart(time, line.encoder.count)
            else:
                self._sag(event.voltage, end)

    def _sag(self, voltage: float, end: float) -> None:
        """Let the supply of all servos sag to a voltage [V] until an instant [s]."""
        self._dip_until = end
        for servo, line in zip(self.servos, self.plant.lines, strict=True):
            line.motor.supply = voltage
            if voltage < BROWNOUT:
                servo.restart(end, line.encoder.count)


def emulator_of(line: DriveLine, seed: int, place: int) -> AnyEmulator:
    """Return a servo on the bus; its noise is its own."""
    line.family.set_up(line.registers, place + 1)
    rng = random.Random(f"servo sensors {seed} {place}" if place else f"servo sensors {seed}")
    constants = line.constants.servo
    return line.family.emulator(line.registers, line.firmware, line.motor, constants, rng)


def come(sent: deque[Reply], time: float) -> list[Reply]:
    """Take out what has come by an instant [s]."""
    lines: list[Reply] = []
    while sent and sent[0].due <= time:
        lines.append(sent.popleft())
    return lines


def changed(data: bytes, rng: random.Random) -> bytes:
    """Return bytes with one bit of one of them flipped."""
    broken = bytearray(data)
    broken[rng.randrange(len(broken))] ^= 1 << rng.randrange(8)
    return bytes(broken)
