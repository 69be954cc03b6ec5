"""A policy that is trained on begins where it was."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from tendon_hardware.control.goals import DWELL
from tendon_hardware.control.policy_runner import load_policy
from tendon_newton.data.files.ledger import Ledger
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.model_file import write_model
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidPolicyFile
from tendon_newton.workflows.climbing import stair_levels
from tendon_newton.workflows.options import RefreshOptions
from tendon_newton.workflows.refreshing import (
    CORRECTED,
    better_text,
    keep_if_better,
    new_policy,
    train_policy_on,
)
from tendon_train.policy.runs.policy_checkpoint import load_start
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import make_runner
from tendon_train.policy.scoring.policy_evaluation import Climb
from tendon_train.refresh.retraining import find_training, retrain
from tests.hardware.silent_operator import SilentOperator
from tests.physics.runs import ideal_model
from tests.train.policy.small import short_training
from tests.train.policy.test_randomisation import open_number, write_sets
from tests.train.policy.test_training import train


@pytest.fixture(scope="module")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a policy that was trained for two iterations."""
    folder = tmp_path_factory.mktemp("earlier")
    config = short_training(iterations=2)
    return export_policy(folder, train(config, folder), config).onnx


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """Return the file of a model with friction."""
    write_model(tmp_path / "model.toml", ideal_model(coulomb_friction={"force": 1.0}))
    return tmp_path / "model.toml"


def test_a_training_is_found_beside_its_policy(earlier: Path) -> None:
    """Its settings come back from JSON as they were, tuples included."""
    found = find_training(earlier)
    assert found.config == short_training(iterations=2)
    assert found.checkpoint == earlier.parent / "checkpoints" / "000002.pt"


def test_a_training_from_before_the_pay_out_rule_goes_on_without_it(earlier, tmp_path) -> None:
    """Its settings do not name the rule, and its range counted everywhere."""
    table = json.loads((earlier.parent / "policy.json").read_text())
    del table["config"]["environment"]["pay_out"]
    table["config"]["environment"]["command_range"] = [-0.4, 6.0]
    (tmp_path / "policy.json").write_text(json.dumps(table))
    (tmp_path / "checkpoints").mkdir()
    (tmp_path / "checkpoints" / "000002.pt").touch()
    environment = find_training(tmp_path / "policy.onnx").config.environment
    assert environment.command_range == (-0.4, 6.0)
    assert not environment.pays_out


def test_the_new_training_begins_with_the_old_weights(earlier: Path) -> None:
    """Bit for bit, those of actor, critic and normalisation."""
    found = find_training(earlier)
    environment = train(short_training(iterations=2), earlier.parent).environment
    runner = make_runner(environment, found.config, "cpu")
    before = {name: value.clone() for name, value in runner.alg.actor.state_dict().items()}
    load_start(found.checkpoint, runner.alg, "cpu")
    saved = torch.load(found.checkpoint, weights_only=True)["algorithm"]
    for part, module in (("actor", runner.alg.actor), ("critic", runner.alg.critic)):
        for name, value in module.state_dict().items():
            assert torch.equal(value, saved[f"{part}_state_dict"][name])
    assert not torch.equal(before["mlp.0.weight"], runner.alg.actor.state_dict()["mlp.0.weight"])


def test_a_retraining_that_was_interrupted_goes_on(earlier, model, tmp_path) -> None:
    """One iteration and then two are two, to the last bit; the card names the new model."""
    found = find_training(earlier)
    learned = []
    for folder, counts in (("whole", (4,)), ("parts", (2, 4))):
        for count in counts:
            exported = retrain(
                found,
                model,
                tmp_path / folder,
                iterations=count,
                device="cpu",
                report=lambda progress: None,
            )
            assert exported.card.training.force == "model.toml"
            assert exported.card.model == content_hash(model.read_bytes())
        checkpoint = tmp_path / folder / "checkpoints" / "000004.pt"
        learned.append(torch.load(checkpoint, weights_only=True)["algorithm"])
    for part in ("actor_state_dict", "critic_state_dict"):
        for name, value in learned[0][part].items():
            assert torch.equal(value, learned[1][part][name])


