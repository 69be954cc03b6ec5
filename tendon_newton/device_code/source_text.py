"""The text of device functions, which Python would look for and read anew at each question."""

import ast
import inspect
import textwrap
from collections.abc import Callable
from functools import cache
from typing import Any


@cache
def text_of(function: Callable[..., Any]) -> str:
    """Return the text of a function."""
    return inspect.getsource(function)


@cache
def syntax_of(function: Callable[..., Any]) -> ast.Module:
    """Return the syntax of a function; its first line is 1."""
    return ast.parse(textwrap.dedent(text_of(function)))


def place_of(function: Callable[..., Any], node: ast.expr) -> str:
    """Return file and line of a part of a function's syntax."""
    line = function.__code__.co_firstlineno + node.lineno - 1
    return f"{function.__code__.co_filename}:{line}"
