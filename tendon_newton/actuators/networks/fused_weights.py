"""A Transformer's weights as its fused kernel reads them: one array, products taken beforehand."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.recording import Array

LAYERS = 2
HEAD_WIDTHS = (8, 4, 1)  # Units of the perceptron at the end
ALIGNED = 4  # Numbers that a GPU loads at once, from a multiple of their size


# Window, width, heads, units of the feed-forward layer, causality, places of the blocks
Shape = tuple[int, int, int, int, bool, tuple[tuple[str, int], ...]]


@dataclass(frozen=True, kw_only=True)
class FusedWeights:
    """All numbers of a Transformer with two layers, and where each block of them begins."""

    values: NDArray[np.float32]  # The blocks one after the other
    # Block -> place of its first number; those of a layer count from the layer's place
    places: Mapping[str, int]
    window: int
    width: int
    heads: int
    feed: int
    causal: bool

    @property
    def shape(self) -> Shape:
        """What decides the code of the kernel."""
        places = tuple(self.places.items())
        return (self.window, self.width, self.heads, self.feed, self.causal, places)


class NoFusedKernel(Exception):
    """The network has no fused kernel; the message says why."""


def is_transformer(module: Any) -> bool:
    """Say whether a network has encoder layers, which are this file's part."""
    return any(name.startswith("encoder.") for name, _ in tensors(module))


def fused_weights(module: Any) -> FusedWeights:
    """Read a Transformer's weights by name.

    The input's normalisation, projection and places go into one matrix and one constant per place,
    the first layer's queries, keys and values too; the output's normalisation goes into the last
    linear layer, the logits' scale into the queries.

    Raises:
        NoFusedKernel: The network has other layers.
    """
    state = {name: tensor.detach().cpu().double().numpy() for name, tensor in tensors(module)}
    needed = ("project.weight", "encoder.1.query_key_value.weight", "head.4.weight", "mask")
    if any(name not in state for name in needed) or f"encoder.{LAYERS}.mix.weight" in state:
        raise NoFusedKernel(
            f"it is no Transformer of {LAYERS} layers with weights of the known names"
        )
    window, width = state["positions"].shape
    heads = int(dict(module.named_modules())["encoder.0"].heads)
    widths = tuple(len(state[f"head.{k}.bias"]) for k in (0, 2, 4))
    hidden = np.triu(np.ones((window, window), dtype=bool), 1)
    causal = bool(np.all(np.isneginf(state["mask"][hidden]))) and window > 1
    if widths != HEAD_WIDTHS or not (causal or not state["mask"].any()):
        raise NoFusedKernel("its perceptron or its mask is of another form")
    inputs = state["project.weight"] / state["input_scale"]
    shift = state["project.bias"] - inputs @ state["input_mean"]
    place = state["positions"] + shift
    first, first_bias = query_key_value(state, 0, heads)
    second, second_bias = query_key_value(state, 1, heads)
    blocks = {
        "inputs": inputs,
        "inputs_place": place,
        "samples": first @ inputs,
        "places": place @ first.T + first_bias,
        "second": second,
        "second_bias": second_bias,
        "head_1": state["head.0.weight"],
        "head_1_bias": state["head.0.bias"],
        "head_2": state["head.2.weight"],
        "head_2_bias": state["head.2.bias"],
        "head_3": state["head.4.weight"] * state["force_scale"],
        "head_3_bias": state["head.4.bias"] * state["force_scale"] + state["force_mean"],
    }
    values, places = laid_out(blocks, 0)
    for layer in range(LAYERS):
        block, inner = laid_out(layer_blocks(state, layer), 0)
        places |= {f"layer_{layer + 1}": len(values), **inner}
        values = np.concatenate([values, block])
    return FusedWeights(
        values=values.astype(np.float32),
        places=places,
        window=window,
        width=width,
        heads=heads,
        feed=len(state["encoder.0.feed_1.bias"]),
        causal=causal,
    )


def tensors(module: Any) -> list[tuple[str, Any]]:
    """Return all parameters and buffers of a module with their names."""
    return [*module.named_parameters(), *module.named_buffers()]


def query_key_value(state: Mapping[str, Array], layer: int, heads: int) -> tuple[Array, Array]:
    """Return the matrix and the bias of a layer's queries, keys and values, queries scaled."""
    matrix = state[f"encoder.{layer}.query_key_value.weight"].copy()
    bias = state[f"encoder.{layer}.query_key_value.bias"].copy()
    width = matrix.shape[1]
    scale = 1.0 / np.sqrt(width / heads)
    matrix[:width] *= scale
    bias[:width] *= scale
    return matrix, bias


def layer_blocks(state: Mapping[str, Array], layer: int) -> dict[str, Array]:
    """Return what follows a layer's attention."""
    name = f"encoder.{layer}"
    return {
        "mix": state[f"{name}.mix.weight"],
        "mix_bias": state[f"{name}.mix.bias"],
        "norm_1": np.stack([state[f"{name}.norm_1.weight"], state[f"{name}.norm_1.bias"]]),
        "feed_1": state[f"{name}.feed_1.weight"],
        "feed_1_bias": state[f"{name}.feed_1.bias"],
        "feed_2": state[f"{name}.feed_2.weight"].T,
        "feed_2_bias": state[f"{name}.feed_2.bias"],
        "norm_2": np.stack([state[f"{name}.norm_2.weight"], state[f"{name}.norm_2.bias"]]),
    }


def laid_out(blocks: Mapping[str, Array], begin: int) -> tuple[Array, dict[str, int]]:
    """Return blocks one after the other and where each begins, at a multiple of `ALIGNED`."""
    places, parts, at = {}, [], begin
    for name, block in blocks.items():
        places[name] = at
        parts.append(np.pad(np.ravel(block), (0, -block.size % ALIGNED)))
        at += parts[-1].size
    return np.concatenate(parts), places
