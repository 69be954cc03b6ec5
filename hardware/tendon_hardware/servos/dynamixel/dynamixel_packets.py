"""Instructions and answers of Dynamixel Protocol 2.0, by the vendor's SDK.

The SDK's own reads cut any answer of the servo to the length that was asked for, so that a late
answer is taken for the answer to the next question. Hence packets are sent and received one by one.
"""

from tendon_hardware.servos.serial_bus.packets import SUCCESS, Answer
from tendon_hardware.servos.serial_bus.servo_port import PortHandler, sdk

PING = 1
ALERT_BIT = 0x80


class DynamixelPackets:
    """Protocol 2.0 on a port."""

    ping_length = 3

    def __init__(self, port: PortHandler) -> None:
        self._port = port
        self._packets = sdk().PacketHandler(2.0)

    def ping(self, identifier: int) -> int:
        """Ask whether a servo is there."""
        packet = [0, 0, 0, 0, identifier, 3, 0, PING, 0, 0]  # the SDK fills in the rest
        return int(self._packets.txPacket(self._port, packet))

    def read(self, identifier: int, address: int, length: int) -> int:
        """Ask for bytes."""
        return int(self._packets.readTx(self._port, identifier, address, length))

    def write(self, identifier: int, address: int, data: bytes) -> int:
        """Write bytes."""
        result = self._packets.writeTxOnly(self._port, identifier, address, len(data), list(data))
        return int(result)

    def receive(self) -> tuple[Answer | None, int]:
        """Wait for one answer."""
        packet, result = self._packets.rxPacket(self._port, False)
        if result != SUCCESS:
            return None, int(result)
        length = (packet[5] | packet[6] << 8) - 4  # without instruction, error and CRC
        answer = Answer(
            identifier=packet[4],
            data=bytes(packet[9 : 9 + max(length, 0)]),
            alert=bool(packet[8] & ALERT_BIT),
            refusal=packet[8] & ~ALERT_BIT,
        )
        return answer, SUCCESS

    def find_all(self) -> dict[int, int]:
        """Return the model numbers of all servos at this rate, by ID; takes 0.8 s."""
        found, _ = self._packets.broadcastPing(self._port)
        return {int(identifier): int(row[0]) for identifier, row in found.items()}

    def restart(self, identifier: int) -> None:
        """Restart a servo; its answer may be lost in the restart."""
        self._packets.reboot(self._port, identifier)
