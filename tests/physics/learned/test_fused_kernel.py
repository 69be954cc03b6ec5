"""The fused kernel of a force network against the network itself."""

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import torch
import warp as wp

from tendon_newton.actuators.networks.artifact import load_network, write_network
from tendon_newton.actuators.networks.fused_cuda import (
    LEAST_ARCHITECTURE,
    fits_cuda_kernel,
    transformer_on_cuda,
)
from tendon_newton.actuators.networks.fused_query import FusedQuery, forces_of
from tendon_newton.actuators.networks.fused_weights import fused_weights
from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.query import open_query
from tendon_newton.actuators.networks.torchscript import TorchScriptQuery
from tendon_newton.errors import UnknownName
from tendon_newton.force_networks.transformer import Transformer
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.conftest import SEED
from tests.physics.learned.networks import (
    LIMIT,
    RATE,
    WINDOW,
    force_network,
    learned_model,
    write_force_network,
)

pytestmark = pytest.mark.usefixtures("own_trust")

WINDOWS = 10_000


def random_samples(count: int, device: str = "cpu") -> History:
    """Return a history of servos about the usual samples, each ring at another place."""
    rng = np.random.default_rng(SEED)
    mean, spread = np.array([2.4, 0.7, 0.0]), np.array([2.1, 0.5, 0.9])
    history = History(count, WINDOW, device)
    samples = mean[:, None] + spread[:, None] * rng.normal(size=(WINDOW, 3, count))
    history.ring.assign(samples.astype(np.float32))
    history.newest.assign(rng.integers(0, WINDOW, count).astype(np.int32))
    return history


@pytest.mark.parametrize("seed", [0, 1])
def test_the_fused_kernel_is_the_module(seed: int) -> None:
    """Over 10,000 random windows to 1e-4 N; float32 sums in another order leave 1e-5."""
    network = force_network(seed=seed)
    for bias in network.parameters():
        bias.data += 0.05 * torch.randn(bias.shape)  # no bias or gain stays at 0 or 1
    fused = FusedQuery(network, rate=RATE, limit=LIMIT, device="cpu")
    module = TorchScriptQuery(network, window=WINDOW, rate=RATE, limit=LIMIT)
    history = random_samples(WINDOWS)
    expected = forces_of(module, history)
    assert float(expected.std()) > 0.1
    assert forces_of(fused, history) == pytest.approx(expected, rel=0.0, abs=1e-4)


def test_a_loop_with_the_fused_kernel_is_one_with_the_module(tmp_path: Path) -> None:
    """One second in closed loop, from the same file, worlds in lanes that are not full."""
    model = learned_model(str(write_force_network(tmp_path / "force.pt", force_network())))
    commands = 1.0 + 3.0 * torch.rand(20, 3, 1, generator=torch.Generator().manual_seed(SEED))
    read = {}
    for form in ("fused", "torchscript"):
        loop = ControlLoop(load_mechanism("finger"), model, 3, network=form, device="cpu")
        assert loop.held.is_warp_only == (form == "fused")
        loop.reset(commands[0])
        read[form] = torch.stack([loop.step(c).motor_position.clone() for c in commands])
    torch.testing.assert_close(read["fused"], read["torchscript"], rtol=0.0, atol=1e-4)


@pytest.mark.parametrize(
    ("feed", "architecture", "fits"),
    [(64, 80, True), (64, 75, False), (128, 90, False), (60, 90, False)],
)
def test_the_kernel_on_cuda_is_for_what_it_has_room_and_cores(
    feed: int, architecture: int, fits: bool
) -> None:
    """Wider layers and older GPUs run as torch's matrix products."""
    shape = (30, 16, 4, feed, True, ())
    assert fits_cuda_kernel(shape, architecture) == fits


@pytest.mark.parametrize("of_set", ["paper", "authors"])
def test_the_kernel_on_cuda_compiles_for_the_oldest_gpu(of_set: str, tmp_path: Path) -> None:
    """No GPU is needed for it: its text, its instructions and a block's shared memory are right."""
    kernel = transformer_on_cuda(fused_weights(force_network(of_set=of_set)).shape)
    wp.compile_aot_module(
        kernel.module, arch=LEAST_ARCHITECTURE, module_dir=str(tmp_path), use_ptx=False
    )
    assert list(tmp_path.glob("*.cubin"))


@pytest.mark.gpu
@pytest.mark.parametrize("of_set", ["paper", "authors"])
def test_the_fused_kernel_on_cuda_is_the_module(of_set: str) -> None:
    """As above, also where the last servo has a warp or a block for itself."""
    network = force_network(of_set=of_set)
    for bias in network.parameters():
        bias.data += 0.05 * torch.randn(bias.shape)
    network = network.to("cuda")
    fused = FusedQuery(network, rate=RATE, limit=LIMIT, device="cuda:0")
    module = TorchScriptQuery(network, window=WINDOW, rate=RATE, limit=LIMIT)
    for count in (1, 13, WINDOWS):
        history = random_samples(count, "cuda:0")
        expected = forces_of(module, history)
        assert forces_of(fused, history) == pytest.approx(expected, rel=0.0, abs=1e-4)


def test_only_a_transformer_has_a_fused_kernel(tmp_path: Path) -> None:
    """Every other kind runs as TorchScript, quietly, and a Transformer of other layers says why."""
    torch.manual_seed(0)
    path = write_force_network(tmp_path / "deep.pt", Transformer(WINDOW, layers=3))
    with pytest.warns(UserWarning, match="runs as TorchScript: it is no Transformer of 2 layers"):
        query = open_query(learned_model(str(path)), "fused", "cpu")
    assert isinstance(query, TorchScriptQuery)
    path = write_force_network(tmp_path / "mlp.pt", force_network("mlp"), "mlp")
    assert isinstance(open_query(learned_model(str(path)), "fused", "cpu"), TorchScriptQuery)
    with pytest.raises(UnknownName, match="fused"):
        open_query(learned_model(str(path)), "fuse", "cpu")


@pytest.mark.parametrize("purpose", ["prediction", "simulation"])
def test_a_network_that_was_not_made_for_simulations_is_named_once(
    purpose: Literal["prediction", "simulation"], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """With the cure, however often it is opened; one that was made for them raises no word."""
    path = tmp_path / f"{purpose}.pt"
    write_force_network(path, force_network())
    file = load_network(path)
    write_network(path, file.module, replace(file.card, purpose=purpose))
    for _ in range(2):
        open_query(learned_model(str(path)), "torchscript", "cpu")
    warned = [r.getMessage() for r in caplog.records if r.levelname == "WARNING"]
    assert len(warned) == (purpose == "prediction")
    assert all("train-force --purpose simulation" in words for words in warned)
