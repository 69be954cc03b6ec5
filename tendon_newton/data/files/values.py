"""Kinds of values that TOML and JSON know, as a type checker understands them."""

from typing import Any, TypeGuard


def is_table(value: Any) -> TypeGuard[dict[str, Any]]:
    """Tell whether a value is a table, an object in JSON."""
    return isinstance(value, dict)


def is_list(value: Any) -> TypeGuard[list[Any]]:
    """Tell whether a value is an array of anything."""
    return isinstance(value, list)


def are_tables(value: Any) -> TypeGuard[list[dict[str, Any]]]:
    """Tell whether a value is an array of tables, which may be empty."""
    return is_list(value) and all(isinstance(row, dict) for row in value)


def are_words(value: Any) -> TypeGuard[list[str]]:
    """Tell whether a value is an array of strings, which may be empty."""
    return is_list(value) and all(isinstance(word, str) for word in value)


def is_count(value: Any) -> TypeGuard[int]:
    """Tell whether a value is a whole number from 0 on."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0
