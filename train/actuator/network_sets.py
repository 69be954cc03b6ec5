"""The networks that can be trained, in named sets of comparable ones.

``paper``: as Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), section II-B,
describe them. The sizes that the text leaves open (feed-forward layer and perceptron of the
Transformer) are those of the authors' published code. ``authors``: as in that code, where the
perceptron is another one, the Transformer has no causal mask and drops a tenth of its numbers in
training. ``matched``: numbers of parameters within 20 % of each other, as the paper asks for.
"""

from collections.abc import Callable
from functools import partial

from tendon_newton.errors import unknown_name
from tendon_newton.force_networks.force_network import ForceNetwork
from tendon_newton.force_networks.mlp import Mlp
from tendon_newton.force_networks.rnn import Rnn
from tendon_newton.force_networks.transformer import Transformer

Maker = Callable[[int], ForceNetwork]
"""(samples in a window) -> an untrained network."""

NETWORK_SETS: dict[str, dict[str, Maker]] = {
    "paper": {
        "mlp": partial(Mlp, widths=(256, 128, 64)),
        "rnn": partial(Rnn, width=64),
        "transformer": Transformer,
    },
    "authors": {
        "mlp": partial(Mlp, widths=(256, 64, 16), activation="tanh"),
        "rnn": partial(Rnn, width=64),
        "transformer": partial(Transformer, causal=False, dropout=0.1),
    },
    "matched": {
        "mlp": partial(Mlp, widths=(56, 24, 8)),
        "rnn": partial(Rnn, width=80),
        "transformer": Transformer,
    },
}


def build_network(kind: str, *, of_set: str, window: int) -> ForceNetwork:
    """Return an untrained network.

    Raises:
        UnknownName: No such set, or none of this kind in it.
    """
    if of_set not in NETWORK_SETS:
        raise unknown_name("set of networks", of_set, NETWORK_SETS)
    if kind not in NETWORK_SETS[of_set]:
        raise unknown_name("network", kind, NETWORK_SETS[of_set])
    return NETWORK_SETS[of_set][kind](window)
