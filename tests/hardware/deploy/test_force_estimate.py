"""The tension without a load cell: a force network's ONNX file guards the run."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch
from torch import nn

from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.force_estimate import ForceEstimate, load_estimate
from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tendon_newton.errors import InvalidNetworkFile
from tests.hardware.deploy.policies import write_onnx
from tests.hardware.deploy.runs import Flight
from tests.train.actuator.network_files import card_of


class Spring(nn.Module):
    """Tension of the ideal actuator, from the latest sample of a window."""

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("weights", torch.cat([torch.zeros(87), torch.tensor([4.2, -4.2, 0])]))

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """Return 4.2 N/rad times the error."""
        return (window.reshape(1, 90) @ self.weights).reshape(1)


def write_estimate(path: Path, module: nn.Module, **changes: Any) -> Path:
    """Write a force network as an ONNX file."""
    torch.onnx.export(
        module,
        (torch.zeros(1, 30, 3),),
        path,
        input_names=["window"],
        output_names=["tension"],
        dynamo=False,
        verbose=False,
    )
    model = onnx.load(path)
    model.metadata_props.add(key="card", value=card_of("mlp", **changes).to_json())
    onnx.save(model, path)
    return path


pytestmark = pytest.mark.filterwarnings("ignore:You are using the legacy", "ignore:The feature")


def test_an_estimate_looks_at_the_latest_window(tmp_path: Path) -> None:
    """Samples enter at the end, and the tension is cut to what the servo can pull."""
    estimate = load_estimate(write_estimate(tmp_path / "force.onnx", Spring()), 20.0)
    assert estimate(1.0, 0.5, 0.0) == pytest.approx(2.1, rel=1e-5)
    assert estimate(0.0, 0.5, 0.0) == 0.0
    assert estimate(99.0, 0.5, 0.0) == 21.0


def test_a_network_of_train_force_can_guard(tmp_path: Path) -> None:
    """The file that `train-force` writes gives the tension of the network itself."""
    from tendon_newton.actuators.networks.onnx_file import write_onnx as write_force_onnx
    from tendon_newton.force_networks import build_network

    torch.manual_seed(0)
    network = build_network("mlp", of_set="paper", window=30).eval()
    path = tmp_path / "force.onnx"
    write_force_onnx(path, network, card_of("mlp"))
    estimate = load_estimate(path, 20.0)
    rows = np.random.default_rng(0).uniform(0.0, 3.0, (30, 3)).astype(np.float32)
    for row in rows:
        tension = estimate(*(float(value) for value in row))
    with torch.no_grad():
        expected = float(network(torch.from_numpy(rows)[None]))
    assert tension == pytest.approx(min(max(expected, 0.0), 21.0), abs=1e-4)


def test_a_network_for_another_use_is_refused(tmp_path: Path) -> None:
    """It must take windows at the policy's rate."""
    path = write_estimate(tmp_path / "force.onnx", Spring(), rate=80.0)
    with pytest.raises(InvalidNetworkFile, match="runs at 80 Hz"):
        load_estimate(path, 20.0)


def test_a_network_of_another_servo_guards_nothing(tmp_path: Path) -> None:
    """What one servo pulls says nothing of another; a card without a servo guards any."""
    assert load_estimate(write_estimate(tmp_path / "any.onnx", Spring()), 20.0, "sts3215")
    path = write_estimate(tmp_path / "force.onnx", Spring(), servo="xc330_t288_t")
    assert load_estimate(path, 20.0, "xc330_t288_t")
    with pytest.raises(InvalidNetworkFile, match="knows the servo xc330_t288_t; here is a sts3215"):
        load_estimate(path, 20.0, "sts3215")


def test_a_file_that_is_none_is_refused(tmp_path: Path) -> None:
    """Without a card nobody knows what goes in."""
    path = write_onnx(tmp_path / "a.onnx", nn.Linear(150, 1), None)
    with pytest.raises(InvalidNetworkFile, match="has its card"):
        load_estimate(path, 20.0)
    path = write_onnx(tmp_path / "b.onnx", nn.Linear(150, 1), json.dumps({"schema": 1}))
    with pytest.raises(InvalidNetworkFile, match="units"):
        load_estimate(path, 20.0)


def test_an_estimated_tension_ends_a_run_without_a_load_cell() -> None:
    """The rule of tension acts on the estimate where nothing is measured."""
    estimate = ForceEstimate(
        card_of("mlp"), lambda window: 4.2 * (window[0, -1, 0] - window[0, -1, 1])
    )
    limits = DeployLimits(bench=SafetyLimits(force=5.0))
    flight = Flight(
        load_cell=False, estimate=estimate, settings=DeploySettings(duration=4.0, limits=limits)
    )
    outcome = flight.fly()
    assert "the tension must stay below 5 N" in str(outcome.fault)
    assert flight.operator.shown[-1].estimated  # pyright: ignore
