"""What every force network of the table promises; a new one is tested unasked."""

from pathlib import Path

import numpy as np
import pytest
import torch

from tendon_newton.actuators.networks.artifact import load_network, torchscript, write_network
from tendon_newton.actuators.networks.fused_query import forces_of
from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.onnx_file import write_onnx
from tendon_newton.actuators.networks.query import open_query
from tendon_newton.data.cards.force_network_card import ForceNetworkCard
from tendon_newton.data.files.trust import trust_file
from tendon_newton.errors import UnknownName
from tendon_newton.force_networks import FORCE_NETWORKS, SETS, build_network, find_force_network
from tendon_newton.force_networks.force_network import ForceNetwork, parameter_count
from tendon_newton.force_networks.weights_file import write_weights
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.actuator.fitting.training import train_network
from tendon_train.actuator.samples.servo_law import NO_LAW
from tendon_train.actuator.samples.windows import Windows
from tendon_train.actuator.training_config import TrainingConfig
from tests.physics.learned.networks import LIMIT, force_network, learned_model, write_force_network
from tests.train.actuator.network_files import card_of

pytestmark = pytest.mark.usefixtures("own_trust")

EVERY = [(of_set, kind) for kind in FORCE_NETWORKS for of_set in find_force_network(kind).sizes]
every_network = pytest.mark.parametrize(("of_set", "kind"), EVERY)
every_kind = pytest.mark.parametrize("kind", FORCE_NETWORKS)


def first_set(kind: str) -> str:
    """Return a set that has sizes of a kind."""
    return next(iter(find_force_network(kind).sizes))


def made(kind: str, of_set: str | None = None) -> ForceNetwork:
    """Build a network with a normalisation that is not the identity."""
    return force_network(kind, of_set=of_set or first_set(kind))


def windows(count: int = 64) -> torch.Tensor:
    """Draw windows of credible signals."""
    torch.manual_seed(2)
    return torch.randn(count, 30, 3) * torch.tensor([2.0, 0.5, 3.0]) + 1.0


@every_kind
def test_a_force_network_says_what_it_is(kind: str) -> None:
    """Its source stands in its docstring, its module has its name, its sizes are in known sets."""
    family = find_force_network(kind)
    assert family.__module__ == f"tendon_newton.force_networks.{kind}"
    assert "Source:" in (family.__doc__ or "")
    assert family.sizes
    assert set(family.sizes) <= set(SETS)


def test_every_kind_can_be_compared_at_the_same_size() -> None:
    """The set of matched sizes has all kinds; parameters within 20 %, as the paper asks for."""
    counts = [parameter_count(made(kind, "matched")) for kind in FORCE_NETWORKS]
    assert max(counts) < 1.2 * min(counts)


@every_network
def test_torchscript_says_what_the_module_says(of_set: str, kind: str) -> None:
    """Scripted and eager networks agree to rounding, for windows and for flattened ones."""
    network = made(kind, of_set)
    with torchscript(), torch.no_grad():
        scripted = torch.jit.script(network)
        expected = network(windows())
        assert expected.shape == (64,)
        assert float(expected.std()) > 1e-3
        torch.testing.assert_close(scripted(windows()), expected, rtol=1e-6, atol=1e-5)
        torch.testing.assert_close(scripted(windows().flatten(1)), expected, rtol=1e-6, atol=1e-5)
        torch.testing.assert_close(scripted.last_query(windows()), expected, rtol=1e-6, atol=1e-5)
        assert scripted(windows(0)).shape == (0,)


@every_network
def test_normalisation_travels_inside(of_set: str, kind: str) -> None:
    """Inputs and tension in other units, with the statistics to match, change nothing but units."""
    network = made(kind, of_set).double()
    scale, shift = torch.tensor([10.0, 3.0, 0.2]).double(), torch.tensor([1.0, -2.0, 4.0]).double()
    with torch.no_grad():
        expected = network(windows().double())
        network.input_mean.mul_(scale).add_(shift)
        network.input_scale.mul_(scale)
        network.force_mean.mul_(1000.0)
        network.force_scale.mul_(1000.0)
        got = network(windows().double() * scale + shift)
    torch.testing.assert_close(got, 1000.0 * expected, rtol=1e-9, atol=1e-9)


