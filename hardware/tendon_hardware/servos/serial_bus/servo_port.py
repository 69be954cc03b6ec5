"""The port of a servo bus: locked, quick, and usable again after an unplugged adapter.

Built on the classic API of dynamixel_sdk, whose port serves any protocol. The "Easy" API turns
every alert into a ValueError, and its fast sync read takes stuffed bytes for data; with one servo a
plain read is as fast. Two defects of it shape this file. An unplugged adapter raises termios.error,
which is no OSError, and leaves the port marked as in use for ever, as an interrupt does. And the
time that it waits for an answer counts the adapter's latency twice: 36 ms unless told that ours is
1 ms.
"""

import contextlib
import os
from collections.abc import Callable
from typing import Any, Protocol, cast

from tendon_hardware.errors import PortLost, PortUnavailable
from tendon_hardware.serial_ports import LOST, PortLock, reason

LATENCY = 1  # Latency timer that the SDK is told [ms]; the adapter's must be set to it as well


class PortHandler(Protocol):
    """What the SDK asks of a port; its own is one, a simulated bus may be another."""

    is_using: bool

    def clearPort(self) -> None: ...  # noqa: N802, D102
    def closePort(self) -> None: ...  # noqa: N802, D102
    def getBytesAvailable(self) -> int: ...  # noqa: N802, D102
    def isPacketTimeout(self) -> bool: ...  # noqa: N802, D102
    def readPort(self, length: int) -> bytes: ...  # noqa: N802, D102
    def setBaudRate(self, baudrate: int) -> bool: ...  # noqa: N802, D102
    def setPacketTimeout(self, packet_length: int) -> None: ...  # noqa: N802, D102
    def setPacketTimeoutMillis(self, msec: float) -> None: ...  # noqa: N802, D102
    def writePort(self, packet: bytes) -> int: ...  # noqa: N802, D102


def sdk() -> Any:
    """Load the SDK and tell it the latency of the adapter, which it keeps for all ports."""
    import dynamixel_sdk  # pyright: ignore[reportMissingTypeStubs]
    from dynamixel_sdk import port_handler  # pyright: ignore[reportMissingTypeStubs]

    port_handler.LATENCY_TIMER = LATENCY
    return dynamixel_sdk


class ServoPort:
    """A port that is locked, opened, and found open again by the next transaction whatever happens.

    Args:
        port: Path of a serial port, or a port handler of the SDK's kind, which is not locked.
        baud: Rate of the bus [1/s].
    """

    def __init__(self, port: str | PortHandler, *, baud: int) -> None:
        self.path = port if isinstance(port, str) else None
        self.name = self.path or "the simulated bus"
        self.baud = baud
        self.handler: PortHandler = (
            cast("PortHandler", sdk().PortHandler(port)) if isinstance(port, str) else port
        )
        self._lock = PortLock(port) if isinstance(port, str) else None
        self.is_open = False

    def open(self) -> None:
        """Lock and open the port; once is enough where several servos share it.

        Raises:
            PortBusy: Another process holds the port.
            PortUnavailable: The port is not there, may not be opened, or has no such rate.
        """
        if self.is_open:
            return
        if self._lock is not None:
            if not os.path.exists(self.name):  # noqa: PTH110  # a path of a device
                raise PortUnavailable(f"{self.name}: no such port")
            self._lock.acquire()
        try:
            opened = self.handler.setBaudRate(self.baud)  # the SDK opens the port here
        except (*LOST, ValueError) as error:
            self.close()
            raise PortUnavailable(
                f"{self.name}: cannot be opened at {self.baud} baud; {reason(error)}"
            ) from error
        if not opened:
            self.close()
            raise PortUnavailable(f"{self.name}: the SDK has no rate of {self.baud} baud")
        self.is_open = True
        self.handler.is_using = False
        serial: Any = getattr(self.handler, "ser", None)
        # FTDI adapters then wait 1 ms, not 16, and no root is needed; other ports have no such flag
        with contextlib.suppress(*LOST, ValueError, AttributeError):
            serial.set_low_latency_mode(True)

    @property
    def descriptor(self) -> int | None:
        """Descriptor of the open port; None of a simulated bus."""
        serial: Any = getattr(self.handler, "ser", None)
        return None if serial is None or not self.is_open else int(serial.fileno())

    @property
    def lock_descriptor(self) -> int | None:
        """Descriptor of the held lock; None of a simulated bus."""
        return None if self._lock is None else self._lock.descriptor

    def close(self) -> None:
        """Close the port and give it back; more than once does no harm."""
        self.is_open = False
        with contextlib.suppress(*LOST, AttributeError):  # it was never opened, or is gone
            self.handler.closePort()
        self.handler.is_using = False
        if self._lock is not None:
            self._lock.release()

    def guard(self, transact: Callable[[], Any]) -> Any:
        """Run a transaction, so that neither unplugging nor an interrupt blocks the next one."""
        if not self.is_open:
            raise PortLost(f"{self.name}: the port is not open")
        try:
            return transact()
        except LOST as error:
            self.is_open = False
            raise PortLost(f"{self.name}: the port is gone; {reason(error)}") from error
        finally:
            self.handler.is_using = False
