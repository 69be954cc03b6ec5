"""Goals as UDP datagrams of this computer: the newest one counts."""

import ipaddress
import socket

from tendon_hardware.control.goal_lines import PIECE, LineGoals
from tendon_newton.errors import InvalidParameter, shown

WAITING_MAX = 1024
"""Datagrams taken at a time, so that a flood cannot hold the loop up: 2 ms. Linux keeps 277 short
ones waiting and drops what comes then, so that the newest is no older than a policy step."""


class DatagramGoals(LineGoals):
    """Goals as datagrams of one number in text; of those waiting the newest counts.

    Args:
        address: Interface and port, ``127.0.0.1:5005``; a port alone means this computer only.
        value: The goal [rad] before the first datagram.

    Raises:
        InvalidParameter: There is no such address, or others could send to it.
    """

    def __init__(self, address: str, value: float = 0.0) -> None:
        host, _, port = address.rpartition(":")
        host = host or "127.0.0.1"
        if not port.isdecimal() or not 0 <= int(port) <= 65535:
            raise InvalidParameter(
                f"goals over UDP come as udp:PORT or udp:ADDRESS:PORT; it is {shown(address)}"
            )
        if not is_loopback(host):
            raise InvalidParameter(
                f"udp:{address}: anybody on the network could move the motor; take udp:PORT, or "
                "from another computer ssh and --goals stdin"
            )
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind((host, int(port)))
        except OSError as error:
            self._socket.close()
            raise InvalidParameter(f"udp:{address}: {error.strerror or error}") from error
        super().__init__(value, self._socket.fileno())

    @property
    def port(self) -> int:
        """Port at which datagrams are taken."""
        return self._socket.getsockname()[1]

    def value(self, now: float) -> float:
        """Return the goal of the newest datagram that is one [rad]."""
        waiting: list[bytes] = []
        while len(waiting) < WAITING_MAX:
            try:
                waiting.append(self._socket.recv(PIECE))
            except OSError:  # none is waiting, or the network is down
                break
        any(self.take(data) for data in reversed(waiting))
        return self._value

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


def is_loopback(host: str) -> bool:
    """Tell whether only this computer reaches an address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name: whoever it leads to
        return False
