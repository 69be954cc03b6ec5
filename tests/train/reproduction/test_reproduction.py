"""The stages of a reproduction on a bench of two minutes."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.errors import UnknownName
from tendon_newton.model_file import NamedValues, load_model, write_model
from tests.train.reproduction.tiny import SETTINGS, TinyBench
from train.reproduction import policy_stage
from train.reproduction.outcome import Outcome, mean_interval, row
from train.reproduction.physical import starting_model
from train.reproduction.report import rows_table, write_report
from train.reproduction.reproduction import MODELS, Reproduction
from train.reproduction.stages import STAGES, run_stages, with_needs

ONLY = ("ramp", "tip")


@pytest.fixture(scope="module")
def causes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model file with one cause; looking for causes takes minutes."""
    path = tmp_path_factory.mktemp("causes") / "causes.toml"
    friction = NamedValues(name="load_dependent_friction", values={"coefficient": 0.2})
    write_model(path, replace(starting_model(), effects=(friction,)))
    return path


def reproduced(
    recorded: Path, out: Path, causes: Path
) -> tuple[Reproduction, Mapping[str, Outcome]]:
    """Run two stages and what they need, on recordings that are there."""
    shutil.copytree(recorded, out / "data" / "unit_0")
    reproduction = Reproduction(settings=SETTINGS, out=out, bench=TinyBench(), causes=causes)
    return reproduction, run_stages(reproduction, ONLY)


def test_the_same_seed_gives_the_same_numbers(recorded: Path, causes: Path, tmp_path: Path) -> None:
    """Two runs agree to the last bit; the report holds every number, and figures are drawn."""
    first, found = reproduced(recorded, tmp_path / "a", causes)
    _, again = reproduced(recorded, tmp_path / "b", causes)
    assert list(found) == ["recordings", "networks", "diagnosis", "hybrids", "ramp", "tip"]
    assert [asdict(o)["rows"] for o in found.values()] == [
        asdict(o)["rows"] for o in again.values()
    ]
    assert found["tip"].numbers == again["tip"].numbers
    assert set(found["tip"].numbers["tip_error_mm"]["open_sine"]) == set(MODELS)
    assert (tmp_path / "a" / "figures" / "tip_sine.png").stat().st_size > 10_000
    assert (tmp_path / "a" / "figures" / "ramp.png").stat().st_size > 10_000
    (table, page) = write_report(first, found)
    assert json.loads(table.read_text())["stages"]["tip"]["rows"]
    text = page.read_text()
    assert "# The paper's results, reproduced (tiny)" in text
    assert "**The bench is virtual.**" in text
    assert "| tip, sinusoid about 0.2 rad | Transformer, RMSE | 8.61 mm |" in text
    assert "Not run: force" in text
    for outcome in found.values():
        for figure in outcome.figures:
            assert "Virtual bench, no measurement." in figure.caption

    told: list[str] = []
    later = Reproduction(
        settings=SETTINGS, out=first.out, bench=TinyBench(), causes=causes, tell=told.append
    )
    assert run_stages(later, ONLY)["tip"] == found["tip"]
    assert told == []  # nothing was done again


def test_a_fitted_model_is_a_file_for_other_verbs(
    recorded: Path, causes: Path, tmp_path: Path
) -> None:
    """The physical model of a bench has the causes that were given, and fitted numbers."""
    reproduction = Reproduction(settings=SETTINGS, out=tmp_path, folders=(recorded,), causes=causes)
    run_stages(reproduction, ["diagnosis"])
    model = load_model(tmp_path / "models" / "unit_0" / "physical.toml")
    assert [effect.name for effect in model.effects] == ["load_dependent_friction"]
    assert model.effects[0].values["coefficient"] != 0.2
    assert 0.5 < float(model.actuator.values["torque_constant"]) < 3.0


def test_given_policies_climb_on_every_bench(recorded: Path, tmp_path: Path) -> None:
    """A row for each, named after its folder; the paper's value stands beside those it has."""
    policy = tmp_path / "ideal" / "policy.onnx"
    policy.parent.mkdir()
    policy.touch()
    settings = replace(SETTINGS, units=(0, 4))
    reproduction = Reproduction(
        settings=settings, out=tmp_path / "out", bench=TinyBench(), policies=(policy,)
    )
    (found,) = policy_stage.run(reproduction).rows
    assert (found.measure, found.paper) == ("ideal source, 4.2 N/rad, tip RMSE", 24.0)
    assert (found.low, found.high, found.count) == pytest.approx((12.0, 16.0, 2))
    given = Reproduction(settings=SETTINGS, out=tmp_path, folders=(recorded,), policies=(policy,))
    assert policy_stage.run(given).rows == ()


def test_stages_bring_what_they_need() -> None:
    """The tip needs all models; the hybrids need the diagnosis."""
    assert with_needs(["tip"]) == {"tip", "networks", "diagnosis", "hybrids"}
    with pytest.raises(UnknownName, match="did you mean 'tip'"):
        with_needs(["tips"])
    assert set(STAGES) == with_needs(tuple(STAGES))


def test_an_unknown_stage_is_one_line(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, and the stages are listed."""
    words = ["reproduce", "--out", str(tmp_path), "--recordings", str(recorded), "--only", "tips"]
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "No stage named 'tips'" in line


def test_rows_show_the_papers_value_beside_ours() -> None:
    """Median with least and greatest; an empty cell where the paper has no number."""
    rows = [
        row("tip", "a model", "mm", [3.0, 1.0, 2.0], paper=8.61),
        row("ramp", "gap", "N", [1.0], over="bench", differs="shown only"),
    ]
    lines = rows_table(rows).splitlines()
    assert lines[2] == "| tip | a model | 8.61 mm | 2 mm (1 to 3) | 3 benches |  |"
    assert lines[3] == "| ramp | gap |  | 1 N | 1 bench | shown only |"


def test_an_interval_is_students() -> None:
    """Mean of 1, 2, 3 with t(0.975, 2) = 4.303 and a standard error of 1 / sqrt(3)."""
    mean, low, high = mean_interval([1.0, 2.0, 3.0])
    assert mean == 2.0
    assert high - mean == mean - low == pytest.approx(4.3027 / 3.0**0.5, rel=1e-4)
