"""Instructions and answers of Feetech's protocol, in our own few lines.

A frame is FF FF, ID, length, instruction or error, parameters and the inverted sum of all behind
FF FF. Source: Feetech, communication protocol of its SCS, STS and SMS servos.

The packages on the index are copies of the vendor's samples without a maintainer. One of them,
feetech-servo-sdk 1.0.0, reckons its waits in the wrong unit, and both install the module
`scservo_sdk`. A protocol of three instructions needs neither.
"""

from tendon_hardware.errors import ServoRefused
from tendon_hardware.servos.feetech.feetech_registers import MODEL_NUMBER, TORQUE_ENABLE
from tendon_hardware.servos.serial_bus.packets import BROKEN, SILENT, SUCCESS, Answer
from tendon_hardware.servos.serial_bus.servo_port import PortHandler

HEADER = b"\xff\xff"
PING, READ, WRITE = 1, 2, 3
BROADCAST = 0xFE
SHORTEST, LONGEST = 2, 250  # Lengths that a frame can state: what follows it, with the sum
FIND_TIME = 800.0
"""Time in which every servo has answered a ping for all [ms]: each waits for those before it."""
FIND_ATTEMPTS = 20  # Reads of a model, as many as the doctor affords: a busy computer answers late


def checksum(body: bytes) -> int:
    """Return the check sum of a frame from its ID on."""
    return ~sum(body) & 0xFF


def frame(identifier: int, code: int, parameters: bytes = b"") -> bytes:
    """Build a frame: an instruction, or an answer with its error."""
    body = bytes([identifier, len(parameters) + 2, code]) + parameters
    return HEADER + body + bytes([checksum(body)])


def motor_off(identifier: int) -> bytes:
    """Build the instruction that switches a servo's motor off."""
    return frame(identifier, WRITE, bytes([TORQUE_ENABLE.address, 0]))


class FeetechPackets:
    """Feetech's protocol on a port."""

    ping_length = 0

    def __init__(self, port: PortHandler) -> None:
        self._port = port
        self._received = bytearray()

    def ping(self, identifier: int) -> int:
        """Ask whether a servo is there."""
        return self._send(frame(identifier, PING))

    def read(self, identifier: int, address: int, length: int) -> int:
        """Ask for bytes."""
        return self._send(frame(identifier, READ, bytes([address, length])))

    def write(self, identifier: int, address: int, data: bytes) -> int:
        """Write bytes."""
        return self._send(frame(identifier, WRITE, bytes([address]) + data))

    def receive(self) -> tuple[Answer | None, int]:
        """Wait for one answer; its error tells what has happened to the servo."""
        while True:
            packet = self._next_packet()
            if packet is not None:
                if checksum(packet[2:-1]) != packet[-1]:
                    return None, BROKEN
                answer = Answer(identifier=packet[2], data=packet[5:-1], alert=packet[4] != 0)
                return answer, SUCCESS
            if self._port.isPacketTimeout():
                result = BROKEN if self._received else SILENT
                self._received.clear()
                return None, result
            self._received += bytes(self._port.readPort(LONGEST))

    def find_all(self) -> dict[int, int]:
        """Return the model numbers of all servos at this rate, by ID; takes 0.8 s."""
        self._send(frame(BROADCAST, PING))
        self._port.setPacketTimeoutMillis(FIND_TIME)
        identifiers: list[int] = []
        while True:
            answer, result = self.receive()
            if result == SILENT:
                break
            if answer is not None and not answer.data:
                identifiers.append(answer.identifier)
        models = {identifier: self._model(identifier) for identifier in identifiers}
        return {identifier: model for identifier, model in models.items() if model is not None}

    def restart(self, identifier: int) -> None:
        """Refuse: the protocol has no such instruction."""
        raise ServoRefused(
            f"servo {identifier} cannot be restarted over the bus, as no Feetech servo can; "
            "switch its supply off and on"
        )

    def _model(self, identifier: int) -> int | None:
        for _ in range(FIND_ATTEMPTS):
            self.read(identifier, MODEL_NUMBER.address, MODEL_NUMBER.size)
            self._port.setPacketTimeout(len(frame(identifier, 0)) + MODEL_NUMBER.size)
            answer, _ = self.receive()
            if answer is not None and len(answer.data) == MODEL_NUMBER.size:
                return MODEL_NUMBER.decode(answer.data)
        return None

    def _send(self, packet: bytes) -> int:
        """Send a frame; what came before it and was not read is gone."""
        self._received.clear()
        self._port.clearPort()
        return SUCCESS if self._port.writePort(packet) == len(packet) else SILENT

    def _next_packet(self) -> bytes | None:
        """Take the first whole frame out of what was received, and all that is none before it."""
        stream = self._received
        while True:
            start = stream.find(HEADER)
            if start < 0:
                del stream[: max(0, len(stream) - 1)]
                return None
            del stream[:start]
            if len(stream) < 4:
                return None
            if stream[2] < BROADCAST and SHORTEST <= stream[3] <= LONGEST:
                break
            del stream[:1]  # no frame begins so: FF FF FF is a header behind a byte of noise
        end = 4 + stream[3]
        if len(stream) < end:
            return None
        packet = bytes(stream[:end])
        del stream[:end]
        return packet
