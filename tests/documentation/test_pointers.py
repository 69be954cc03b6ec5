"""Modules, files and members to which docstrings, comments and pages point."""

import ast
import re
from functools import cache

from tests.prose import FENCE
from tests.test_repository import ROOT, TEXT, repository_files

DOTTED = re.compile(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+)`")
FILE = re.compile(r"`([\w./]+/\w+\.py)`")
FILES = {path: path.relative_to(ROOT) for path in repository_files()}
ENDINGS = {path.suffix[1:] for path in FILES} | {"html", "mcap", "onnx", "urdf"}
PATHS = [f"/{place.as_posix()}" for place in FILES.values() if place.suffix == ".py"]
PATH_OF = {
    tuple(path[1:-3].removesuffix("/__init__").split("/")): ROOT / path[1:] for path in PATHS
}
"""File of each module, by the words of its name."""
MODULES = {words[:k] for words in PATH_OF for k in range(1, len(words) + 1)}
ROOMS = {words[0] for words in MODULES} | {
    words[1] for words in MODULES if words[0] == "tendon_newton" and len(words) > 1
}
"""First words of a module's full name, with or without `tendon_newton`."""


@cache
def syntax(words: tuple[str, ...]) -> ast.Module:
    """Return the syntax of a module."""
    return ast.parse(PATH_OF[words].read_text(encoding="utf-8"))


@cache
def classes() -> dict[str, list[ast.ClassDef]]:
    """Return the classes of all modules by name."""
    found: dict[str, list[ast.ClassDef]] = {}
    for words in PATH_OF:
        for node in ast.walk(syntax(words)):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(node)
    return found


def members(place: ast.AST) -> set[str]:
    """Return the names that a module or a class defines, those of `self` included."""
    names = set()
    for node in ast.walk(place):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.attr)
    return names


def class_has(name: str, member: str) -> bool:
    """Tell whether a class of ours or a base of it has a member; a foreign base may have it."""
    if name not in classes():
        return name not in {"Protocol", "ABC"}
    bases = {ast.unparse(base).partition("[")[0] for c in classes()[name] for base in c.bases}
    return any(member in members(c) for c in classes()[name]) or any(
        class_has(base, member) for base in bases
    )


def module_has(words: tuple[str, ...]) -> bool:
    """Tell whether words are a module, or a name in one."""
    return words in MODULES or (words[:-1] in PATH_OF and words[-1] in members(syntax(words[:-1])))


def exists(pointer: str) -> bool:
    """Tell whether a dotted name exists; all of other libraries, and files, do."""
    words = tuple(pointer.split("."))
    if words[0] in classes():
        return class_has(words[0], words[1])
    if words[0] in ROOMS and words[-1] not in ENDINGS:
        return module_has(words) or module_has(("tendon_newton", *words))
    # the end of a module's name does not tell a reader its room
    return not any(path.endswith(f"/{'/'.join(words)}.py") for path in PATHS)


def is_file(name: str) -> bool:
    """Tell whether a path is the end of one of ours; all of other projects are."""
    return name.split("/")[0] not in ROOMS or any(path.endswith(f"/{name}") for path in PATHS)


def test_what_a_text_points_to_exists() -> None:
    """Full names of modules, members of our classes, and paths of sources."""
    pages = [ROOT / name for name in TEXT if name != "CHANGELOG.md"]  # which has names of the past
    stale = []
    for path in [*pages, *(path for path in FILES if path.suffix == ".py")]:
        text = FENCE.sub("", path.read_text(encoding="utf-8"))
        pointers = [name for name in DOTTED.findall(text) if not exists(name)]
        pointers += [name for name in FILE.findall(text) if not is_file(name)]
        stale += [f"{path.relative_to(ROOT)}: {name}" for name in pointers]
    assert stale == []


def test_a_stale_pointer_is_seen() -> None:
    """A module that moved, the end of a name, and a member or a constant that is gone."""
    assert not exists("mechanisms.routing")
    assert not exists("networks.history")
    assert not exists("Mechanism.build")
    assert not exists("effects.base.Stages")
    assert not is_file("simulation/kernels/command_log.py")
