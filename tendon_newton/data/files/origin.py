"""Where results come from: hashes of the files that went in, and the commit of the program."""

import functools
import hashlib
import subprocess
from pathlib import Path

CLONE = Path(__file__).resolve().parents[3]  # Root of the clone, where the program runs from one


def content_hash(content: bytes) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file, or of the names and bytes of all files in a folder."""
    digest = hashlib.sha256()
    for file in sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]:
        if file != path:
            digest.update(file.relative_to(path).as_posix().encode())
        with file.open("rb") as opened:
            hashlib.file_digest(opened, lambda: digest)
    return digest.hexdigest()


@functools.cache
def git_commit() -> str | None:
    """Return the commit of the clone that this runs from, marked if it was changed since."""
    if not (CLONE / ".git").exists():
        return None
    command = ["git", "--no-optional-locks", "-C", str(CLONE)]
    command += ["describe", "--always", "--abbrev=40", "--dirty", "--exclude=*"]
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return result.stdout.strip() or None
