"""Names that come from files and become paths of ours, checked in one place."""

import os.path
from pathlib import Path

from tendon_newton.errors import TendonNewtonError, shown

NAME_LIMIT = 200  # Longest name [bytes]; file systems take 255, and endings and numbers are added
PATH_LIMIT = 1000  # Longest path of a recording [characters]; no file system of today takes 4096


def check_name(name: str, what: str, fault: type[TendonNewtonError]) -> None:
    """Refuse what cannot be the name of one file or folder.

    Args:
        what: Where it comes from and what it names, for messages.
    """
    plain = name.isprintable() and not set(name) & set("/\\") and name not in ("", ".", "..")
    if not plain or len(name.encode()) > NAME_LIMIT:
        raise fault(
            f"{what} must be a file's name: 1 to {NAME_LIMIT} printable bytes without / and \\; "
            f"it is {shown(name)}"
        )


def check_path(name: str, what: str, fault: type[TendonNewtonError]) -> None:
    """Refuse a path that leads out of its folder by its words; the arguments are those above."""
    if len(name) > PATH_LIMIT or not name.isprintable():
        raise fault(f"{what} must be a path of at most {PATH_LIMIT} printable characters")
    path = os.path.normpath(name)
    if not name or Path(path).is_absolute() or Path(path).parts[:1] in ((), ("..",)):
        raise fault(f"{what} must lie inside the dataset's folder; it is {name!r}")
