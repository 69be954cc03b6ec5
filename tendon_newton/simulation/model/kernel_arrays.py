"""Structs of arrays, as kernels take them."""

from typing import Any

import warp as wp

from tendon_newton.actuators.networks.history import History
from tendon_newton.device_code.structs import Samples
from tendon_newton.device_code.templates import Bindings


def zeros(
    types: Bindings, struct: type, *shape: int, device: Any, requires_grad: bool = False
) -> Any:
    """Return a struct whose arrays all have one shape, filled with zeros."""
    out = types[struct]()
    for name in types[struct].vars:
        dtype = types[struct].vars[name].type.dtype
        setattr(out, name, wp.zeros(shape, dtype=dtype, device=device, requires_grad=requires_grad))
    return out


def struct_of(types: Bindings, struct: type, **arrays: Any) -> Any:
    """Return a struct of some arrays; the others stay empty."""
    out = types[struct]()
    for name, array in arrays.items():
        setattr(out, name, array)
    return out


def samples_of(types: Bindings, history: History) -> Any:
    """Return what force networks have seen, as kernels write it."""
    return struct_of(types, Samples, ring=history.ring, newest=history.newest)