@pytest.mark.parametrize("fitted", ["cause", "all"])
def test_fingers_differ_by_what_a_worn_bench_leaves_open(fitted, earlier, model, tmp_path) -> None:
    """A cause is drawn from the bench's own diagnosis, and all else as before."""
    (tmp_path / "diagnosis").mkdir()
    force = open_number("coulomb_friction", "force", 1.2, 10.0)
    write_sets(tmp_path / "diagnosis" / "diagnosis.json", (1.0, {force: 0.1}))
    ledger = Ledger(tmp_path / "refresh.json", {})
    ledger.finish("model", {"fitted": fitted})
    options = RefreshOptions(logs=(), model=model, policy=earlier, out=tmp_path, iterations=1)
    train_policy_on(options, ledger, SilentOperator())
    drawn = dict(load_policy(new_policy(options)).card.training.randomisation)
    if fitted == "cause":  # 95 % of 4096 draws
        assert drawn.pop("coulomb_friction.force") == pytest.approx((1.004, 1.396), abs=0.03)
    assert drawn == load_policy(earlier).card.training.randomisation


def test_a_policy_without_its_training_is_refused(earlier: Path, tmp_path: Path) -> None:
    """No policy.json, one that is another's, no checkpoint, or other layers."""
    lone = tmp_path / "policy.onnx"
    with pytest.raises(InvalidPolicyFile, match=r"lies beside its policy\.json"):
        find_training(lone)
    text = (earlier.parent / "policy.json").read_text(encoding="utf-8")
    (tmp_path / "policy.json").write_text(text, encoding="utf-8")
    with pytest.raises(InvalidPolicyFile, match="from its last checkpoint; there is none"):
        find_training(lone)
    (tmp_path / "checkpoints").mkdir()
    checkpoint = tmp_path / "checkpoints" / "000002.pt"
    checkpoint.write_bytes(b"no checkpoint")
    (tmp_path / "policy.json").write_text(json.dumps({"config": {}}), encoding="utf-8")
    with pytest.raises(InvalidPolicyFile, match="its config is not that of a training"):
        find_training(lone)
    runner = make_runner(
        train(short_training(iterations=1), tmp_path / "x").environment,
        short_training(hidden=(8,)),
        "cpu",
    )
    for file in (checkpoint, earlier.parent / "checkpoints" / "000002.pt"):
        with pytest.raises(InvalidPolicyFile, match="layers of the same widths"):
            load_start(file, runner.alg, "cpu")


def climb(policy: str, place: str, goals: Array) -> Climb:
    """Return a climb with some goals at 20 Hz."""
    steps, tip = len(goals), np.zeros((len(goals), 1, 3))
    return Climb(
        policy=policy, place=place, time=np.arange(steps) / 20.0, goal=goals, tip=tip,
        tip_angle=tip[..., 0], goal_point=tip[:, 0], command=tip[..., 0],
        motor_position=tip[..., 0],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("bench_goals", "on_bench", "simulated", "written"),
    [
        ("stairs", (9.0, 7.0), (7.0, 8.0), True),  # the bench decides
        ("stairs", (7.0, 9.0), (8.0, 7.0), False),
        ("stairs", (7.0, 7.0), (8.0, 7.0), False),
        ("others", (7.0, 9.0), (8.0, 7.0), True),  # its logs are of other goals
        ("others", (9.0, 7.0), (7.0, 8.0), False),
    ],
)
def test_a_policy_that_is_not_better_is_not_written(
    bench_goals, on_bench, simulated, written, model, tmp_path
) -> None:
    """Neither of its files stays where it misses as much as the old one; its training does."""
    options = RefreshOptions(logs=(), model=model, policy=tmp_path, out=tmp_path)
    files = [new_policy(options).with_suffix(ending) for ending in (".onnx", ".pt")]
    checkpoint = tmp_path / "training" / "checkpoints" / "000001.pt"
    checkpoint.parent.mkdir(parents=True)
    for file in (*files, checkpoint):
        file.touch()
    goals = stair_levels(20.0, DWELL)
    driven = goals if bench_goals == "stairs" else goals[::-1] ** 2
    climbs = [
        *(climb(who, CORRECTED, goals) for who in ("old", "new")),
        climb("old", "bench, before: a.mcap", goals),
        climb("old", "bench, now: b.mcap", driven),
        climb("new", "bench, now: c.mcap", goals),
    ]
    errors = (*simulated, 5.0, *on_bench)
    scores: Any = [SimpleNamespace(rmse=1e-3 * error) for error in errors]
    ledger = Ledger(tmp_path / "refresh.json", {})
    keep_if_better(options, climbs, scores, ledger)
    assert ledger.done("better")["written"] is written
    assert [file.exists() for file in files] == [written, written]
    assert checkpoint.exists()
    assert ("not written" in better_text(ledger.done("better"))) is not written
