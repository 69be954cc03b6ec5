"""``evaluate-force`` compares what ``train-force`` wrote, and refuses what makes no sense."""

import json
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tests.bad_input.damage import refusal
from tests.train.actuator.servo_logs import write_servo_dataset

pytestmark = pytest.mark.usefixtures("own_trust")
SHORT = ("--epochs", "2", "--windows-per-epoch", "1024", "--batch", "256")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset of a minute of training."""
    return write_servo_dataset(tmp_path_factory.mktemp("data"))


def train(dataset: Path, out: Path, network: str, seed: int) -> int:
    """Train a network as from the command line."""
    words = ["--network", network, "--seed", str(seed), "--out", str(out), *SHORT]
    return main(["train-force", str(dataset), *words])


def test_a_user_trains_and_compares_networks(dataset, tmp_path, capsys) -> None:
    """Two seeds of one network and another one: every number in JSON, and tables."""
    nets = tmp_path / "nets"
    assert [train(dataset, nets, "mlp", 0), train(dataset, nets, "mlp", 1)] == [0, 0]
    assert train(dataset, nets, "transformer", 0) == 0
    assert "held-out force error" in capsys.readouterr().out
    words = ["--networks", str(nets), "--out", str(tmp_path / "out")]
    assert main(["evaluate-force", str(dataset), *words]) == 0
    table = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    models = {model["name"]: model for model in table["models"]}
    assert list(models) == [
        "mlp-paper-0",
        "mlp-paper-1",
        "transformer-paper-0",
        "ideal",
        "ideal refitted",
    ]
    assert len({model["pooled"]["rows"] for model in models.values()}) == 1
    assert [e["hold"] for e in table["experiments"]] == [1.0, 2.0, None, None]
    assert table["experiments"][0]["families"]["mlp (paper)"]["count"] == 2
    assert table["better_ideal"] in ("ideal", "ideal refitted")
    tables = (tmp_path / "out" / "evaluation.md").read_text()
    assert "| finger: steps, held 2 s |" in tables


def test_a_network_is_not_tested_on_what_it_was_trained_on(dataset, tmp_path, capsys) -> None:
    """A dataset whose test recording was a train recording of the network is refused."""
    assert train(dataset, tmp_path / "nets", "mlp", 0) == 0
    listing = dataset / "dataset.toml"
    text = listing.read_text()
    try:
        listing.write_text(text.replace('split = "train"', 'split = "test"'))
        words = ["--networks", str(tmp_path / "nets"), "--out", str(tmp_path / "out")]
        assert main(["evaluate-force", str(dataset), *words]) == 2
    finally:
        listing.write_text(text)
    assert "was trained on" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["--networks", "none.pt"],
            "none.pt: a force network is a safetensors or TorchScript file",
        ),
        (["--networks", "."], "no force network (*.safetensors, *.pt) in this folder"),
    ],
)
def test_a_wrong_file_is_one_line(dataset, tmp_path, monkeypatch, capsys, words, said) -> None:
    """Exit code 2 and one line on stderr."""
    monkeypatch.chdir(tmp_path)
    assert said in refusal(["evaluate-force", str(dataset), *words, "--out", "out"], capsys)
