"""The networks are those of the paper, in every form in which they run."""

import pytest
import torch

from tendon_newton.force_networks import SETS, build_network
from tendon_newton.force_networks.force_network import ForceNetwork, parameter_count
from tendon_newton.force_networks.transformer import Transformer


def made(kind: str, of_set: str = "paper", window: int = 30) -> ForceNetwork:
    """Build a network with a normalisation that is not the identity."""
    torch.manual_seed(1)
    network = build_network(kind, of_set=of_set, window=window)
    signals = torch.randn(500, 3) * torch.tensor([2.0, 0.5, 3.0]) + torch.tensor([3.0, 1.0, 0.1])
    network.normalise_as(signals, 5.0 * torch.rand(500) + 6.0)
    return network.eval()


def windows(count: int = 64, window: int = 30) -> torch.Tensor:
    """Draw windows of credible signals."""
    torch.manual_seed(2)
    return torch.randn(count, window, 3) * torch.tensor([2.0, 0.5, 3.0]) + 1.0


@pytest.mark.parametrize(
    ("of_set", "kind", "count"),
    [
        ("paper", "mlp", 64_513),
        ("paper", "rnn", 4_481),
        ("paper", "transformer", 6_801),
        ("authors", "mlp", 40_801),
        ("authors", "transformer", 6_801),
    ],
)
def test_the_networks_have_the_published_sizes(of_set: str, kind: str, count: int) -> None:
    """Counts follow from the layer widths in the paper and in the authors' code."""
    assert parameter_count(build_network(kind, of_set=of_set, window=30)) == count


def test_a_network_is_given_numbers_about_one() -> None:
    """Mean and scale are those of the training data: every input comes in about 0 and of size 1."""
    torch.manual_seed(3)
    network = build_network("mlp", of_set="paper", window=30)
    signals = torch.randn(6000, 3) * torch.tensor([2.0, 0.05, 30.0]) + torch.tensor([3.0, 1.0, 0.1])
    force = 5.0 * torch.rand(6000) + 6.0
    network.normalise_as(signals, force)
    inputs = network.normalised(signals.reshape(200, 30, 3)).reshape(-1, 3)
    torch.testing.assert_close(inputs.mean(dim=0), torch.zeros(3), atol=1e-4, rtol=0.0)
    torch.testing.assert_close(inputs.std(dim=0), torch.ones(3), atol=1e-4, rtol=0.0)
    standard = ((force - force.mean()) / force.std())[:, None]
    torch.testing.assert_close(network.tension(standard), force, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("of_set", SETS)
def test_the_last_query_is_enough(of_set: str) -> None:
    """Computing only the last sample of the last layer gives the same tension to 1e-6 of it."""
    network = made("transformer", of_set)
    assert isinstance(network, Transformer)
    with torch.no_grad():
        torch.testing.assert_close(
            network.last_query(windows()), network(windows()), rtol=1e-6, atol=1e-6
        )


def test_attention_is_that_of_torch() -> None:
    """One encoder layer equals ``nn.TransformerEncoderLayer`` with the same weights."""
    network = made("transformer")
    assert isinstance(network, Transformer)
    ours = network.encoder[0]
    torch.manual_seed(3)
    theirs = torch.nn.TransformerEncoderLayer(16, 4, 64, dropout=0.0, batch_first=True)
    names = {
        "self_attn.in_proj_weight": "query_key_value.weight",
        "self_attn.in_proj_bias": "query_key_value.bias",
        "self_attn.out_proj.weight": "mix.weight",
        "self_attn.out_proj.bias": "mix.bias",
        "linear1.weight": "feed_1.weight",
        "linear1.bias": "feed_1.bias",
        "linear2.weight": "feed_2.weight",
        "linear2.bias": "feed_2.bias",
        "norm1.weight": "norm_1.weight",
        "norm1.bias": "norm_1.bias",
        "norm2.weight": "norm_2.weight",
        "norm2.bias": "norm_2.bias",
    }
    weights = ours.state_dict()
    theirs.load_state_dict({name: weights[own] for name, own in names.items()})
    x = torch.randn(5, 30, 16)
    expected = theirs(x, src_mask=network.mask)  # in training mode: the path without shortcuts
    torch.testing.assert_close(ours(x, network.mask, False), expected, rtol=1e-5, atol=1e-6)


def test_a_causal_layer_does_not_look_ahead() -> None:
    """Changing the last sample changes no earlier one; without the mask it changes all."""
    for of_set, causal in (("paper", True), ("authors", False)):
        network = made("transformer", of_set)
        assert isinstance(network, Transformer)
        x, layer = torch.randn(1, 30, 16), network.encoder[0]
        changed = x.clone()
        changed[:, -1] += 1.0
        with torch.no_grad():
            before, after = layer(x, network.mask, False), layer(changed, network.mask, False)
        same = torch.equal(before[:, :-1], after[:, :-1])
        assert same is causal


def test_order_matters_to_a_transformer() -> None:
    """Positions are told apart: a window read backwards gives another tension."""
    network = made("transformer")
    with torch.no_grad():
        there, back = network(windows()), network(windows().flip(1))
    assert not torch.allclose(there, back, atol=1e-3)
