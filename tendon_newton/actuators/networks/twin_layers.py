"""Weights of perceptrons and recurrent networks as their compiled twins read them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.actuators.networks.twin_weights import NoTwin, tensors
from tendon_newton.data.recording import Array

SIDE_BY_SIDE = 4
"""Units whose sums a kernel forms at the same time."""


@dataclass(frozen=True, kw_only=True)
class TwinLayers:
    """Fully connected layers with one activation, the last with one unit and none."""

    values: NDArray[np.float32]
    """The layers one after the other: four biases, then four weights of each input, and so on."""
    layout: NDArray[np.int32]
    """Place of the first number, inputs and units of each layer, shape (layers, 3)."""
    window: int
    tanh: bool
    """Whether the activation is the hyperbolic tangent; else it is the positive part."""
    recurrent: bool
    """Whether the first layer's units are inputs of its own, before those of a sample."""

    @property
    def widest(self) -> int:
        """Most numbers that go into a layer or come out of it."""
        return int(self.layout[:, 1:].max())


@dataclass(frozen=True, kw_only=True)
class Layer:
    """One layer: units, shape (U,), from inputs, shape (I,)."""

    weight: Array
    """Shape (U, I)."""
    bias: Array
    """Shape (U,)."""


def twin_layers(module: Any) -> TwinLayers:
    """Read the weights of a perceptron or of a recurrent network by name.

    The input's normalisation goes into the first layer, the output's into the last.

    Raises:
        NoTwin: The network has other layers.
    """
    state = {name: tensor.detach().cpu().double().numpy() for name, tensor in tensors(module)}
    if "cell.weight_hh_l0" in state:
        return recurrent_layers(state, int(module.window))
    if "layers.0.weight" in state:
        return perceptron_layers(state, int(module.window), activation_of(module))
    raise NoTwin("its weights have no names that a twin knows")


def activation_of(module: Any) -> str:
    """Return the name of the class of a perceptron's activations."""
    names = {
        getattr(part, "original_name", type(part).__name__)
        for name, part in module.named_modules()
        if name.startswith("layers.") and not list(part.parameters())
    }
    if len(names) != 1 or not names <= {"ReLU", "Tanh"}:
        raise NoTwin(f"its activations are {', '.join(sorted(names)) or 'none'}, not ReLU or Tanh")
    return names.pop()


def perceptron_layers(state: Mapping[str, Array], window: int, activation: str) -> TwinLayers:
    """Return the layers of a network over the flattened window."""
    numbers = sorted(int(name.split(".")[1]) for name in state if name.endswith("weight"))
    layers = [
        Layer(weight=state[f"layers.{k}.weight"], bias=state[f"layers.{k}.bias"]) for k in numbers
    ]
    mean, scale = (np.tile(state[name], window) for name in ("input_mean", "input_scale"))
    first = layers[0].weight / scale
    layers[0] = Layer(weight=first, bias=layers[0].bias - first @ mean)
    layers[-1] = with_units_of_force(layers[-1], state)
    return laid_out(layers, window=window, tanh=activation == "Tanh", recurrent=False)


def recurrent_layers(state: Mapping[str, Array], window: int) -> TwinLayers:
    """Return the layer that makes a state of the state before and a sample, and the last one."""
    if "cell.weight_hh_l1" in state:
        raise NoTwin("it has several recurrent layers, not one")
    of_sample = state["cell.weight_ih_l0"] / state["input_scale"]
    bias = state["cell.bias_ih_l0"] + state["cell.bias_hh_l0"] - of_sample @ state["input_mean"]
    cell = Layer(weight=np.hstack([state["cell.weight_hh_l0"], of_sample]), bias=bias)
    readout = Layer(weight=state["readout.weight"], bias=state["readout.bias"])
    layers = [cell, with_units_of_force(readout, state)]
    return laid_out(layers, window=window, tanh=True, recurrent=True)


def with_units_of_force(layer: Layer, state: Mapping[str, Array]) -> Layer:
    """Return a last layer whose unit is a force [N]."""
    scale, mean = state["force_scale"], state["force_mean"]
    return Layer(weight=layer.weight * scale, bias=layer.bias * scale + mean)


def laid_out(layers: Sequence[Layer], *, window: int, tanh: bool, recurrent: bool) -> TwinLayers:
    """Write layers one after the other as the kernels read them."""
    parts: list[Array] = []
    layout: list[tuple[int, int, int]] = []
    for layer in layers:
        units, inputs = layer.weight.shape
        last = layer is layers[-1]
        if units % SIDE_BY_SIDE and not last:
            raise NoTwin(f"a layer has {units} units; the twin takes {SIDE_BY_SIDE} at a time")
        rows = np.column_stack([layer.bias, layer.weight])
        groups = rows.reshape(-1, 1 if last else SIDE_BY_SIDE, inputs + 1)
        layout.append((sum(map(len, parts)), inputs, units))
        parts.append(groups.transpose(0, 2, 1).ravel())
    return TwinLayers(
        values=np.concatenate(parts).astype(np.float32),
        layout=np.array(layout, dtype=np.int32),
        window=window,
        tanh=tanh,
        recurrent=recurrent,
    )
