"""The verb that trains, with each kind of force."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from tendon_newton.cli import main
from tendon_newton.cli.training.train_policy import show_forecast
from tendon_newton.data.cards.policy_card import DutyLoop, PolicyCard
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_train.policy.runs.forecast import Forecast
from tests.bad_input.damage import refusal
from tests.made import stated_model
from tests.physics.learned.networks import force_network, write_force_network
from tests.proposed import proposed

SHORT = ("--worlds", "8", "--steps", "4", "--batch", "16", "--max-step", "2e-3", "--episode", "1")


def train(out: Path, *words: str) -> int:
    """Train as from the command line."""
    return main(["train-policy", "--out", str(out), *SHORT, *words])


def card_of(out: Path) -> PolicyCard:
    """Return the card of a training's policy."""
    import onnx

    (text,) = (entry.value for entry in onnx.load(out / "policy.onnx").metadata_props)
    return PolicyCard.from_json(text)


def test_a_user_trains_and_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two iterations and two more: one curve, in JSON and TensorBoard, and two policy files."""
    out = tmp_path / "run"
    assert train(out, "--iterations", "2") == 0
    said = capsys.readouterr().out
    size, first = said.index("64 steps of 8 fingers on the CPU; "), said.index("iteration    1 of")
    assert size < said.index("about 1 s for 64 steps") < first
    assert "iteration    2 of 2" in said
    assert train(out, "--iterations", "4") == 0
    said = capsys.readouterr().out
    assert "iteration    2 of 4" not in said
    assert "iteration    4 of 4" in said
    assert "next: tendon-newton evaluate-policy" in said
    table = json.loads((out / "policy.json").read_text())
    assert [row[0] for row in table["curve"]["rows"]] == [1, 2, 3, 4]
    assert [row[1] for row in table["curve"]["rows"]] == [32, 64, 96, 128]
    assert {file.name for file in out.iterdir()} == {
        "checkpoints",
        "policy.json",
        "policy.onnx",
        "policy.pt",
        "tensorboard",
    }
    assert train(out, "--iterations", "4", "--discount", "0.5") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "discount = 0.95, and now it is 0.5; use another folder" in line


def test_a_long_training_says_so_before_it_starts(capsys: pytest.CaptureFixture[str]) -> None:
    """In hours, with what takes less; and whether a GPU is there."""
    asked = Forecast(steps=10**8, worlds=64, device="cpu")
    assert "100,000,000 steps of 64 fingers on the CPU" in asked.text
    assert ("no GPU here" in asked.text) == (not torch.cuda.is_available())
    show_forecast(replace(asked, seconds=8.0e4))
    said = capsys.readouterr().out
    assert "about 22 h for" in said
    assert "a try in some minutes: --worlds 256" in said
    assert replace(asked, seconds=130.0).text.startswith("about 2 min for")


def test_a_finger_of_ones_own_is_evaluated_as_that_finger(tmp_path, monkeypatch, capsys) -> None:
    """The card decides; another finger is refused, and one that is not found is named."""
    monkeypatch.chdir(tmp_path)
    shape = ["--length", "0.04", "0.03", "--moment-arm", "0.008", "0.0055"]
    assert main(["asset", "new", "long_finger", *shape]) == 0
    assert train(tmp_path / "run", "--iterations", "1", "--finger", "long_finger") == 0
    said = capsys.readouterr().out
    assert "policy.onnx --out comparison --finger long_finger" in said
    words = ["evaluate-policy", str(tmp_path / "run" / "policy.onnx"), "--no-plots", "--out", "out"]
    assert "trained for 'long_finger', which is no asset here" in refusal(words, capsys)
    assert main([*words, "--finger", "finger"]) == 2
    assert "trained for 'long_finger'; --finger names 'finger'" in capsys.readouterr().err
    assert main([*words, "--finger", "long_finger"]) == 0
    known = (tmp_path / "out" / "evaluation.json").read_text()
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", str(tmp_path))
    assert main(words) == 0
    assert (tmp_path / "out" / "evaluation.json").read_text() == known
    policies = [str(tmp_path / "run" / "policy.onnx"), "finger-stairs"]
    assert main(["evaluate-policy", *policies, "--out", "out"]) == 2
    assert "policies of one finger can be compared" in capsys.readouterr().err


def test_a_training_goes_on_with_the_finger_that_it_began_with(
    tmp_path, monkeypatch, capsys
) -> None:
    """All layers of an asset count: masses, springs and strings are not in the file of its name."""
    monkeypatch.chdir(tmp_path)
    assert main(["asset", "new", "own", "--length", "0.04", "--moment-arm", "0.008"]) == 0
    assert train(tmp_path / "run", "--iterations", "1", "--finger", "own/own.usda") == 0
    files = card_of(tmp_path / "run").training.files
    assert list(files) == ["own.usda", "geometry.usda", "physics.usda", "tendon.usda"]
    layer = tmp_path / "own" / "physics.usda"
    assert files["physics.usda"] == file_hash(layer)
    layer.write_text(layer.read_text().replace("physics:mass = 0.01", "physics:mass = 0.02"))
    assert train(tmp_path / "run", "--iterations", "2", "--finger", "own/own.usda") == 2
    assert "began with physics.usda = " in capsys.readouterr().err


def test_a_policy_says_which_position_loop_it_was_trained_with(tmp_path) -> None:
    """``collect`` writes the loop of its servo into the model; a policy of it needs that loop."""
    shared = {"supply_voltage": 9.0, "torque_constant": 1.15, "resistance": 13.9}
    own = {"duty_per_rad": 0.08, "max_duty": 0.7, "duty_offset": 0.02, "armature": 0.002}
    actuator = NamedValues(name="pwm_servo", values={**shared, **own, "spool_radius": 0.0125})
    write_model(tmp_path / "model.toml", Model(actuator=actuator))
    words = ("--iterations", "1", "--force", str(tmp_path / "model.toml"))
    assert train(tmp_path / "own", *words) == 0
    assert card_of(tmp_path / "own").loop == DutyLoop(gain=0.08, limit=0.7, offset=0.02)
    assert train(tmp_path / "ideal", "--iterations", "1", "--servo", "sts3215") == 0
    card = card_of(tmp_path / "ideal")
    assert (card.loop, card.servo) == (None, "sts3215")


def test_a_policy_of_a_known_servo_is_for_that_servo(tmp_path, capsys) -> None:
    """The asset's servo is another; a loop that the servo closed itself is not deployed."""
    assert train(tmp_path, "--iterations", "1", "--force", "sts3215") == 0
    assert card_of(tmp_path).servo == "sts3215"
    words = ["deploy", "--policy", str(tmp_path / "policy.onnx"), "--port", "virtual"]
    assert main([*words, "--out", str(tmp_path / "runs")]) == 2
    assert "servo sts3215, this bench xc330_t288_t" in capsys.readouterr().err
    assert main([*words, "--servo", "sts3215", "--out", str(tmp_path / "runs")]) == 2
    assert "of duty per rad 5.22, this bench closes one of" in capsys.readouterr().err
    assert train(tmp_path / "none", "--servo", "sts") == 2
    assert "sts3215" in capsys.readouterr().err


