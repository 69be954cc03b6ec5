"""Locks of ports: shared between users, and never a way to another file."""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tendon_hardware import serial_ports
from tendon_hardware.doctor.port_checks import check_port
from tendon_hardware.errors import PortBusy, PortUnavailable
from tendon_hardware.serial_ports import PortLock, lock_fault, lock_path

NOBODY = 65534
PORT = "/dev/ptmx"  # A character device that everybody may open; its lock has a name of its own


@pytest.fixture
def locks(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder like /run/lock: everybody may write there, only owners may delete."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o1777)
        monkeypatch.setattr(serial_ports, "LOCK_FOLDER", folder)
        yield folder


def as_another_user(ask: Callable[[], object]) -> str:
    """Return what something gives, or raises, for a user without our rights."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            if os.geteuid() == 0:
                os.setgroups([])
                os.setgid(NOBODY)
                os.setuid(NOBODY)
            said = str(ask())
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
        os.write(write_end, said.encode())
        os._exit(0)
    os.close(write_end)
    os.waitpid(child, 0)
    with os.fdopen(read_end, "rb") as pipe:
        return pipe.read().decode()


def test_a_lock_is_shared_between_users(locks: Path) -> None:
    """Whatever the mask of whoever made it, another user can take it once it is free."""
    before = os.umask(0o077)
    try:
        lock = PortLock(PORT)
        lock.acquire()
    finally:
        os.umask(before)
    assert as_another_user(PortLock(PORT).acquire).startswith("PortBusy")
    lock.release()
    assert as_another_user(PortLock(PORT).acquire) == "None"


def test_a_lock_that_is_not_shared_is_named_by_the_doctor(locks: Path) -> None:
    """One that an older program has left for itself alone: which file, whose, and what to do."""
    path = lock_path(PORT)
    path.write_text("")
    path.chmod(0o600 if os.geteuid() == 0 else 0o000)
    said = as_another_user(PortLock(PORT).acquire)
    assert said.startswith("PortUnavailable")
    assert f"sudo rm {path}" in said
    found = as_another_user(lambda: [check_port("servo", PORT).found])
    assert f"sudo rm {path}" in found
    assert "allowed and free" not in found


def test_no_link_is_followed(locks: Path) -> None:
    """A link in the lock's place would have another file emptied."""
    target = locks / "precious"
    target.write_text("keep")
    lock_path(PORT).symlink_to(target)
    with pytest.raises(PortUnavailable, match="it is a link: remove it"):
        PortLock(PORT).acquire()
    assert "it is a link" in (lock_fault(PORT) or "")
    assert target.read_text() == "keep"


def test_a_pipe_is_no_lock(locks: Path) -> None:
    """Nothing waits for its other end."""
    os.mkfifo(lock_path(PORT))
    with pytest.raises(PortUnavailable, match="must be a file"):
        PortLock(PORT).acquire()


def test_all_users_look_at_one_place(locks: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where only some may write to the folder of locks, nobody's lock is there."""
    monkeypatch.setenv("TMPDIR", str(locks))
    assert lock_path(PORT).parent == locks
    locks.chmod(0o755)
    assert lock_path(PORT).parent == serial_ports.SHARED_FOLDER


def test_a_lock_that_is_held_says_by_whom(locks: Path) -> None:
    """The doctor's look at it takes nothing away."""
    lock = PortLock(PORT)
    lock.acquire()
    assert lock_fault(PORT) is None
    with pytest.raises(PortBusy, match=f"held by process {os.getpid()}"):
        PortLock(PORT).acquire()
    lock.release()
