"""Networks from a window of servo signals to a force: one file each, one line each in the table."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Literal, get_args

from tendon_newton.errors import NameTable, look_up

if TYPE_CHECKING:
    from tendon_newton.force_networks.force_network import ForceNetwork

FORCE_NETWORKS = NameTable("network", {"mlp": "Mlp", "rnn": "Rnn", "transformer": "Transformer"})
"""Kind, which is also the name of its module here -> its class. The classes need torch, so a module
is imported when its network is asked for."""

SetName = Literal["paper", "authors", "matched"]
"""A set of networks whose sizes belong together.

``paper``: as Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), section II-B,
describe them; the sizes that the text leaves open (feed-forward layer and perceptron of the
Transformer) are those of the authors' published code. ``authors``: as in that code, where the
perceptron is another one, the Transformer has no causal mask and drops a tenth of its numbers in
training. ``matched``: numbers of parameters within 20 % of each other, as the paper asks for.
"""
SETS: tuple[SetName, ...] = get_args(SetName)


def find_force_network(kind: str) -> type[ForceNetwork]:
    """Return the class of a force network; an unknown kind is refused."""
    name = FORCE_NETWORKS[kind]
    return getattr(importlib.import_module(f"{__name__}.{kind}"), name)


def build_network(kind: str, *, of_set: str, window: int) -> ForceNetwork:
    """Return an untrained network.

    The kind is a key of `FORCE_NETWORKS`, the set one of `SETS`; the window counts samples.

    Raises:
        UnknownName: No such kind, or no sizes of it in this set.
    """
    family: Any = find_force_network(kind)  # each kind has sizes of its own
    return family(window, **look_up(f"set of sizes of {kind!r}", of_set, family.sizes))
