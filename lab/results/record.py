"""A result that is kept, and whether the code that it rests on is still the same.

A record is a JSON file of ``lab/results/records`` with the keys

- ``command`` and ``minutes``: what measures it again, and how long that takes;
- ``commit``, ``date``, ``device``, ``seeds``, ``n``: what it was measured on;
- ``clean``: whether git saw no change at that commit: as the file with the figures says, which its
  command wrote; null where it says nothing;
- ``older``: of a file whose cells have their own origin (`measured_on`), how many are of other code
  than the record's, by commit;
- ``code``: folders that it rests on, each with the fingerprint that it had at that commit;
- ``data``: the file with its figures, or ``rows``: the figures themselves;
- ``note``: what a reader must know, such as what was mended since.
"""

import ast
import hashlib
import io
import json
import subprocess
import tarfile
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from tendon_newton.data.files.origin import git_commit

ROOT = Path(__file__).resolve().parents[2]
FOLDER = Path(__file__).parent / "records"


@dataclass(frozen=True, kw_only=True)
class Record:
    """One result: where it comes from, and its figures."""

    name: str
    command: str
    minutes: float
    commit: str
    clean: bool | None
    date: str
    device: str
    n: str
    note: str
    seeds: list[int] = field(default_factory=list)
    code: dict[str, str]
    older: dict[str, int] = field(default_factory=dict)
    data: str | None = None
    rows: Any = None

    @property
    def figures(self) -> Any:
        """What was measured, as its command wrote it."""
        return json.loads((ROOT / self.data).read_text()) if self.data else self.rows

    @property
    def changed(self) -> list[str]:
        """Folders whose code is no longer that of the measurement."""
        return [name for name, before in self.code.items() if fingerprint(ROOT, name) != before]


def measured_on(names: Iterable[str]) -> dict[str, Any]:
    """Return the origin of a cell: commit, whether git saw a change, and its code's fingerprint."""
    commit, *changed = (git_commit() or "unknown-").split("-")
    return {"commit": commit, "clean": not changed, "code": combined(now(tuple(names)))}


@cache
def now(names: tuple[str, ...]) -> dict[str, str]:
    """Return the fingerprints of files and folders."""
    return {name: fingerprint(ROOT, name) for name in names}


def combined(prints: Mapping[str, str]) -> str:
    """Return one fingerprint in place of several."""
    text = "\n".join(f"{name} {prints[name]}" for name in sorted(prints))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def records() -> dict[str, Record]:
    """Return every result that is kept, by name."""
    paths = sorted(FOLDER.glob("*.json"))
    return {p.stem: Record(name=p.stem, **json.loads(p.read_text())) for p in paths}


def fingerprint(root: Path, name: str) -> str:
    """Return the fingerprint of a file or of a folder's files: code without docstrings."""
    place = root / name
    files = [place] if place.is_file() else sorted(p for p in place.rglob("*") if p.is_file())
    parts = (f"{path.relative_to(root)}\n{meaning(path)}" for path in files if kept(path))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def kept(path: Path) -> bool:
    """Tell whether a file is code or a table of numbers; tests beside it change no result."""
    return path.suffix in {".py", ".toml", ".usda"} and not path.name.startswith("test_")


def meaning(path: Path) -> str:
    """Return a file without what does not change its results: docstrings, comments, layout."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [line for line in body if not is_text(line)]  # type: ignore[attr-defined]
    return ast.unparse(tree)


def is_text(line: ast.stmt) -> bool:
    """Tell whether a statement is a docstring."""
    return (
        isinstance(line, ast.Expr)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, str)
    )


def fingerprints_at(commit: str, names: Iterable[str]) -> dict[str, str]:
    """Return the fingerprints that files and folders had at a commit."""
    words = ["git", "archive", commit, *names]
    packed = subprocess.run(words, cwd=ROOT, capture_output=True, check=True).stdout
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(folder, filter="data")
        return {name: fingerprint(Path(folder), name) for name in names}
