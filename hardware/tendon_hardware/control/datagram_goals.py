"""Goals as UDP datagrams: the newest one counts, and from other computers only with a key.

A signed datagram is text, ``GOAL SEQUENCE TIME SIGNATURE``, separated by single spaces. The four
are the goal [rad], a number that grows with every datagram, the sender's clock [s since 1970], and
the HMAC-SHA256 of the three before it, in hexadecimal. A copy that somebody sends again has no
greater number, and an old one no present time; the two computers' clocks must agree to a second
when the first one comes, as NTP makes them.
"""

import hashlib
import hmac
import ipaddress
import shlex
import socket
import time
from math import isinf
from pathlib import Path

from tendon_hardware.control.goal_lines import PIECE, LineGoals, parse_goal
from tendon_newton.errors import InvalidGoal, InvalidParameter, shown

KEY_SIZES = (16, 1024)  # Least and greatest bytes of a key
AGE_MAX = 1.0  # Difference between the sender's clock and ours beyond which a goal is too old [s]
PARTS = 4


def read_key(path: Path) -> bytes:
    """Read a key that sender and receiver share.

    Raises:
        InvalidParameter: The key cannot be read, is too short, or others may read it.
    """
    try:
        mode, size = path.stat().st_mode, path.stat().st_size
        if not path.is_file() or not KEY_SIZES[0] <= size <= KEY_SIZES[1]:
            raise InvalidParameter(
                f"{path}: a key is a file of {KEY_SIZES[0]} to {KEY_SIZES[1]} random bytes; make "
                "one: head -c 32 /dev/urandom > FILE"
            )
        if mode & 0o077:
            raise InvalidParameter(
                f"{path}: a key is its owner's alone: chmod 600 {shlex.quote(str(path))}"
            )
        return path.read_bytes()
    except OSError as error:
        raise InvalidParameter(f"{path}: a key cannot be read: {error.strerror}") from error


def signature(key: bytes, text: str) -> str:
    """Return the signature of the first three parts of a datagram."""
    return hmac.new(key, text.encode("ascii"), hashlib.sha256).hexdigest()


def signed_goal(key: bytes, goal: float, sequence: int, time: float) -> bytes:
    """Return a datagram.

    Args:
        goal: Angle [rad].
        sequence: A number greater than that of any datagram before.
        time: The sender's clock [s since 1970].
    """
    text = f"{goal:.9g} {sequence:d} {time:.6f}"
    return f"{text} {signature(key, text)}".encode("ascii")


class SignedGoals:
    """Believes datagrams of whoever has the key, each once and only while it is young.

    The first one is young by both computers' clocks. From then on a datagram may also be young by
    the time that has passed here since, so that a clock may be set while a run goes on.
    """

    def __init__(self, key: bytes) -> None:
        self._key = key
        self._sequence = -1
        self._least: float | None = None
        """Least difference so far between our running time and a sender's clock [s]."""

    def goal(self, data: bytes, now: float, running: float) -> str:
        """Return the text of the goal in a datagram that came now.

        Args:
            now: Our clock [s since 1970].
            running: The same instant by a clock that nobody sets [s].

        Raises:
            InvalidGoal: The datagram has another form or signature, is a copy, or is too old.
        """
        parts = data.decode("ascii", errors="replace").strip().split(" ")
        if len(parts) != PARTS:
            raise InvalidGoal(
                "a goal over the network is GOAL SEQUENCE TIME SIGNATURE; it is "
                f"{shown(' '.join(parts))}"
            )
        text = " ".join(parts[:-1])
        if not text.isascii() or not hmac.compare_digest(
            signature(self._key, text).encode(), parts[-1].encode()
        ):
            raise InvalidGoal("a goal over the network must be signed with our key; one is not")
        sequence, sent = self._numbers(parts)
        if sequence <= self._sequence:
            raise InvalidGoal(f"a goal counts once; number {sequence} comes after {self._sequence}")
        late = running - sent
        known = self._least is not None and late - self._least <= AGE_MAX
        if not (abs(now - sent) <= AGE_MAX or known) or isinf(sent):
            raise InvalidGoal(
                f"a goal must be younger than {AGE_MAX:g} s; one is {now - sent:.1f} s old: do "
                "both clocks agree?"
            )
        self._sequence = sequence
        self._least = late if self._least is None else min(late, self._least)
        return parts[0]

    @staticmethod
    def _numbers(parts: list[str]) -> tuple[int, float]:
        """Return sequence and time; whoever signs nonsense has the key, and is told."""
        try:
            return int(parts[1]), float(parts[2])
        except ValueError:
            raise InvalidGoal(
                f"sequence and time must be numbers; they are {shown(' '.join(parts[1:3]))}"
            ) from None


WAITING_MAX = 1024
"""Datagrams taken at a time, so that a flood cannot hold the loop up: 2 ms. Linux keeps 277 short
ones waiting and drops what comes then, so that the newest is no older than a policy step."""


class DatagramGoals(LineGoals):
    """Goals as datagrams of one number in text, or signed; of those waiting the newest counts.

    Args:
        address: Interface and port, ``127.0.0.1:5005``; a port alone means this computer only.
        value: The goal [rad] before the first datagram.
        key: Key that the sender shares; without one only this computer may send.

    Raises:
        InvalidParameter: There is no such address, or others could send to it without a key.
    """

    def __init__(self, address: str, value: float = 0.0, *, key: bytes | None = None) -> None:
        host, _, port = address.rpartition(":")
        host = host or "127.0.0.1"
        if not port.isdecimal() or not 0 <= int(port) <= 65535:
            raise InvalidParameter(
                f"goals over UDP come as udp:PORT or udp:ADDRESS:PORT; it is {shown(address)}"
            )
        if key is None and not is_loopback(host):
            raise InvalidParameter(
                f"udp:{address}: anybody on the network could move the motor; give --goals-key, or "
                "an address of this computer alone, udp:PORT"
            )
        self._signed = None if key is None else SignedGoals(key)
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

    def read(self, line: bytes) -> float:
        """Return the goal of a datagram [rad], if whoever sent it may.

        Raises:
            InvalidGoal: The datagram holds no goal, or may not count.
        """
        if self._signed is None:
            return super().read(line)
        return parse_goal(self._signed.goal(line, time.time(), time.monotonic()))

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


def is_loopback(host: str) -> bool:
    """Tell whether only this computer reaches an address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name: whoever it leads to
        return False
