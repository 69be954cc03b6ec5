"""Which arguments of a device function Warp passes by reference: large ones that it only reads.

Warp copies an argument with each call that its compiler does not inline. A world's structs have
2 KB, and on a GPU the copies of one step of a hand took 47 KB of a thread's memory. A reference
takes 8 bytes.

Source: `warp.ref` in Warp's documentation. What is passed by reference must have a place in memory:
a variable or a field, not the result of a call.
"""

import ast
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import warp as wp

from tendon_newton.device_code.source_text import place_of, syntax_of
from tendon_newton.errors import InvalidDeviceCode

REFERENCE: type = type(wp.ref[wp.float64])  # What Warp makes of a type that is passed by reference
LEAST_LENGTH = 16  # Numbers [1] of the smallest vector or matrix that is worth a reference


def by_reference(function: Callable[..., Any], kinds: Mapping[str, Any]) -> dict[str, Any]:
    """Return the types of a device function, large arguments that it only reads as `ref`."""
    written = written_places(function)

    def passed(name: str, kind: Any) -> Any:
        refers = name != "return" and is_large(kind) and is_only_read(name, kind, written)
        return wp.ref[kind] if refers else kind

    return {name: passed(name, kind) for name, kind in kinds.items()}


def check_calls(function: Callable[..., Any], scope: Mapping[str, Any]) -> None:
    """Refuse a device function that passes the result of a call by reference.

    Raises:
        InvalidDeviceCode: It does; the message names both functions, the argument and the line.
    """
    for node in _calls(function):
        name = node.func.id
        kinds = getattr(scope.get(name), "input_types", None) or {}
        for (argument, kind), given in zip(kinds.items(), node.args, strict=False):
            has_place = isinstance(given, (ast.Name, ast.Attribute, ast.Subscript))
            if isinstance(kind, REFERENCE) and not has_place:
                raise InvalidDeviceCode(
                    f"{function.__qualname__} gives {ast.unparse(given)} to {name} as {argument}, "
                    f"which is passed by reference; assign it to a variable first "
                    f"({place_of(function, node)})"
                )


@cache
def written_places(function: Callable[..., Any]) -> frozenset[tuple[str, str]]:
    """Return what a device function writes: variables, each with its field or an empty string."""
    nodes = ast.walk(syntax_of(function))
    return frozenset(_place(n) for n in nodes if isinstance(getattr(n, "ctx", None), ast.Store))


def is_only_read(name: str, kind: Any, written: frozenset[tuple[str, str]]) -> bool:
    """Tell whether an argument is only read; items of an array do not belong to its struct.

    A function that nothing calls may write a field that its struct does not have here.
    """
    fields = {field for variable, field in written if variable == name}
    has = getattr(kind, "vars", {})
    return all(f and (f not in has or wp.types.is_array(has[f].type)) for f in fields)


def is_large(kind: Any) -> bool:
    """Tell whether a Warp type is a struct, or a vector or matrix of `LEAST_LENGTH` or more."""
    is_struct = hasattr(kind, "vars")
    return is_struct or getattr(kind, "_length_", 0) >= LEAST_LENGTH


@cache
def _calls(function: Callable[..., Any]) -> list[Any]:
    """Return where a function calls another by its name."""
    nodes = ast.walk(syntax_of(function))
    return [n for n in nodes if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]


def _place(node: ast.AST) -> tuple[str, str]:
    """Return the variable of `x`, `x.field` or `x[index]`, and the field or an empty string."""
    field = ""
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        field = node.attr if isinstance(node, ast.Attribute) else field
        node = node.value
    return (node.id if isinstance(node, ast.Name) else "", field)
