"""A policy that learned for seconds on a CPU: what it can, its files, and its evaluation."""

import json
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch

from tendon_hardware.control.pilot import PolicyPilot
from tendon_hardware.control.policy_runner import Policy, load_policy
from tendon_hardware.logs.mcap_file import McapFile
from tendon_hardware.servos.base import ServoState
from tendon_newton.cli import main
from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_export import ExportedPolicy, export_policy
from tendon_train.policy.runs.policy_training import Trained, train_policy
from tendon_train.policy.scoring.evaluation_scores import score, to_markdown
from tendon_train.policy.scoring.policy_evaluation import (
    RunnablePolicy,
    climb_stairs,
    reachable_error,
)
from tendon_train.policy.worlds.observation_tensors import ObservationTensors
from tests.bad_input.damage import refusal
from tests.physics.runs import run_of
from tests.train.policy.small import stair_goals

CONFIG = PolicyTrainingConfig(
    environment=EnvironmentConfig(worlds=128, max_step=2.0e-3),
    iterations=50,
    steps=24,
    batch=768,
    epochs=4,
    learning_rate=1.0e-3,
    discount=0.8,
    trace=0.9,
    exploration=0.4,
    checkpoint_every=25,
)
"""153,600 steps; with this short horizon they were enough from each of three seeds."""


@dataclass(frozen=True, kw_only=True)
class Learned:
    """What a training left."""

    trained: Trained
    exported: ExportedPolicy


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> Learned:
    """One training for all tests, whose files are trusted in a folder of their own."""
    out = tmp_path_factory.mktemp("policy") / "quick"
    out.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(out))
        trained = train_policy(CONFIG, out, report=lambda progress: None)
        return Learned(trained=trained, exported=export_policy(out, trained, CONFIG))


def runnable(policy: Policy, **changes: Any) -> RunnablePolicy:
    """Return a policy as an evaluation takes it."""
    return RunnablePolicy(**{"name": "quick", "card": policy.card, "run": policy.run, **changes})


def test_the_tip_learns_to_find_random_goals(learned: Learned) -> None:
    """From 30 mm to 12.5 mm on average, while it still explores and its finger still differs."""
    errors = [point.tip_error for point in learned.trained.points]
    assert errors[0] > 0.028
    assert float(np.mean(errors[-10:])) < 0.0125


def test_the_policy_climbs_the_stairs_of_the_paper(learned: Learned) -> None:
    """In the nominal finger, deterministic: a third of the error of a motor that stays off."""
    policy = load_policy(learned.exported.onnx)
    asleep = runnable(policy, name="asleep", run=lambda observation: np.zeros((1, 1)))
    goals = np.repeat(stair_goals(11), 30)
    config = EnvironmentConfig(worlds=5, max_step=2.0e-3, precision="float64")
    climbs = climb_stairs([runnable(policy), asleep], goals, config)
    reachable = reachable_error(load_mechanism("finger"), goals)
    awake, still = (score(climb, reachable) for climb in climbs)
    assert still.rmse > 0.030
    assert awake.rmse < still.rmse / 2.5
    assert len(awake.stairs) == 11
    assert [stair.rising for stair in awake.stairs] == [True] * 6 + [False] * 5
    assert len(awake.world_rmse) == 4
    assert max(awake.world_rmse) < still.rmse / 1.5
    assert "| quick | simulation, ideal |" in to_markdown([awake, still])


def test_at_the_open_finger_gravity_leaves_an_error(learned: Learned) -> None:
    """The slack finger sags: 7.0 mm from the goal point of 0 rad, and that is no policy's fault."""
    reachable = reachable_error(load_mechanism("finger"), np.array([0.0, 1.0]))
    assert reachable[0] == pytest.approx(0.0070, abs=1e-4)
    assert reachable[1] < 0.001


def test_both_files_carry_the_card_and_act_as_in_training(learned: Learned) -> None:
    """Float32 in another order of summation: 1e-5 rad."""
    exported, actor = learned.exported, learned.trained.runner.alg.get_policy()
    observation = 0.5 * torch.randn(7, 150, generator=torch.Generator().manual_seed(0))
    expected = actor.as_jit().eval()(observation).detach()
    assert float(expected.abs().max()) > 0.1
    texts = [
        entry.value for entry in onnx.load(exported.onnx).metadata_props if entry.key == "card"
    ]
    with zipfile.ZipFile(exported.torchscript) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith("extra/card.json"))
        texts.append(archive.read(name).decode())
    assert [PolicyCard.from_json(text) for text in texts] == [exported.card] * 2
    for file in (exported.onnx, exported.torchscript):
        policy = load_policy(file, trust=True)
        found = [float(np.ravel(policy.run(row[None].numpy()))[0]) for row in observation]
        assert found == pytest.approx(expected[:, 0].tolist(), abs=1e-5)


