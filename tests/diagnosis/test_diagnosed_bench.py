"""Whoever uses a diagnosis uses it on its own bench, or is told."""

import json
from pathlib import Path

import pytest

from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, write_model
from tendon_newton.diagnosis.diagnosed_bench import open_model, recorded_numbers
from tendon_newton.errors import InvalidParameter
from tendon_newton.exports.source import read_source
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.randomisation import on_diagnosed_finger
from tests.bad_input.damage import refusal
from tests.importers.logs import recording
from tests.made import stated_model


@pytest.fixture
def found(tmp_path: Path) -> Path:
    """A diagnosis of the thumb, which is not the bench that verbs take where none is named."""
    return diagnosis(tmp_path / "found", "thumb")


def diagnosis(folder: Path, *benches: str) -> Path:
    """Write what a diagnosis of some benches leaves behind, as far as other verbs read it."""
    folder.mkdir()
    write_model(folder / "model.toml", ideal())
    estimate = {"value": 0.5, "ci95": [0.4, 0.6], "unit": "N"}
    cause = {"name": "coulomb_friction", "side": "actuator", "parameters": {"force": estimate}}
    table = {
        "schema": 1,
        "verdict": "explained",
        "wall_time_s": 1.0,
        "recorded": [{"bench": bench, "seconds": 9.0} for bench in benches],
        "effects": [cause | {"indistinguishable_from": []}],
    }
    (folder / "diagnosis.json").write_text(json.dumps(table))
    return folder


def ideal() -> Model:
    """Return the nominal model."""
    values = {"gain": 4.2, "spool_radius": 0.0125}
    return stated_model("ideal", values)


@pytest.mark.parametrize("file", ["", "diagnosis.json", "model.toml"])
def test_an_export_is_of_the_bench_that_was_diagnosed(file: str, found: Path) -> None:
    """Named by its folder or by either of its files; nobody states a bench."""
    assert read_source(found / file, None, None).mechanism.name == "thumb"


def test_another_spool_than_the_assets_is_told(tmp_path: Path, caplog) -> None:
    """The model's counts, and three radii gave three motions without a word."""
    for radius in (0.0125, 0.012505, 0.011):
        write_model(tmp_path / "model.toml", stated_model("ideal", {"spool_radius": radius}))
        open_model(tmp_path / "model.toml", [load_mechanism("finger")])
    (told,) = (one.getMessage() for one in caplog.records)
    assert told.endswith("its spool_radius of 0.011 m counts, not 0.0125 m of finger")


def test_another_bench_than_the_diagnosed_one_is_refused(found: Path) -> None:
    """Its model.toml alone is a servo, which another bench may have."""
    for named in (found, found / "diagnosis.json"):
        with pytest.raises(InvalidParameter, match="to carry its servo over"):
            read_source(named, "finger", None)
    assert read_source(found / "model.toml", "finger", None).mechanism.name == "finger"


def test_numbers_that_only_recordings_had_are_told(found: Path) -> None:
    """A pendulum's load is none of its asset: an export of it says which numbers are others."""
    file = found / "diagnosis.json"
    recorded = {"bench": "thumb", "seconds": 9.0, "bench_overrides": {"mass": [0.1, 0.2]}}
    file.write_text(json.dumps(json.loads(file.read_text()) | {"recorded": [recorded]}))
    assert recorded_numbers(found, "thumb") == ("mass",)
    assert recorded_numbers(found, "finger") == ()


def test_recordings_of_another_bench_are_refused(found: Path, tmp_path: Path) -> None:
    """The commands that are replayed say the bench as well."""
    write_dataset(tmp_path / "data", [recording()], [])
    with pytest.raises(InvalidParameter, match="it is to be used on finger"):
        read_source(found, None, tmp_path / "data")


def test_of_several_benches_one_must_be_named(tmp_path: Path) -> None:
    """No one of them stands for the others."""
    several = diagnosis(tmp_path / "several", "spring_weak", "thumb")
    with pytest.raises(InvalidParameter, match="one of its benches: spring_weak, thumb"):
        read_source(several, None, None)
    assert read_source(several, "thumb", None).mechanism.name == "thumb"


@pytest.mark.parametrize("verb", ["export", "simulate"])
def test_verbs_refuse_in_one_line(verb, found, tmp_path, capsys) -> None:
    """Each verb that simulates a diagnosis beside recordings of another bench."""
    data = str(tmp_path / "data")
    write_dataset(tmp_path / "data", [recording()], [])
    words = {
        "export": [str(found), "--to", "mujoco", "--dataset", data],
        "simulate": [data, "--model", str(found)],
    }
    line = refusal([verb, *words[verb], "--out", str(tmp_path / "out")], capsys)
    assert "a diagnosis is used on its own bench, thumb" in line


def test_a_training_is_on_the_finger_of_the_diagnosis(found: Path) -> None:
    """Said by the model or by the intervals; another finger that is stated is refused."""
    for force in (found / "model.toml", found / "diagnosis.json", found):
        assert on_diagnosed_finger(EnvironmentConfig(force=str(force))).finger == "thumb"
