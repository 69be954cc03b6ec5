"""The list of mistakes fits the tree that it is made in; `python -m tests.mutations` makes them."""

import ast
import shlex

import pytest

from tests.mutations import MUTATIONS, ROOT, Mutation


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.name)
def test_a_mistake_can_still_be_made(mutation: Mutation) -> None:
    """Its text stands once in its file, which is a program with the other text as well."""
    whole = (ROOT / mutation.file).read_text(encoding="utf-8")
    assert whole.count(mutation.old) == 1
    assert mutation.new != mutation.old
    ast.parse(whole.replace(mutation.old, mutation.new))


@pytest.mark.parametrize("file", sorted({shlex.split(mutation.tests)[0] for mutation in MUTATIONS}))
def test_the_tests_of_a_mistake_are_there(file: str) -> None:
    """The file of each selection exists."""
    assert (ROOT / file).is_file()


def test_names_are_given_once() -> None:
    """An entry is asked for by its name."""
    names = [mutation.name for mutation in MUTATIONS]
    assert len(set(names)) == len(names)
