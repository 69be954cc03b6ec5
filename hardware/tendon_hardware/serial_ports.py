"""Serial ports of this computer: one user each, and what the system knows about them."""

import contextlib
import fcntl
import os
import shlex
import signal
import stat
import termios
import time
from collections.abc import Sequence
from pathlib import Path

from tendon_hardware.errors import PortBusy, PortUnavailable

LOCK_FOLDER = Path("/run/lock")  # Folder of the locks of devices in the file hierarchy standard
SHARED_FOLDER = Path("/", "tmp")
"""Where they are put where not every user may write there: all users must look at one place."""
EVERYBODY = 0o666  # Rights of a lock: whoever may use the port may lock it
PATIENCE = 1.0
"""Longest wait for a lock [s]: a keeper of a dead program's motor takes 0.2 s to switch it off."""
LONGEST_NAMES = 5200  # Bytes in which a lock names processes
LATENCY_TIMERS = Path("/sys/bus/usb-serial/devices")
"""File of the latency timer of an FTDI adapter in Linux."""


LOST = (OSError, termios.error)
"""Errors of an unplugged adapter; the second is no child of the first."""


class PortLock:
    """Hold a serial port against other programs of ours.

    Neither the SDK nor the system keeps a second program from opening a port, and then each takes
    the other's answers. The system releases the lock when the process dies, and with it all that it
    has given the lock's descriptor to.

    Args:
        port: Path of the device; links lead to the same lock as their target.
    """

    def __init__(self, port: str) -> None:
        self.port = port
        self._file: int | None = None

    @property
    def descriptor(self) -> int | None:
        """Descriptor of the lock while it is held: who inherits it holds the lock as well."""
        return self._file

    def acquire(self) -> None:
        """Take the lock, and wait for the end of what watched over a program that died.

        Raises:
            PortBusy: Another process has it.
            PortUnavailable: No lock file may be made.
        """
        if self._file is not None:
            return
        file = open_lock(self.port)
        try:
            try:
                lock(file, PATIENCE)
            except OSError:
                wake(named(file)[1:])
                lock(file, PATIENCE)
        except OSError as error:
            holder = ([str(each) for each in named(file) if alive(each)] or ["unknown"])[0]
            os.close(file)
            raise PortBusy(
                f"{self.port}: held by process {holder}; end it, or see what it is: ps -p {holder}"
            ) from error
        os.ftruncate(file, 0)
        os.write(file, b"%d\n" % os.getpid())
        self._file = file

    def release(self) -> None:
        """Give the lock back; more than once does no harm."""
        if self._file is not None:
            os.ftruncate(self._file, 0)
            os.close(self._file)
            self._file = None


def named(file: int) -> list[int]:
    """Return the processes that a lock names: its holder, then what watches over its motors."""
    words = os.pread(file, LONGEST_NAMES, 0).replace(b"\0", b" ").split()
    return [int(word) for word in words if word.isdigit()]


def alive(process: int) -> bool:
    """Tell whether a process is there."""
    return Path(f"/proc/{process}").exists()


def wake(processes: Sequence[int]) -> None:
    """Let what watches over a dead program's motor go on where it was stopped."""
    for each in processes:
        with contextlib.suppress(OSError):
            os.kill(each, signal.SIGCONT)


def lock(file: int, patience: float) -> None:
    """Lock a file, at the latest after some time [s].

    Raises:
        OSError: Another process still holds it then.
    """
    deadline = time.monotonic() + patience
    while True:
        try:
            return fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise
        time.sleep(0.01)


def lock_path(port: str) -> Path:
    """Return the lock file of a port."""
    device = os.path.realpath(port).removeprefix("/dev/").strip("/").replace("/", "_")
    try:
        shared = bool(LOCK_FOLDER.stat().st_mode & stat.S_IWOTH)
    except OSError:
        shared = False
    return (LOCK_FOLDER if shared else SHARED_FOLDER) / f"tendon-newton.{device}.lock"


def open_lock(port: str) -> int:
    """Open the lock file of a port, which belongs to all users; no link is followed.

    A lock that is there is opened without the wish to make it: in a folder such as /run/lock Linux
    refuses that to all but its owner.

    Raises:
        PortUnavailable: The lock may not be made or opened, or is no file.
    """
    path, flags = lock_path(port), os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        try:
            file = os.open(path, flags)
        except FileNotFoundError:
            file = os.open(path, flags | os.O_CREAT, EVERYBODY)
        with contextlib.suppress(PermissionError):  # of another user, who has done it
            os.fchmod(file, EVERYBODY)  # whatever this user's mask is
    except OSError as error:
        raise PortUnavailable(f"{port}: {lock_trouble(path, error)}") from error
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise PortUnavailable(f"{port}: its lock {path} must be a file; it is no file: remove it")
    return file


def lock_trouble(path: Path, error: OSError) -> str:
    """Say why a lock cannot be opened, and what to do about it."""
    if path.is_symlink():
        return f"its lock {path} must be a file; it is a link: remove it"
    said = f"its lock {path} cannot be opened; {error.strerror or error}"
    with contextlib.suppress(OSError):
        return f"{said}; it belongs to user {path.stat().st_uid}: sudo rm {shlex.quote(str(path))}"
    return said


def lock_fault(port: str) -> str | None:
    """Return why this user could not lock a port, if so; nothing is made or locked."""
    path = lock_path(port)
    if not path.exists() and not path.is_symlink():
        return None if os.access(path.parent, os.W_OK) else f"no lock may be made in {path.parent}"
    try:
        os.close(open_lock(port))
    except PortUnavailable as error:
        return str(error)
    return None


def latency_timer(port: str) -> int | None:
    """Read how long an FTDI adapter collects bytes [ms]; ``None`` where it has no such timer."""
    try:
        return int(
            (LATENCY_TIMERS / Path(os.path.realpath(port)).name / "latency_timer").read_text()
        )
    except (OSError, ValueError):
        return None


def holders(port: str) -> tuple[tuple[int, str], ...]:
    """Find the other processes that have a port open: number and name, as far as we may see."""
    device = os.path.realpath(port)
    found: list[tuple[int, str]] = []
    for process in Path("/proc").glob("[0-9]*"):
        if int(process.name) == os.getpid():
            continue
        try:
            if any(os.path.realpath(file) == device for file in (process / "fd").iterdir()):
                found.append((int(process.name), (process / "comm").read_text().strip()))
        except OSError:  # it has ended, or belongs to another user
            continue
    return tuple(sorted(found))


def reason(error: BaseException) -> str:
    """Say what the system says, without its error number."""
    words = [part for part in error.args if isinstance(part, str)]
    return words[-1] if words else str(error)
