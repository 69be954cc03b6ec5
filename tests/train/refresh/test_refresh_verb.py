"""The verb, on a virtual bench, with budgets that only show that it goes through."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tendon_hardware.deployment.deploy_log import policy_span
from tendon_newton.cli import main
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.workflows.deployment import drive
from tendon_newton.workflows.options import DeployOptions
from tendon_newton.workflows.packaged_policies import policy_file
from tendon_newton.workflows.refreshing import is_of
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.refresh.refresh_logs import read_logs
from tests.hardware.silent_operator import SilentOperator
from tests.physics.runs import ideal_model
from tests.train.policy.small import short_training
from tests.train.policy.test_training import train

STAIRS = 16.5  # s


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a policy, a model, and a log of the policy on a worn bench."""
    folder = tmp_path_factory.mktemp("bench")
    # the end of its range makes a policy that has learned nothing move the spool
    config = short_training(iterations=1, command_range=(-0.4, 6.28), pay_out=(-0.4, 0.1))
    learned = folder / "learned"
    learned.mkdir()
    policy = export_policy(learned, train(config, learned), config).onnx
    # nothing but numbers that other tests compile as well
    write_model(folder / "model.toml", replace(ideal_model(), fit=("gain",)))
    drive(
        DeployOptions(
            policy=policy,
            port="virtual:finger:0:friction",
            goals="stairs",
            duration=STAIRS,
            out=folder / "deployments",
            faster_than_real_time=True,
        ),
        SilentOperator(),
    )
    return folder


def words(bench: Path, *more: str) -> list[str]:
    """Return the words of the verb."""
    paths = {"model": bench / "model.toml", "policy": bench / "learned" / "policy.onnx"}
    named = [word for key, path in paths.items() for word in (f"--{key}", str(path))]
    return ["refresh", str(bench / "deployments"), *named, "--out", str(bench / "out"), *more]


def test_a_deployment_says_how_long_its_policy_acted(bench: Path) -> None:
    """The log goes on after the last of the steps: the finger is opened."""
    (log,) = (bench / "deployments").glob("*.mcap")
    span = policy_span(log)
    assert span == pytest.approx(STAIRS, abs=0.06)
    (whole,), (cut,) = read_logs([log]), read_logs([log], policy_span)
    assert cut.duration == pytest.approx(STAIRS, abs=0.06)
    assert whole.duration > cut.duration + 0.1


def test_a_log_knows_the_policy_that_flew_it(bench: Path) -> None:
    """By its hash, of either file of a training; the packaged policy is another."""
    (log,) = (bench / "deployments").glob("*.mcap")
    assert is_of(bench / "learned" / "policy.onnx", log)
    assert is_of(bench / "learned" / "policy.pt", log)
    assert not is_of(policy_file(Path("finger-stairs")), log)


@pytest.mark.slow
def test_the_verb_goes_from_a_log_to_a_new_policy(bench, capsys) -> None:
    """All files are there; a second call does nothing anew; more iterations go on."""
    asked = words(bench, "--anyway", "--iterations", "1", "--suspects", "spool_radius_error")
    port = ["--port", "virtual:finger:0:friction", "--faster-than-real-time"]
    assert main([*asked, *port]) == 0
    out = bench / "out"
    for name in (
        "diagnosis/diagnosis.json",
        "diagnosis/report.html",
        "model.toml",
        "refresh.html",
        "training/policy.json",
        "climb.png",
    ):
        assert (out / name).stat().st_size > 0, name
    table = json.loads((out / "refresh.json").read_text(encoding="utf-8"))
    stages = table["stages"]
    assert list(stages) == ["drift", "model", "training", "bench", "figures", "better"]
    assert (out / "training/policy.onnx").exists() is stages["better"]["written"]
    places = [(f["policy"], f["where"].split(":")[0]) for f in stages["figures"]]
    assert places == [
        ("old", "simulation, as the model had it"),
        ("old", "simulation, corrected"),
        ("new", "simulation, corrected"),
        ("old", "bench, now"),
        ("new", "bench, now"),
    ]
    assert load_model(out / "model.toml").actuator.values["gain"] != 4.2
    before = (out / "model.toml").stat().st_mtime_ns
    capsys.readouterr()
    assert main([*asked, *port]) == 0
    assert "iteration" not in capsys.readouterr().out
    assert (out / "model.toml").stat().st_mtime_ns == before
    more = [word if word != "1" else "2" for word in asked]
    assert main([*more, *port]) == 0
    shown = capsys.readouterr().out
    assert "iteration    2 of 2" in shown
    assert "iteration    1 of" not in shown


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--iterations", "0"], "iterations must be 1 or more"),
        (["--suspects", "rust"], "No effect named 'rust'"),
        (["--reference", "nowhere.mcap"], "nowhere.mcap"),
    ],
)
def test_words_that_make_no_sense_are_refused(more, message, bench, capsys) -> None:
    """One line and exit code 2."""
    assert main(words(bench, *more)) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
