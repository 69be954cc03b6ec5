"""One servo bus: transactions that are tried again, counted, and never mistaken for one another."""

from collections.abc import Callable

from tendon_hardware.clock import Clock
from tendon_hardware.errors import ServoRefused, ServoSilent, SharedIdentifier
from tendon_hardware.servos.base import ServoCounters
from tendon_hardware.servos.family import ServoFamily
from tendon_hardware.servos.serial_bus.keeper import Keeper
from tendon_hardware.servos.serial_bus.packets import SILENT, SUCCESS, Answer, Packets, Register
from tendon_hardware.servos.serial_bus.servo_port import PortHandler, ServoPort

STATUS_LENGTH = 11  # Bytes of an answer without data, at most
SPARE = 64
"""Choices of the bytes that are asked for; the table goes on after all that is read, to 227."""
LATE_TIME = 0.5  # Time after which an answer will not come any more [s]
UNASKED_MAX = 5  # Answers that nobody asked for, less exchanges without one, that may be noise
BROKEN = "; broken answers come of noise on the line, or of two servos with one ID"
REFUSALS = {
    1: "could not process the instruction",
    2: "does not know the instruction",
    3: "received a broken instruction",
    4: "value out of range",
    5: "wrong length of data",
    6: "value beyond a limit that is set",
    7: "register cannot be written now",
}


