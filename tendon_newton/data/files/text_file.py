"""Text files: reading those from outside without trusting them, and writing ours whole."""

import codecs
import os
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from io import TextIOWrapper
from math import isfinite
from pathlib import Path
from stat import S_ISREG
from typing import Any, BinaryIO, TextIO

from tendon_newton.data.files.together import together
from tendon_newton.errors import InvalidOutput, TendonNewtonError, listed

SIZE_LIMIT = 4_000_000
"""Bytes of a settings file that we read. The largest of ours, a dataset of thousands of recordings,
has a tenth of them; parsing more would look like a hang."""
LOG_SIZE_LIMIT = 1 << 28  # Bytes of a log of rows that we read: seven hours of ten columns at 80 Hz
UTF16 = (b"\xff\xfe", b"\xfe\xff")  # What a text of that kind begins with
BLOCK = 1 << 20  # Bytes that are looked at together
LINE_LIMIT = 1 << 19
"""Bytes of a line of a log: thousands of columns. Parsing takes ten times as much for each cell."""
HOME: ContextVar[str | None] = ContextVar("HOME", default=None)
"""Folder outside of which no file is opened at the moment; see `kept_inside`."""


def read_text(
    path: Path, fault: type[TendonNewtonError], promise: str, *, size_limit: int | None = None
) -> str:
    """Read a UTF-8 text file; a byte order mark at its start is left out.

    Args:
        promise: What the file should be, in words ("a model is a TOML file").
        size_limit: Bytes beyond which the file cannot be what it should be.
    """
    try:
        text = read_bytes(path, fault, promise, size_limit=size_limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        mend = f"byte {error.start} is not{coding_mend(error.object)}"
        raise fault(f"{path}: {promise}, which must be UTF-8; {mend}") from error
    if "\0" in text:
        raise fault(f"{path}: {promise}; it holds a zero byte at character {text.index(chr(0))}")
    return text


def read_bytes(
    path: Path, fault: type[TendonNewtonError], promise: str, *, size_limit: int | None = None
) -> bytes:
    """Read a file whole; the arguments and errors are those of `read_text`."""
    try:
        with open_bytes(path, fault, promise, size_limit=size_limit) as file:
            return file.read()
    except OSError as error:
        raise fault(f"{path}: {promise}; it cannot be read: {error.strerror or error}") from error


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file; see `write_bytes`."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file whole or not at all: a full disk leaves what was there before.

    Raises:
        InvalidOutput: The file cannot be written; the message names it.
    """
    with drafted(path) as draft, draft.open("wb") as file:
        file.write(content)


@contextmanager
def drafted(path: Path) -> Generator[Path]:
    """Give a place beside a file, where its next content is written whole or not at all.

    Raises:
        InvalidOutput: The file cannot be written; the message names it.
    """
    with together() as drafts:
        drafts[path] = draft = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            yield draft
            with draft.open("rb") as file:
                os.fsync(file.fileno())  # else a power cut may leave a name without its content
        except OSError as error:
            raise InvalidOutput(f"{path}: cannot be written: {error.strerror or error}") from error


@contextmanager
def kept_inside(folder: Path) -> Generator[None]:
    """Let no file be opened here that lies outside a folder, by whatever link it is reached."""
    token = HOME.set(os.path.realpath(folder))
    try:
        yield
    finally:
        HOME.reset(token)


def open_bytes(
    path: Path, fault: type[TendonNewtonError], promise: str, *, size_limit: int | None = None
) -> BinaryIO:
    """Open a file to be read, once, and look at what was opened rather than at its name.

    The arguments and errors are those of `read_text`.
    """
    if not path.is_file():
        raise fault(f"{path}: {promise}; {absence(path)}")
    file = os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb")
    try:
        status, home = os.fstat(file.fileno()), HOME.get()
        if not S_ISREG(status.st_mode):
            raise fault(f"{path}: {promise}; it is no file any more")
        if home is not None and os.path.commonpath((home, true_path(file, path))) != home:
            raise fault(f"{path}: {promise} inside {home}; it is a link that leads out of it")
        if size_limit is not None and status.st_size > size_limit:
            raise fault(f"{path}: {promise} of at most {size_limit} bytes; it has {status.st_size}")
    except BaseException:
        file.close()
        raise
    return file


def true_path(file: BinaryIO, path: Path) -> str:
    """Return where an open file lies; by its name where the system does not tell (not Linux)."""
    link = f"/proc/self/fd/{file.fileno()}"
    return os.readlink(link) if os.path.islink(link) else os.path.realpath(path)  # noqa: PTH114, PTH115


def open_text(
    path: Path, fault: type[TendonNewtonError], promise: str, *, size_limit: int
) -> TextIO:
    """Open a UTF-8 text file to be read line by line, after a look at all of its bytes.

    The arguments and errors are those of `read_text`.
    """
    try:
        file = open_bytes(path, fault, promise, size_limit=size_limit)
        try:
            refuse_bytes(file, path, fault, promise)
            file.seek(0)
        except BaseException:
            file.close()
            raise
        return TextIOWrapper(file, encoding="utf-8-sig", newline="")
    except OSError as error:
        raise fault(f"{path}: {promise}; it cannot be read: {error.strerror or error}") from error


def refuse_bytes(file: BinaryIO, path: Path, fault: type[TendonNewtonError], promise: str) -> None:
    """Refuse a file with bytes that are no text, or with a line that is none of a log."""
    decoder = codecs.getincrementaldecoder("utf-8-sig")()
    place = characters = line = 0
    while block := file.read(BLOCK):
        kept = len(decoder.getstate()[0])  # the begin of a character that the last block cut
        try:
            text = decoder.decode(block, final=len(block) < BLOCK)
        except UnicodeDecodeError as error:
            at = place - kept + error.start
            mend = coding_mend(block)
            raise fault(
                f"{path}: {promise}, which must be UTF-8; byte {at} is not{mend}"
            ) from error
        if "\0" in text:
            at = characters + text.index("\0")
            raise fault(f"{path}: {promise}; it holds a zero byte at character {at}")
        first, *others = block.splitlines(keepends=True)
        lengths = [line + len(first), *map(len, others)]
        line = 0 if block.endswith((b"\n", b"\r")) else lengths[-1]
        if max(lengths) > LINE_LIMIT:
            raise fault(f"{path}: {promise}; a line has at most {LINE_LIMIT} bytes, one has more")
        place, characters = place + len(block), characters + len(text)


def coding_mend(content: bytes) -> str:
    """Say how a text of another coding becomes UTF-8; nothing of bytes that are no text."""
    if content[:2] in UTF16:
        return ": save it so, as iconv -f utf-16 -t utf-8 does"
    plain = min(content[:BLOCK]) >= ord("\t")
    return ": save it so, as iconv -f latin1 -t utf-8 does" if plain else ""


def absence(path: Path) -> str:
    """Say what stands in a file's place."""
    if path.is_dir():
        return "it is a folder"
    if path.parent.is_dir():
        absent = not path.exists()
        return f"no such file{inside(path)}" if absent else "it is a device or a pipe"
    return f"{path.parent} is a file, no folder" if path.parent.is_file() else "no such folder"


def inside(path: Path) -> str:
    """Say which folders beside a missing file have one of its name, such as joints of an arm."""
    try:
        names = sorted(each.name for each in path.parent.iterdir() if (each / path.name).is_file())
    except OSError:  # a folder that may not be listed
        return ""
    return f"; {listed(names)} in it have one each: name one of them" if len(names) > 1 else ""


def finite_number(value: Any) -> float | None:
    """Return a value as a float; None if it is no number, not finite or beyond any float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if isfinite(number) else None
