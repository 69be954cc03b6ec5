"""A network file says what it is, is refused where it is wrong, and runs only if it is trusted."""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
import pytest
import torch
from safetensors.torch import load, save
from torch import Tensor, nn

from tendon_newton.actuators.networks.artifact import load_network
from tendon_newton.data.cards.force_network_card import PLAIN_HOLD, ForceNetworkCard
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.files.trust import trust_content, trust_file, trusted_hashes
from tendon_newton.errors import InvalidNetworkFile, UntrustedNetworkFile
from tendon_newton.force_networks import build_network
from tendon_newton.force_networks.force_network import ForceNetwork, parameter_count
from tendon_newton.force_networks.transformer import Transformer
from tendon_newton.mechanisms.asset_library import asset_folder
from tests.train.actuator.network_files import (
    card_of,
    with_card,
    write_file,
    write_foreign,
    written,
)

PACKAGED = tuple((asset_folder() / "networks").glob("*.safetensors"))


class Constant(nn.Module):
    """A network of another program: any shape or value."""

    def __init__(self, value: float, columns: int) -> None:
        super().__init__()
        self.value = value
        self.columns = columns

    def forward(self, window: Tensor) -> Tensor:
        """Return the same for every window."""
        return torch.full((window.shape[0], self.columns), self.value)


def test_a_strange_file_does_not_run_until_it_is_trusted(tmp_path, own_trust, monkeypatch) -> None:
    """Made elsewhere, a file is refused with its hash; --trust is remembered, the variable not."""
    path = write_file(tmp_path / "network.pt")
    trust_file().unlink()
    with pytest.raises(UntrustedNetworkFile, match=r"SHA-256 [0-9a-f]{64}") as refusal:
        load_network(path)
    digest = str(refusal.value).split("SHA-256 ")[1][:64]
    monkeypatch.setenv("TENDON_NEWTON_TRUST", f"{'a' * 64}, {digest}")
    load_network(path)
    monkeypatch.delenv("TENDON_NEWTON_TRUST")
    load_network(path, trust=True)
    assert load_network(path).sha256 == digest
    assert trust_file().is_relative_to(own_trust)
    assert trusted_hashes() == {digest}


def test_a_changed_file_is_no_longer_trusted(tmp_path: Path) -> None:
    """Another card around the same weights is another file, which nobody has trusted."""
    path = write_file(tmp_path / "network.pt")
    load_network(path)
    with_card(path, card_of(force_limit=30.0).to_json())
    with pytest.raises(UntrustedNetworkFile):
        load_network(path)


def test_a_network_of_the_program_runs_without_trust(own_trust: Path) -> None:
    """What is shipped holds weights alone, so that there is nothing to trust."""
    files = sorted((asset_folder() / "networks").glob("*"))
    assert {path.suffix for path in files} == {".onnx", ".safetensors"}
    for path in PACKAGED:
        file = load_network(path)
        assert file.card.purpose == "simulation"
        assert file.card.hold.damping > 0.0
        assert file.card.held_out is not None
    assert not trust_file().exists()


def test_the_name_of_a_trusted_file_trusts_nothing(tmp_path: Path, own_trust: Path) -> None:
    """A harmless file may be named as the hash of another: only the first word of a line counts."""
    path = write_file(tmp_path / "network.pt")
    digest = load_network(path).sha256
    trust_file().unlink()
    trust_content(b"harmless", f"{digest}.pt")
    trust_content(b"harmless too", f"a\n{digest} .pt")
    assert trusted_hashes() == {content_hash(b"harmless"), content_hash(b"harmless too")}
    with pytest.raises(UntrustedNetworkFile):
        load_network(path)


@pytest.mark.parametrize("path", PACKAGED)
def test_the_onnx_file_of_a_network_of_the_program_is_the_same_network(path: Path) -> None:
    """The same card, and the same tensions to rounding."""
    import onnxruntime

    file = load_network(path)
    session = onnxruntime.InferenceSession(path.with_suffix(".onnx"))
    text = session.get_modelmeta().custom_metadata_map["card"]
    card = ForceNetworkCard.from_json(text)
    assert (card.hold, card.training) == (file.card.hold, file.card.training)
    windows = torch.rand(9, card.window, 3)
    (tension,) = session.run(None, {"window": windows.numpy()})
    np.testing.assert_allclose(tension, file.module(windows).numpy(force=True), atol=1e-4)