@every_kind
def test_a_training_learns_the_ideal_source(kind: str, tmp_path: Path) -> None:
    """From 2,048 windows of F = P (theta_d - theta), an error of a third of the force's spread.

    The law needs only the last sample, which the order of the window decides.
    """
    rng = np.random.default_rng(4)
    inputs = (rng.normal(size=(4096, 3)) * [1.0, 0.3, 1.0] + [2.0, 0.5, 0.0]).astype(np.float32)
    force = (4.2 * (inputs[:, 0] - inputs[:, 1])).astype(np.float32)
    rows = np.arange(2048)[:, None] + np.arange(30)[None]
    data = Windows(inputs=inputs, force=force, rows=rows, source=np.zeros(2048, dtype=np.intp))
    config = TrainingConfig(network=kind, set="matched", epochs=8, batch=64, disturb=False)
    network, done = train_network(config, data, data, tmp_path / "n.checkpoint", law=NO_LAW)
    assert done.best_error < float(force.std()) / 3.0
    assert isinstance(network, find_force_network(kind))


@every_kind
def test_a_torchscript_file_gives_back_its_card_and_its_network(tmp_path: Path, kind: str) -> None:
    """The card survives word by word, and the weights bit by bit, under readable names."""
    network = made(kind)
    write_network(tmp_path / "network.pt", network, card_of(kind))
    file = load_network(tmp_path / "network.pt")
    assert file.card == card_of(kind)
    own, read = network.state_dict(), file.module.state_dict()
    assert own.keys() == read.keys()
    assert all(torch.equal(own[name], read[name]) for name in own)


@every_network
def test_weights_give_the_same_forces_and_need_no_trust(tmp_path, of_set, kind) -> None:
    """Bit by bit, as a TorchScript module with all that the simulation calls."""
    network = made(kind, of_set)
    write_weights(tmp_path / "network.safetensors", network, card_of(kind))
    file = load_network(tmp_path / "network.safetensors")
    with torch.no_grad():
        assert torch.equal(file.module(windows()), network(windows()))
        assert torch.equal(file.module.last_query(windows()), network.last_query(windows()))
    assert file.card == card_of(kind)
    assert not trust_file().exists()


@every_kind
def test_onnx_says_what_torch_says_for_any_number_of_worlds(tmp_path: Path, kind: str) -> None:
    """One file, its card in the metadata; equal to rounding for 1 and for 33 worlds."""
    import onnxruntime

    network, path = made(kind), tmp_path / "n.onnx"
    write_onnx(path, network, card_of(kind))
    assert [file.name for file in tmp_path.glob("n.*")] == ["n.onnx"]
    session = onnxruntime.InferenceSession(path)
    text = session.get_modelmeta().custom_metadata_map["card"]
    assert ForceNetworkCard.from_json(text) == card_of(kind)
    for worlds in (1, 33):
        (tension,) = session.run(None, {"window": windows(worlds).numpy()})
        expected = network(windows(worlds)).detach().numpy()
        np.testing.assert_allclose(tension, expected, rtol=1e-5, atol=1e-5)


@every_kind
def test_a_tendon_is_pulled_by_what_the_network_says(tmp_path: Path, kind: str) -> None:
    """What a simulation is told for each servo is the force of the module in the model's file."""
    network = made(kind)
    path = write_force_network(tmp_path / "force.pt", network, kind)
    history = History(13, 30, "cpu")
    history.ring.assign(windows(13).permute(1, 2, 0).contiguous().numpy())
    history.newest.fill_(29)
    said = forces_of(open_query(learned_model(str(path)), "fused", "cpu"), history)
    expected = network(windows(13)).detach().clamp(max=LIMIT).numpy()
    np.testing.assert_allclose(said, expected, rtol=0.0, atol=1e-4)


@every_kind
def test_worlds_of_a_loop_do_not_mix(tmp_path: Path, kind: str) -> None:
    """The second of three fingers moves as it moves alone; a network sums in another order."""
    path = write_force_network(tmp_path / "force.pt", made(kind), kind)
    commands = 1.0 + 3.0 * torch.rand(8, 3, 1, generator=torch.Generator().manual_seed(3))
    mechanism, model = load_mechanism("finger"), learned_model(str(path))

    def angles(chosen: torch.Tensor) -> torch.Tensor:
        loop = ControlLoop(mechanism, model, chosen.shape[1], device="cpu")
        loop.reset(chosen[0])
        return torch.stack([loop.step(c).motor_position.clone() for c in chosen])

    together = angles(commands)
    assert float(together.std()) > 1e-3
    torch.testing.assert_close(together[:, 1:2], angles(commands[:, 1:2]), rtol=0.0, atol=1e-4)


def test_an_unknown_network_is_named() -> None:
    """The message lists what there is, and what a set has."""
    known = ", ".join(sorted(FORCE_NETWORKS))
    with pytest.raises(UnknownName, match=f"'nonesuch'.*{known}"):
        build_network("nonesuch", of_set="paper", window=30)
    with pytest.raises(UnknownName, match="authors, matched, paper"):
        build_network("mlp", of_set="papers", window=30)
