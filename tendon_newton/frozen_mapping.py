"""Mappings of immutable records: read-only views that can be pickled and copied."""

import copyreg
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar

Key = TypeVar("Key")
Value = TypeVar("Value")


def frozen(mapping: Mapping[Key, Value]) -> Mapping[Key, Value]:
    """Return a read-only copy of a mapping."""
    return MappingProxyType(dict(mapping))


def reduce_view(view: "MappingProxyType[Any, Any]") -> tuple[Any, ...]:
    """Return what another process builds a view from: Python itself pickles none."""
    return frozen, (dict(view),)


copyreg.pickle(MappingProxyType, reduce_view)