def test_a_file_cut_short_is_named(tmp_path: Path) -> None:
    """Wherever it ends too early, the message says that it is damaged, and nothing runs."""
    path = write_file(tmp_path / "network.pt", "rnn")
    content = path.read_bytes()
    for size in (0, 1, 100, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:size])
        with pytest.raises(InvalidNetworkFile, match=r"network\.pt: .*(damaged|one card)"):
            load_network(path, trust=True)


def test_an_archive_that_claims_more_than_it_has_is_refused_before_it_is_unpacked(tmp_path) -> None:
    """16 MB of zeros packed a thousandfold: 90 s of unpacking, before the question of trust."""
    path = write_file(tmp_path / "network.pt")
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("network/data/bomb", bytes(1 << 28))
    began = process_time()
    with pytest.raises(UntrustedNetworkFile):
        load_network(path)
    with pytest.raises(InvalidNetworkFile, match=r"network\.pt: .* packs to a 10th at most"):
        load_network(path, trust=True)
    assert process_time() - began < 1.0


@pytest.mark.parametrize(
    ("module", "card", "said"),
    [
        (Constant(1.0, 1), None, "one card, extra/card.json"),
        (Constant(1.0, 1), "{", "card: must be JSON"),
        (Constant(1.0, 1), "[]", "card: must be a JSON object"),
        (Constant(1.0, 1), card_of().to_json(), r"one tension per window of 30 samples"),
    ],
)
def test_a_foreign_file_is_refused(tmp_path, module, card, said) -> None:
    """TorchScript of other programs has no card, or not the network that the card promises."""
    path = write_foreign(tmp_path / "foreign.pt", module, card)
    with pytest.raises(InvalidNetworkFile, match=said):
        load_network(path, trust=True)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("schema", 2, "schema must be 1; it is 2"),
        ("units", ["deg", "rad", "rad/s", "N"], "units must be"),
        ("inputs", ["theta", "theta_d", "theta_dot"], "inputs must be"),
        ("kind", "nonesuch", "kind must be one of mlp, rnn, .*; it is 'nonesuch'"),
        ("kind", "../mlp", "kind must be a name in small letters"),
        ("window", 20, "must take windows of 20 samples"),
        ("window", 0, "window must be 1 to 10000 samples"),
        ("window", 29.5, "window must be a whole number; it is 29.5"),
        ("rate_hz", 0.0, "rate_hz must be"),
        ("rate_hz", "fast", "rate_hz must be a finite number; it is 'fast'"),
        ("force_limit_n", -1.0, "force_limit_n must be"),
        ("purpose", "fun", "purpose must be one of prediction, simulation; it is 'fun'"),
        ("hold", {"damping_n_s_per_rad": -1.0}, "damping of hold must be 0 to 1000; it is -1.0"),
        ("hold", [], "hold must be an object"),
        ("bounds", {}, "bounds must hold theta_d"),
        ("bounds", {"theta_d": [1.0, None]}, "bounds: theta_d must be 2 finite numbers"),
        ("bounds", {"theta_d": [1.0]}, "bounds: theta_d must be 2 finite numbers"),
        ("force_limit_n", 10**400, "force_limit_n must be a finite number"),
        ("training", None, "training must be an object; it is None"),
        ("held_out", {"force_rmse": 1.0}, "wrong type|missing"),
    ],
)
def test_a_card_that_cannot_be_kept_is_refused(tmp_path, key, value, said) -> None:
    """Each promise of the card is checked, and the message names the key."""
    path = write_file(tmp_path / "network.pt")
    with_card(path, json.dumps(json.loads(card_of().to_json()) | {key: value}))
    with pytest.raises(InvalidNetworkFile, match=said):
        load_network(path, trust=True)