class Bus:
    """Transactions with one servo.

    Answers carry no number, and a late one could be taken for the answer to the next question.
    Questions that are open at the same time ask for different lengths. A question asks for a few
    bytes more than needed, as long as an answer may be on its way.

    Args:
        port: Path of a serial port, or a port handler of the SDK's kind, which is not locked, or a
            port that other servos share.
        baud: Rate of the bus [1/s].
    """

    def __init__(
        self,
        port: str | PortHandler | ServoPort,
        *,
        family: ServoFamily,
        identifier: int,
        baud: int,
        clock: Clock,
        counters: ServoCounters,
        retries: int,
    ) -> None:
        self.identifier = identifier
        self.instant = 0.0  # Middle of the last transaction that succeeded [s]
        self.port = port if isinstance(port, ServoPort) else ServoPort(port, baud=baud)
        self.baud = self.port.baud  # Rate of the bus [1/s]
        self.table = family.table
        self._family = family
        self._packets: Packets = family.packets(self.port.handler)
        self._clock = clock
        self._counters = counters
        self._retries = retries
        # Lengths of answers that may still come, and until when [s]
        self._late: dict[int, float] = {}
        self._retried = True
        self._unasked = 0

    def keeper(self, patience: float) -> Keeper | None:
        """Start what switches the motor off after a silence [s], where the servo itself does not.

        Nothing watches over a simulated bus.
        """
        path, port, lock = self.port.path, self.port.descriptor, self.port.lock_descriptor
        if self._family.motor_off is None or path is None or port is None or lock is None:
            return None
        packet = self._family.motor_off(self.identifier)
        return Keeper(path, baud=self.baud, port=port, lock=lock, patience=patience, packet=packet)

    def read(self, *registers: Register) -> tuple[int, ...]:
        """Read registers in one transaction, with all that stands between them.

        Raises:
            ServoSilent: No whole answer came.
            ServoRefused: The servo answered with an error.
            PortLost: The adapter is gone.
        """
        start = min(register.address for register in registers)
        length = max(register.address + register.size for register in registers) - start

        def ask(asked: int) -> int:
            return self._packets.read(self.identifier, self._first(start, asked), asked)

        data = self._exchange(f"read {registers[0].name}", ask, length, most=self.table.end)
        first = self._first(start, len(data))
        return tuple(
            r.decode(data[r.address - first : r.address - first + r.size]) for r in registers
        )

    def _first(self, start: int, length: int) -> int:
        """Return where a read of so many bytes begins: earlier where the table would end first."""
        return min(start, self.table.end - length)

    def write(self, register: Register, counts: int) -> None:
        """Write a register and wait for the answer, which tells alerts and refusals.

        The answer may be that to an earlier write; what matters is read back.
        """
        data = register.encode(counts)
        self._exchange(
            f"write {counts} to {register.name}",
            lambda _: self._packets.write(self.identifier, register.address, data),
            0,
        )

    def write_unanswered(self, register: Register, counts: int) -> None:
        """Write a register of a servo that answers nothing but a ping."""
        data = register.encode(counts)
        self.port.guard(lambda: self._packets.write(self.identifier, register.address, data))

    def ping(self) -> int:
        """Return the model number of the servo."""
        length = self._packets.ping_length
        data = self._exchange("ping", lambda _: self._packets.ping(self.identifier), length)
        if not data:
            return self.read(self.table.model)[0]
        return self.table.model.decode(data[: self.table.model.size])

    def find_all(self) -> dict[int, int]:
        """Return the model numbers of all servos at this rate, by ID; takes 0.8 s."""
        return self.port.guard(self._packets.find_all)

    def reboot(self) -> None:
        """Restart the servo; its answer may be lost in the restart."""
        self.port.guard(lambda: self._packets.restart(self.identifier))

    def _exchange(
        self, what: str, send: Callable[[int], int], length: int, *, most: int | None = None
    ) -> bytes:
        """Send an instruction until one of the attempts is answered.

        Args:
            send: Sends it, given the bytes of data to ask for; returns the SDK's result.
            length: Bytes of data that the answer has at least.
            most: Bytes that may be asked for; None where the answer cannot have more.
        """
        sent: dict[int, float] = {}
        silent = 0
        self._unasked = self._unasked + 1 if self.unasked() else max(self._unasked - 1, 0)
        for attempt in range(1 + self._retries):
            self._counters.retries += attempt > 0
            asked = length if most is None else self._unambiguous(length, most)
            if asked is not None:
                sent[asked] = self._clock.now()
                self._late[asked] = sent[asked] + LATE_TIME
            result, answer = self.port.guard(
                lambda asked=asked: self._await(SUCCESS if asked is None else send(asked), sent)
            )
            self._retried = attempt > 0
            if answer is not None:
                now = self._clock.now()
                self.instant = 0.5 * (sent.get(len(answer.data), now) + now)
                self._refuse(what, answer)
                return answer.data
            if result == SILENT:
                silent += 1
                self._counters.silent += 1
            else:
                self._counters.corrupted += 1  # of which question is not known: it stays open
        attempts = 1 + self._retries
        raise ServoSilent(
            f"servo {self.identifier} on {self.port.name} must answer to {what} at {self.baud} "
            f"baud; {attempts} attempts gave {silent} times nothing and "
            f"{attempts - silent} times a broken answer{BROKEN if silent < attempts else ''}"
        )

    def unasked(self) -> bool:
        """Tell whether an answer lies there that nobody asked for, where that can be told.

        After an instruction that was sent again the answer to the first one may come late.
        """
        now = self._clock.now()
        if self._retried or any(until > now for until in self._late.values()):
            return False
        return bool(self.port.guard(self.port.handler.getBytesAvailable))

    def refuse_second(self, most: int = UNASKED_MAX) -> None:
        """Refuse to go on with a servo that answers more often than it was asked.

        Whoever switches a motor off does not look: that must be tried whatever answers.

        Args:
            most: Answers that nobody asked for, less exchanges without one, that are put up with.

        Raises:
            SharedIdentifier: Another servo has the same ID.
        """
        if self._unasked <= most:
            return
        raise SharedIdentifier(
            f"each servo on a bus must have its own ID; two answer as {self.identifier} on "
            f"{self.port.name}: plug in one at a time and give it another, `tendon-newton doctor "
            "--port ... --set-id`"
        )

    def _unambiguous(self, length: int, most: int) -> int | None:
        """Choose how many bytes to ask for, so that no answer on its way has as many.

        Where there are too many on their way, nothing may be asked until they have come or are
        given up: there is only listening.
        """
        now = self._clock.now()
        self._late = {asked: until for asked, until in self._late.items() if until > now}
        choices = range(length, min(length + SPARE, most + 1))
        spare = [asked for asked in choices if asked not in self._late]
        return spare[0] if spare else None

    def _await(self, result: int, sent: dict[int, float]) -> tuple[int, Answer | None]:
        """Receive until there is an answer of a length that was asked for, or none comes."""
        self.port.handler.setPacketTimeout(STATUS_LENGTH + max(sent, default=0))
        while result == SUCCESS:
            answer, result = self._packets.receive()
            if answer is None:
                break
            if answer.identifier != self.identifier:
                continue
            self._late.pop(len(answer.data), None)
            if answer.refusal or len(answer.data) in sent:
                return SUCCESS, answer
        return result, None

    def _refuse(self, what: str, answer: Answer) -> None:
        self._counters.alerts += answer.alert
        refusal = answer.refusal
        if refusal:
            raise ServoRefused(
                f"servo {self.identifier} on {self.port.name} refused to {what}: "
                f"{REFUSALS.get(refusal, f'error {refusal}')}"
            )
