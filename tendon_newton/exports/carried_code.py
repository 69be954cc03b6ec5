"""The code of effects and actuators as plain text, so that another program can carry it along.

An effect's device functions are plain Python; what they call in turn is, too. So an exported model
runs the very lines that the simulation runs, and a new effect needs no second version.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable
from typing import Any

from tendon_newton.device_code.templates import is_device_template

PROVIDED = ("Jet", "Values", "real", "wp", "Any", "TENDONS", "HELD_MEMORY", "ParameterVector")
"""Names that the program has of its own."""


class CarriedCode:
    """Functions to be carried, each once, with all that they call.

    Args:
        device: Whether they stay device code, with annotations, for a program that has Warp.
    """

    def __init__(self, *, device: bool = False) -> None:
        self._device = device
        self._names: dict[Any, str] = {}
        self._parts: list[str] = []

    def carry(self, function: Callable[..., Any], name: str) -> str:
        """Carry a device function and return the name that it has in the text."""
        if function.__code__ in self._names:
            return self._names[function.__code__]
        self._names[function.__code__] = name
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        definition: Any = tree.body[0]
        definition.name, definition.decorator_list = name, []
        if self._device:
            definition.decorator_list = [ast.parse("wp.func", mode="eval").body]
        else:
            definition.returns = None
            for argument in definition.args.args:
                argument.annotation = None
        renamed = {
            used: self._dependency(used, function.__globals__[used])
            for used in sorted({n.id for n in ast.walk(definition) if isinstance(n, ast.Name)})
            if used in function.__globals__ and used not in PROVIDED
        }
        for node in ast.walk(definition):
            if isinstance(node, ast.Name):
                node.id = renamed.get(node.id, node.id)
        self._parts.append(ast.unparse(definition))
        return name

    def add(self, text: str) -> None:
        """Add code that is text already, behind what it calls."""
        self._parts.append(text)

    def _dependency(self, name: str, value: Any) -> str:
        """Carry what a function calls or reads from its module."""
        if is_device_template(value):
            return self.carry(value, name)
        if isinstance(value, int | float) and f"{name} = {value!r}" not in self._parts:
            self._parts.append(f"{name} = {value!r}")
        return name

    def text(self) -> str:
        """Return all that is carried, what is called before what calls it."""
        return "\n\n\n".join(self._parts) + "\n"