def test_the_card_says_where_a_policy_comes_from(learned: Learned) -> None:
    """Its bench, its range, its budget, and hashes of what was read."""
    card = learned.exported.card
    assert (card.servo, card.spool_radius, card.force_limit) == ("xc330_t288_t", 0.0125, 21.0)
    assert (card.rate, card.servo_rate, card.history, card.action_clip) == (20.0, 80.0, 30, 3.0)
    assert card.goal_range == pytest.approx((0.0, 0.6 * np.pi))
    training = card.training
    assert (training.samples, training.seed, training.force) == (153_600, 0, "ideal")
    assert dict(training.randomisation) == dict.fromkeys(
        ("joint_friction", "link_mass", "spool_radius", "joint_spring"), (0.7, 1.3)
    )
    assert list(training.files)[:2] == ["finger.usda", "geometry.usda"]
    curve = json.loads((learned.exported.onnx.parent / "policy.json").read_text())["curve"]
    assert len(curve["rows"]) == 50


def test_training_and_deployment_see_the_same_in_one_recording(learned: Learned) -> None:
    """Every observation of 200 rows, bit for bit, with the actions that the policy gives to it."""
    rng = np.random.default_rng(0)
    angle = 1.0 + np.cumsum(rng.normal(0.0, 0.05, (200, 1)), axis=0)
    speed = rng.normal(0.0, 1.0, (200, 1))
    recording = replace(run_of(np.zeros(200)), motor_position=angle, motor_velocity=speed)
    policy = load_policy(learned.exported.onnx)
    seen: list[np.ndarray] = []
    watched = replace(policy, run=lambda x: seen.append(x.copy()) or policy.run(x))
    pilot, tensors = PolicyPilot(watched), ObservationTensors(1)
    for k in range(200):
        theta, theta_dot = float(angle[k, 0]), float(speed[k, 0])
        goal = 0.3 * (k // 50)
        time = float(recording.time[k])
        state = ServoState(time=time, position=theta, velocity=theta_dot, current=0.0)
        step = pilot.step([state], goal)
        own = (torch.tensor([[value]], dtype=torch.float64) for value in (theta, theta_dot))
        tensors.observe(*own, torch.tensor([goal], dtype=torch.float64))
        assert np.array_equal(seen[-1], tensors.flat().numpy()), k
        pilot.apply(step)
        tensors.act(torch.tensor([step.action]))
    assert len(seen) == 200


def test_a_user_compares_policies_in_simulation_and_on_a_bench(learned, tmp_path, capsys) -> None:
    """Numbers, a table and a figure; on the virtual bench the policy runs as it is deployed."""
    words = [
        "--out", str(tmp_path), "--worlds", "3", "--port", "virtual", "--faster-than-real-time",
    ]  # fmt: skip
    assert main(["evaluate-policy", str(learned.exported.onnx), *words]) == 0
    table = json.loads((tmp_path / "evaluation.json").read_text())
    simulated, bench = table["climbs"]
    assert (simulated["policy"], simulated["place"]) == ("quick", "simulation, ideal")
    assert (bench["policy"], bench["place"], len(bench["stairs"])) == ("quick", "bench", 11)
    assert len(simulated["world_rmse"]) == 2
    assert bench["rmse"] < 0.030
    assert (tmp_path / "climb.png").stat().st_size > 20_000
    said = capsys.readouterr().out
    assert "no policy gets nearer than 7.0 mm" in said
    (log,) = (tmp_path / "deployments").glob("*.mcap")
    words = ["--out", str(tmp_path / "again"), "--logs", str(log), "--no-plots"]
    assert main(["evaluate-policy", str(learned.exported.onnx), *words]) == 0
    again = json.loads((tmp_path / "again" / "evaluation.json").read_text())["climbs"][1]
    assert again["rmse"] == pytest.approx(bench["rmse"])


def test_a_wrong_file_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 2 and one line on stderr."""
    (tmp_path / "policy.onnx").write_bytes(b"no policy")
    for file in ("none.onnx", str(tmp_path / "policy.onnx")):
        line = refusal(["evaluate-policy", file, "--out", str(tmp_path / "out")], capsys)
        assert line.startswith(f"error: {file}")


def test_what_cannot_be_compared_is_one_line(learned, tmp_path, capsys) -> None:
    """No policy, no place, stairs without a length; a log of no policy, before any simulation."""
    file, out = str(learned.exported.onnx), ["--out", str(tmp_path)]
    McapFile(tmp_path / "log.mcap", {}).finish({})
    for words, said in (
        ([], "name the files of one or more policies"),
        ([file, "--force"], "nothing to compare"),
        ([file, "--dwell", "0"], "dwell must be 0.1 to 1000 s; it is 0.0"),
        ([file, "--force", "no.toml", "--logs", str(tmp_path / "log.mcap")], "this file has none"),
    ):
        assert said in refusal(["evaluate-policy", *words, *out], capsys)
