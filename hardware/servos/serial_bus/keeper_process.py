"""A process that switches a servo's motor off once nobody feeds it; `keeper.py` starts it.

It loads nothing but the standard library, so that it is there in some hundredths of a second, and
goes on where a signal ends the program that it watches.
"""

import os
import select
import signal
import sys
import time

RELEASE = b"q"
"""Word of a program that has switched the motor off itself."""
ATTEMPTS = 20
PAUSE = 0.01
"""Between two attempts [s]: a servo answers in less, and some attempts may meet others' frames."""
TRIPPED = 3
"""Exit code of a keeper that had to act."""


def watch(port: int, patience: float, packet: bytes) -> int:
    """Wait until no word has come for a while, or the program is gone; then send the packet.

    Args:
        port: Descriptor of the servo's port.
        patience: Longest silence [s].
        packet: Instruction that switches the motor off.
    """
    words = sys.stdin.fileno()
    while True:
        ready, _, _ = select.select([words], [], [], patience)
        heard = os.read(words, 4096) if ready else b""
        if RELEASE in heard:
            return 0
        if not heard:  # silence, or the end of the program
            break
    for _ in range(ATTEMPTS):
        try:
            os.write(port, packet)
        except OSError:  # the adapter is gone
            break
        time.sleep(PAUSE)
    return TRIPPED


def main() -> int:
    """Watch until the end, deaf to what ends the program."""
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, signal.SIG_IGN)
    port, patience, packet = sys.argv[1:]
    os.write(sys.stdout.fileno(), b"r")
    return watch(int(port), float(patience), bytes.fromhex(packet))


if __name__ == "__main__":
    sys.exit(main())
