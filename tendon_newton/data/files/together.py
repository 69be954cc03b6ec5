"""Files of one answer: put in their places at once, and told apart from those of another."""

from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.files.values import is_table
from tendon_newton.errors import InvalidOutput, TendonNewtonError

DRAFTS: ContextVar[dict[Path, Path] | None] = ContextVar("DRAFTS", default=None)
"""Files that are written now and put in their places later."""
KEY = "files"  # Key under which the last file of an answer has the hashes of the others
READ = (".toml", ".json")  # Endings of files that programs read together


@contextmanager
def together() -> Generator[dict[Path, Path]]:
    """Put the files that are written meanwhile in their places at the end, or none of them.

    Yields:
        Place of each file so far -> its draft beside it.
    """
    if (begun := DRAFTS.get()) is not None:
        yield begun
        return
    drafts: dict[Path, Path] = {}
    token = DRAFTS.set(drafts)
    try:
        yield drafts
        for path, beside in drafts.items():
            try:
                beside.replace(path)
            except OSError as error:
                raise InvalidOutput(f"{path}: cannot be written: {error.strerror}") from error
    finally:
        DRAFTS.reset(token)
        for beside in drafts.values():
            with suppress(OSError):  # on a disk that takes nothing the first error tells of it
                beside.unlink(missing_ok=True)


def with_hashes(table: Mapping[str, Any], drafts: Mapping[Path, Path], folder: Path) -> Any:
    """Return a table with the hashes of the files that are put into a folder together with it."""
    own = [(path, beside) for path, beside in drafts.items() if path.parent == folder]
    return {
        **table,
        KEY: {path.name: file_hash(beside) for path, beside in own if path.suffix in READ},
    }


def refuse_mix(path: Path, table: Mapping[str, Any], fault: type[TendonNewtonError]) -> None:
    """Refuse a file of an answer beside which those of another answer stand.

    Args:
        path: The file that tells their hashes.
        table: What it holds; without hashes nothing is refused.
    """
    told = table.get(KEY)
    if not is_table(told):
        return
    for beside in sorted(path.parent.iterdir()):
        name = beside.name
        if name in told and beside.is_file() and file_hash(beside) != told[name]:
            raise fault(
                f"{path}: {name} beside it is not of the same answer: one of them was edited, or "
                f"written alone; make the answer anew, or copy {name} elsewhere to use it by itself"
            )
