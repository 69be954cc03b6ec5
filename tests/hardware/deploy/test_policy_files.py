"""Policy files: what is in them, who may run them, and that every engine gives torch's actions."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch
from torch import nn

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_settings import DeploySettings, loops_of, refuse_mismatch
from tendon_hardware.errors import PolicyMismatch
from tendon_newton.data.cards.policy_card import DutyLoop, PolicyCard, PolicyTraining
from tendon_newton.errors import InvalidPolicyFile, UntrustedNetworkFile
from tests.hardware.deploy.policies import card_of, network, write_onnx, write_torchscript

pytestmark = pytest.mark.usefixtures("own_trust")

ADDRESS = BenchAddress(bench="finger", port="virtual")


@pytest.mark.parametrize("activation", [nn.ELU, nn.ReLU, nn.Tanh, nn.Sigmoid])
def test_every_engine_gives_the_actions_of_torch(tmp_path: Path, activation: type) -> None:
    """ONNX and TorchScript agree with the module itself within 1e-5 rad."""
    module = network(activation)
    card = card_of()
    path = write_onnx(tmp_path / "policy.onnx", module, card.to_json())
    script = write_torchscript(tmp_path / "policy.pt", module, card.to_json())
    observations = np.random.default_rng(0).normal(0.0, 3.0, (200, 1, 150)).astype(np.float32)
    with torch.no_grad():
        expected = module(torch.from_numpy(observations[:, 0])).numpy()[:, 0]
    policies = [load_policy(path), load_policy(script, trust=True)]
    assert [policy.engine for policy in policies] == ["onnxruntime", "torch"]
    for policy in policies:
        assert policy.card == card
        actions = [policy(observation)[0] for observation in observations]
        np.testing.assert_allclose(actions, expected, atol=1e-5)


def test_a_card_says_the_same_after_a_round_trip() -> None:
    """Everything on a card survives its JSON."""
    card = card_of(
        goal_range=(0.1, 1.4),
        loop=DutyLoop(gain=0.03, limit=0.23, offset=0.005),
        model="a" * 64,
        normalisation="none",
        training=PolicyTraining(
            seed=3,
            git_commit="abc",
            version="0.1.0",
            samples=10**8,
            force="learned",
            randomisation={"spool_radius": (0.7, 1.3)},
            files={"force.pt": "b" * 64},
        ),
    )
    assert PolicyCard.from_json(card.to_json()) == card
    table = json.loads(card.to_json())
    assert table["observation"][0] == ["theta", "rad"]
    assert table["action"] == {"unit": "rad", "clip": 2.0, "meaning": "motor position offset"}
    table["position_loop"]["max_duty"] = 2.0
    with pytest.raises(InvalidPolicyFile, match="position_loop must be duty_per_rad above 0"):
        PolicyCard.from_json(json.dumps(table))


BAD_CARDS: dict[str, tuple[Any, str]] = {
    "schema": (2, "schema must be 1"),
    "observation": ([["theta", "deg"]], "observation must be"),
    "history": (0, "history must be 1 to 10000"),
    "rate_hz": (-20.0, "rate_hz must be"),
    "servo_rate_hz": (50.0, "whole multiple of rate_hz"),
    "action": ({"unit": "deg", "clip": 2.0, "meaning": "motor position offset"}, "action.unit"),
    "command_range_rad": ([1.0, 0.0], "command_range_rad must be"),
    "spool_radius_m": (12.5, "spool_radius_m must be 1e-4 to 1 m"),
    "servo": ("", "the name of a servo"),
    "force_limit_n": ("21", "force_limit_n must be a finite number; it is '21'"),
    "normalisation": ("outside", "normalisation must be one of"),
    "model": ("latest", "SHA-256"),
    "training": (None, "training must be an object; it is None"),
}


@pytest.mark.parametrize("key", BAD_CARDS)
def test_a_card_that_promises_something_else_is_refused(key: str) -> None:
    """Another unit, order or meaning is an error that names the key, never a guess."""
    value, said = BAD_CARDS[key]
    table = json.loads(card_of().to_json())
    with pytest.raises(InvalidPolicyFile, match=said):
        PolicyCard.from_json(json.dumps(table | {key: value}))
    del table[key]
    with pytest.raises(InvalidPolicyFile):
        PolicyCard.from_json(json.dumps(table))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rate": 40.0}, "rate_hz 40, this bench 20"),
        ({"servo_rate": 100.0}, "servo_rate_hz 100, this bench 80"),
        ({"servo": "xl330_m288_t"}, "servo xl330_m288_t, this bench xc330_t288_t"),
        ({"spool_radius": 0.010}, "spool_radius_m 0.01, this bench 0.0125"),
        ({"command_range": (0.0, 9.0)}, "command_range_rad 0.000 to 9.000"),
        ({"force_limit": 50.0}, "force_limit_n 50, this bench 30 at most"),
        ({"loop": DutyLoop(gain=5.2, limit=1.0)}, "of duty per rad 5.2, this bench closes one of"),
    ],
)
def test_a_policy_for_another_bench_is_refused(changes: dict[str, Any], said: str) -> None:
    """Rates, servo, spool and limits must be those of training; the message names both sides."""
    refuse_mismatch(card_of(), DeploySettings(), ADDRESS)
    with pytest.raises(PolicyMismatch, match=said):
        refuse_mismatch(card_of(**changes), DeploySettings(), ADDRESS)


def test_a_policy_is_deployed_behind_the_position_loop_of_its_training() -> None:
    """A weak loop for a strong servo, as ``collect`` drives it; without one the bench's own."""
    card = card_of(loop=DutyLoop(gain=0.0255, limit=0.23, offset=0.005))
    refuse_mismatch(card, DeploySettings(), ADDRESS)
    (loop,) = loops_of(card)
    assert (loop.gain, loop.duty_limit, loop.offset) == (0.0255, 0.23, 0.005)
    assert loops_of(card_of())[0].gain == 0.1


