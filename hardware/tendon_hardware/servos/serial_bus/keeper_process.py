"""A process that switches a servo's motor off once nobody feeds it; `keeper.py` starts it.

It loads nothing but the standard library, so that it is there in some hundredths of a second, and
goes on where a signal ends the program that it watches.
"""

import contextlib
import os
import select
import signal
import sys
import termios
import time
import tty

RELEASE = b"q"  # Word of a program that has switched the motor off itself
ANSWER = b"."  # Answer to all that a program says
PAUSE = 0.01  # Wait for the servo's answer, and between two attempts [s]: a servo answers in less
DEAF_TIME = 10.0  # Time after which a servo on an open port answers no more [s]: it has no supply
LONGEST = 600.0  # Time after which a port that is gone does not come back [s]
NAME_SIZE = 20  # Bytes of a lock for the name of a process; the first are the program's
TRIPPED = 3  # Exit code of a keeper that had to act


def watch(patience: float) -> bool:
    """Wait until no word has come for a while [s]; return whether the motor may still be on."""
    words = sys.stdin.fileno()
    while True:
        ready, _, _ = select.select([words], [], [], patience)
        heard = os.read(words, 4096) if ready else b""
        if RELEASE in heard:
            return False
        if not heard:  # silence, or the end of the program
            return True
        with contextlib.suppress(OSError):  # the program has died since
            os.write(sys.stdout.fileno(), ANSWER)


def switch_off(port: int, path: str, baud: int, packet: bytes) -> None:
    """Send an instruction until its servo has answered; a port that is lost is opened again.

    Args:
        port: Descriptor of the servo's port.
        baud: Rate of the bus [1/s].
    """
    start = lost = time.monotonic()
    while lost - start < LONGEST and time.monotonic() - lost < DEAF_TIME:
        try:
            os.write(port, packet)
            if answered(port, packet):
                return
        except OSError:  # the adapter is gone
            lost = time.monotonic()
            port = reopened(port, path, baud)
        time.sleep(PAUSE)


def answered(port: int, packet: bytes) -> bool:
    """Tell whether the servo that a packet is for has answered it."""
    if not select.select([port], [], [], PAUSE)[0]:
        return False
    data = os.read(port, 4096)
    if not data:
        raise OSError
    return packet[:3] + b"\x02" in data


def reopened(port: int, path: str, baud: int) -> int:
    """Return a fresh descriptor of a port, or the old one where it has not come back."""
    try:
        fresh = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return port
    try:
        tty.setraw(fresh)
        settings = termios.tcgetattr(fresh)
        settings[4] = settings[5] = getattr(termios, f"B{baud}")
        termios.tcsetattr(fresh, termios.TCSANOW, settings)
    except termios.error:  # gone once more
        os.close(fresh)
        return port
    os.close(port)
    return fresh


def main() -> int:
    """Watch until the end, deaf to what ends the program."""
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE):
        signal.signal(each, signal.SIG_IGN)
    path, baud, port, lock, patience, packet = sys.argv[1:]
    instruction = bytes.fromhex(packet)
    os.pwrite(int(lock), b"%d\n" % os.getpid(), NAME_SIZE * instruction[2])  # one for each servo
    os.write(sys.stdout.fileno(), ANSWER)
    if not watch(float(patience)):
        return 0
    switch_off(int(port), path, int(baud), instruction)
    return TRIPPED


if __name__ == "__main__":
    sys.exit(main())
