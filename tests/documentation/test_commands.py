"""Every command and every option that a text, a page of help or a message names exists."""

import ast
import re
import shlex
from collections.abc import Iterator
from dataclasses import is_dataclass
from functools import cache
from typing import Any, get_args, get_type_hints

import tyro

from tendon_newton.cli import QUIET_OPTION, VERBOSE_OPTION, config_of, every_verb
from tests.test_repository import ROOT, TEXT, UNREAD, read

CODE = ("tendon_newton", "train/tendon_train", "hardware/tendon_hardware", "lab/tendon_lab/verbs")
VERBS = every_verb()
PLACE = "PLACE"  # Stands for what a message fills in
COMMAND = re.compile(r"(?<![\w-])tendon-newton ([a-z][^\n`;#()']*)")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*[a-z]\b(?!-)")
OF_ALL = {QUIET_OPTION, VERBOSE_OPTION, "--help", "--version"}
# Of git, udev, MuJoCo, torch and tyro
OF_OTHERS = {"--always", "--dirty", "--abbrev", "--exclude", "--no-optional-locks", "--reload"}
OF_OTHERS |= {"--mjcf", "--nproc-per-node", "--follow"}


@cache
def options_of(verb: str) -> set[str]:
    """Return every option of a verb and of its kinds."""
    config = config_of(VERBS[verb])
    kinds = get_args(config) or (config,)
    names = {name.replace("_", "-") for kind in kinds for name in names_in(kind)}
    return {f"--{name}" for name in names} | {f"--no-{name}" for name in names} | OF_ALL


def names_in(kind: Any) -> Iterator[str]:
    """Yield the fields of a class and of the classes in it."""
    for name, inner in get_type_hints(kind).items():
        yield from names_in(inner) if is_dataclass(inner) else (name,)


def shown(node: ast.AST) -> str | None:
    """Return what a string or a list of words shows, with a word for each value it takes in."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return "".join(shown(value) or PLACE for value in node.values)
    if isinstance(node, ast.List):
        return " ".join(shown(word) or PLACE for word in node.elts)
    return None


def messages() -> Iterator[tuple[str, str]]:
    """Yield each string of the program that names a command or an option, with its place."""
    for page in sorted(file for folder in CODE for file in (ROOT / folder).rglob("*.jinja")):
        filled = re.sub(r"{{.*?}}", PLACE, page.read_text(encoding="utf-8"))
        yield from ((page.name, said) for said in re.findall(r"<code>(.*?)</code>", filled, re.S))
    for file in sorted(file for folder in CODE for file in (ROOT / folder).rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        spoken = "--" in text or "tendon-newton" in text
        for node in ast.walk(ast.parse(text)) if spoken else ():
            said = shown(node)
            if said and ("--" in said or "tendon-newton " in said):
                yield f"{file.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}", said


def unknown_words(said: str) -> Iterator[str]:
    """Yield the verbs of a text's commands that are none, and the options that a verb has not."""
    for command in COMMAND.findall(said):
        verb, *words = command.split()
        verb = verb.rstrip(".,:")
        if verb not in VERBS:
            yield f"tendon-newton {verb}"
            continue
        options = options_of(verb)
        yield from (
            f"{verb} {word}" for word in words if OPTION.fullmatch(word) and word not in options
        )


def test_every_command_in_a_message_has_its_verb_and_its_options() -> None:
    """What is printed can be typed; a line without our name has options of one verb at least."""
    every = OF_OTHERS.union(*(options_of(verb) for verb in VERBS))
    strings = list(messages())
    added = {word for _, said in strings for word in [said] if OPTION.fullmatch(word)}
    found = [f"{place}: {word}" for place, said in strings for word in unknown_words(said)]
    found += [
        f"{place}: {word}"
        for place, said in strings
        for word in OPTION.findall(said)
        if word not in every | added
    ]
    assert not found, "\n".join(found)


def test_every_command_of_a_text_is_read_by_its_verb() -> None:
    """Each line of a block of shell is taken as it stands, all of its words included."""
    refused: list[str] = []
    for name in sorted(set(TEXT) - set(UNREAD)):
        blocks = re.findall(r"^```(?:sh|bash|console)\n(.*?)^```", read(name), re.M | re.S)
        lines = [line for text in blocks for line in text.replace("\\\n", " ").splitlines()]
        for line in lines:
            words = shlex.split(line, comments=True)
            if words[:1] != ["tendon-newton"] or words[1] not in VERBS:
                continue
            end = next((k for k, word in enumerate(words) if word in ("|", ">", "&&", "&")), None)
            try:
                assert "..." in words or tyro.cli(config_of(VERBS[words[1]]), args=words[2:end])
            except SystemExit:
                refused.append(f"{name}: {line}")
    assert refused == []
