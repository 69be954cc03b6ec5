"""Small networks run by NumPy alone: a policy needs no inference engine of a hundred megabytes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.onnx_file import Node, OnnxFile

Array = NDArray[Any]
Operation = Callable[[Node, list[Array]], Array]


class UnsupportedOperation(ValueError):
    """A graph holds an operation that stands not in the table below."""


class NumpyNetwork:
    """Runs a graph of one input and one output.

    Args:
        file: The graph.

    Raises:
        UnsupportedOperation: It has an operation that NumPy is not taught.
    """

    def __init__(self, file: OnnxFile) -> None:
        unknown = sorted({node.operation for node in file.nodes} - set(OPERATIONS))
        if unknown:
            raise UnsupportedOperation(", ".join(unknown))
        if len(file.inputs) != 1 or len(file.outputs) != 1:
            raise UnsupportedOperation("more than one input or output")
        self._input, self._output = file.inputs[0], file.outputs[0]
        self._weights = dict(file.weights)
        self._steps = [(OPERATIONS[node.operation], node, node.outputs[0]) for node in file.nodes]

    def __call__(self, values: Array) -> Array:
        """Return what the network makes of its input."""
        known = self._weights | {self._input: values}
        for operation, node, output in self._steps:
            known[output] = operation(node, [known[name] for name in node.inputs if name])
        return known[self._output]


def number(node: Node, name: str, otherwise: float) -> float:
    """Return a setting of an operation."""
    value = node.attributes.get(name, otherwise)
    if not isinstance(value, int | float):
        raise TypeError(f"{name} of {node.operation} must be a number")
    return value


def gemm(node: Node, values: list[Array]) -> Array:
    """Return alpha A B + beta C, either matrix transposed where asked."""
    a, b, *rest = values
    a = a.T if number(node, "transA", 0) else a
    b = b.T if number(node, "transB", 0) else b
    product = np.float32(number(node, "alpha", 1.0)) * (a @ b)
    return product + np.float32(number(node, "beta", 1.0)) * rest[0] if rest else product


def elu(node: Node, values: list[Array]) -> Array:
    """Return x above zero and alpha (exp(x) - 1) below."""
    (x,) = values
    below = np.float32(number(node, "alpha", 1.0)) * np.expm1(np.minimum(x, 0.0))
    return np.where(x > 0.0, x, below)


def flatten(node: Node, values: list[Array]) -> Array:
    """Return rows and columns, cut at an axis."""
    (x,) = values
    axis = int(number(node, "axis", 1))
    rows = int(np.prod(x.shape[:axis], dtype=np.int64))
    return x.reshape(rows, -1)


def clip(node: Node, values: list[Array]) -> Array:
    """Return values within their bounds, which are inputs or settings."""
    x, *bounds = values
    low = bounds[0] if bounds else number(node, "min", -np.inf)
    high = bounds[1] if len(bounds) > 1 else number(node, "max", np.inf)
    return np.clip(x, low, high).astype(x.dtype)


def constant(node: Node, values: list[Array]) -> Array:
    """Return what stands in the graph."""
    return np.asarray(node.attributes["value"])


OPERATIONS: Mapping[str, Operation] = MappingProxyType(
    {
        "Add": lambda node, v: v[0] + v[1],
        "Clip": clip,
        "Constant": constant,
        "Div": lambda node, v: v[0] / v[1],
        "Elu": elu,
        "Flatten": flatten,
        "Gemm": gemm,
        "Identity": lambda node, v: v[0],
        "MatMul": lambda node, v: v[0] @ v[1],
        "Mul": lambda node, v: v[0] * v[1],
        "Relu": lambda node, v: np.maximum(v[0], 0.0),
        "Reshape": lambda node, v: v[0].reshape(v[1].tolist()),
        "Sigmoid": lambda node, v: (1.0 / (1.0 + np.exp(-v[0]))).astype(v[0].dtype),
        "Sub": lambda node, v: v[0] - v[1],
        "Tanh": lambda node, v: np.tanh(v[0]),
    }
)
"""What a policy's network may do, by ONNX's names."""