def test_a_policy_trains_on_a_model_file_and_its_network(tmp_path, capsys) -> None:
    """A learned actuator with friction; what only a load cell sees is left out; hashes are kept."""
    network = write_force_network(tmp_path / "force.pt", force_network("mlp"), "mlp")
    effects = {"coulomb_friction": {"force": 0.4}, "load_cell_lag": {"time_constant": 0.02}}
    model = stated_model("learned", {"file": "force.pt", "spool_radius": 0.0125}, effects)
    file = tmp_path / "model.toml"
    write_model(file, model)
    assert train(tmp_path / "policy", "--force", str(file), "--iterations", "1") == 0
    (evaluate,) = proposed(capsys.readouterr().out)
    assert main([*evaluate, "--no-plots", "--out", str(tmp_path / "comparison")]) == 0
    assert "model.toml" in capsys.readouterr().out
    card = card_of(tmp_path / "policy")
    assert card.model == file_hash(file)
    assert card.training.force == "model.toml"
    assert next(iter(card.training.files)) == "finger.usda"
    assert {"model.toml", "force.pt"} < card.training.files.keys()
    assert train(tmp_path / "other", "--force", str(network), "--iterations", "1") == 0
    assert card_of(tmp_path / "other").model is None
    assert card_of(tmp_path / "other").training.files["force.pt"] == file_hash(network)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--force", "none.toml"], "error: none.toml: a model is a TOML file"),
        (["--force", "none.pt"], "error: none.pt: "),
        (["--force", "nets/a.onnx"], "a training takes the .safetensors beside it"),
        (["--randomise", "joint_springs"], "did you mean 'joint_spring'"),
        (["--iterations", "0"], "iterations must be positive; it is 0"),
        pytest.param(
            ["--device", "cuda"],
            "device cuda needs an NVIDIA GPU",
            marks=pytest.mark.skipif(torch.cuda.is_available(), reason="here is one"),
        ),
        (["--finger", "pendulum"], "a goal angle must mean one point"),
    ],
)
def test_what_cannot_be_trained_is_one_line(tmp_path, capsys, words, said) -> None:
    """Exit code 2 and one line on stderr."""
    assert train(tmp_path, *words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_a_model_without_a_network_needs_no_trust(tmp_path: Path) -> None:
    """To say it anyway does no harm."""
    values = {"gain": 4.0, "spool_radius": 0.0125}
    path = tmp_path / "model.toml"
    write_model(path, stated_model("ideal", values))
    words = ["--force", str(path), "--trust", "--iterations", "1"]
    assert train(tmp_path / "policy", *words) == 0