def test_a_card_without_a_hold_is_the_papers(tmp_path: Path) -> None:
    """Networks of before: made for prediction, and held as they are between two queries."""
    table = json.loads(card_of().to_json())
    del table["hold"]
    assert "purpose" not in table, "defaults are left out"
    path = with_card(write_file(tmp_path / "network.pt"), json.dumps(table))
    card = load_network(path, trust=True).card
    assert (card.hold, card.purpose) == (PLAIN_HOLD, "prediction")


def test_a_missing_key_is_named(tmp_path: Path) -> None:
    """A card without its rate says so."""
    table = json.loads(card_of().to_json())
    del table["rate_hz"]
    path = with_card(write_file(tmp_path / "network.pt"), json.dumps(table))
    with pytest.raises(InvalidNetworkFile, match="rate_hz must be a finite number; it is missing"):
        load_network(path)


def test_a_network_for_other_windows_is_found_by_a_test_call(tmp_path: Path) -> None:
    """The card says 30 samples, the network takes 20."""
    path = write_file(tmp_path / "network.pt", window=20)
    with pytest.raises(InvalidNetworkFile, match="window of 30 samples"):
        load_network(path)


def test_no_file_is_named(tmp_path: Path) -> None:
    """A path that leads nowhere, or to a folder, says so."""
    with pytest.raises(InvalidNetworkFile, match="no such file"):
        load_network(tmp_path / "none.pt")
    with pytest.raises(InvalidNetworkFile, match="it is a folder"):
        load_network(tmp_path)


Change = Callable[[dict[str, torch.Tensor], dict[str, str]], None]

CHANGES: dict[str, tuple[Change, str]] = {
    "a weight too few": (lambda w, m: w.__delitem__("head.4.bias"), "head.4.bias"),
    "a weight too many": (lambda w, m: w.update(extra=torch.zeros(1)), "extra has the shape"),
    "another width": (lambda w, m: w.update({"project.bias": torch.zeros(8)}), "project.bias"),
    "no head": (lambda w, m: w.__delitem__("positions"), "positions"),
    "no card": (lambda w, m: m.__delitem__("card"), "has the key 'card'"),
    "no settings": (lambda w, m: m.__delitem__("network"), "'heads'"),
    "no numbers": (lambda w, m: w.update({"head.4.bias": torch.tensor([np.nan])}), "finite"),
    "heads for ever": (lambda w, m: m.update(network='{"heads": 10000000}'), "10000000 heads"),
    "heads of none": (lambda w, m: m.update(network='{"heads": 0}'), "0 heads"),
    "deep settings": (lambda w, m: m.update(network=100_000 * "["), "must hold the weights"),
    "a window of gigabytes": (
        lambda w, m: m.update(card=json.dumps(json.loads(m["card"]) | {"window": 10_000})),
        "4 heads on 16 numbers of 10000 samples",
    ),
}


@pytest.mark.parametrize("case", CHANGES)
def test_weights_that_are_none_of_a_network_are_refused(tmp_path: Path, case: str) -> None:
    """Before memory is taken for what the file claims, the names and shapes must agree."""
    change, said = CHANGES[case]
    path = written(tmp_path / "network.safetensors")
    content = path.read_bytes()
    weights = load(content)
    head = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
    metadata = head["__metadata__"]
    change(weights, metadata)
    path.write_bytes(save(weights, metadata))
    with pytest.raises(InvalidNetworkFile, match=said):
        load_network(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"junk",
        b"\xff" * 100,
        (8).to_bytes(8, "little") + b"{}",
        bytes(1 << 20),
        (20).to_bytes(8, "little") + b"[[[[[[[[[[[[[[[[[[[[[[[[",
    ],
)
def test_a_file_that_is_none_is_named(tmp_path: Path, content: bytes) -> None:
    """Whatever the head claims."""
    path = tmp_path / "network.safetensors"
    path.write_bytes(content)
    with pytest.raises(InvalidNetworkFile, match=r"network\.safetensors: "):
        load_network(path)


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
