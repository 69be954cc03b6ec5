"""Finds fields that a struct does not have, before Warp compiles the function that reads them."""

import ast
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from tendon_newton.device_code.source_text import place_of, syntax_of
from tendon_newton.errors import InvalidDeviceCode


@dataclass(frozen=True)
class FieldUse:
    """A place where a device function reads or writes a field of a struct."""

    struct: type  # Declaration of the struct
    field: str  # Name of the field
    place: str  # File and line


@cache
def field_uses(
    template: Callable[..., Any], is_struct: Callable[[Any], bool]
) -> tuple[FieldUse, ...]:
    """Return the fields that a device function reads or writes."""
    function = syntax_of(template)
    structs = structs_of(function, template.__globals__, is_struct)
    uses = []
    for node in ast.walk(function):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            struct = structs.get(node.value.id)
            if struct is not None:
                place = place_of(template, node)
                uses.append(FieldUse(struct=struct, field=node.attr, place=place))
    return tuple(uses)


def check_fields(template: Callable[..., Any], is_struct: Callable[[Any], bool]) -> None:
    """Refuse a device function that reads or writes a field which its struct does not have.

    Raises:
        InvalidDeviceCode: It does; the message names function, struct, field and line.
    """
    for use in field_uses(template, is_struct):
        known = use.struct.__annotations__
        if use.field not in known:
            raise InvalidDeviceCode(
                f"{template.__qualname__} asks a {use.struct.__name__} for {use.field!r}; it has "
                f"{', '.join(known)} ({use.place})"
            )


def structs_of(
    function: ast.AST, scope: dict[str, Any], is_struct: Callable[[Any], bool]
) -> dict[str, type]:
    """Return the struct of each variable: as annotated, as made, as returned, or as copied."""

    def named(node: ast.expr | None) -> Any:
        value = scope.get(node.id) if isinstance(node, ast.Name) else None
        return value if is_struct(value) else None

    def made(node: ast.expr) -> Any:
        if isinstance(node, ast.Name):
            return found.get(node.id)
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
            return None
        returned = getattr(scope.get(node.func.id), "__annotations__", {}).get("return")
        return named(node.func) or named(ast.Name(id=getattr(returned, "__name__", str(returned))))

    found: dict[str, type] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.arg) and named(node.annotation):
            found[node.arg] = named(node.annotation)
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            struct = made(node.value)
            if struct is not None:
                found[node.targets[0].id] = struct
    return found