def test_a_file_without_a_card_is_refused(tmp_path: Path) -> None:
    """What the numbers mean is not guessed from their count."""
    path = write_onnx(tmp_path / "policy.onnx", network(), None)
    with pytest.raises(InvalidPolicyFile, match="key 'card'"):
        load_policy(path)


def test_a_network_that_contradicts_its_card_is_refused(tmp_path: Path) -> None:
    """Thirty samples on the card and ten in the network do not go together."""
    path = write_onnx(tmp_path / "a.onnx", network(size=50), card_of().to_json(), size=50)
    with pytest.raises(InvalidPolicyFile, match="observations of 150 numbers"):
        load_policy(path)
    two = write_onnx(tmp_path / "b.onnx", nn.Linear(150, 2), card_of().to_json())
    with pytest.raises(InvalidPolicyFile, match="one action per observation"):
        load_policy(two)
    blind = nn.Linear(150, 1)
    nn.init.constant_(blind.bias, float("nan"))
    with pytest.raises(InvalidPolicyFile, match="finite actions"):
        load_policy(write_onnx(tmp_path / "c.onnx", blind, card_of().to_json()))


def test_weights_in_another_file_are_refused(tmp_path: Path) -> None:
    """An exporter may put the weights beside the file, where nobody copies them along."""
    path = write_onnx(tmp_path / "policy.onnx", network(), card_of().to_json())
    model = onnx.load(path)
    onnx.save(model, path, save_as_external_data=True, location="weights.data", size_threshold=0)
    with pytest.raises(InvalidPolicyFile, match="export with external_data=False"):
        load_policy(path)


def test_a_torchscript_policy_must_be_trusted(tmp_path: Path) -> None:
    """It is a program, so it runs only for who says so; once said, it stays said."""
    path = write_torchscript(tmp_path / "policy.pt", network(), card_of().to_json())
    with pytest.raises(UntrustedNetworkFile, match="an ONNX file needs no trust"):
        load_policy(path)
    load_policy(path, trust=True)
    load_policy(path)


def test_a_torchscript_policy_without_torch_says_what_to_do(tmp_path, monkeypatch) -> None:
    """On a Pi there is no torch: the message points to the ONNX file."""
    from tendon_newton.errors import MissingDependency

    path = write_torchscript(tmp_path / "policy.pt", network(), card_of().to_json())
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingDependency, match="use the policy's ONNX file"):
        load_policy(path, trust=True)
