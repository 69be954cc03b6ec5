"""The stages of a reproduction on a bench of two minutes."""

import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import warp as wp

from lab.tests.reproduction.tiny import SETTINGS, TinyBench
from tendon_lab.reproduction.outcome import Outcome, row
from tendon_lab.reproduction.physical import starting_model
from tendon_lab.reproduction.reproduction import MODELS, NotDone, Reproduction
from tendon_lab.reproduction.reproduction_report import rows_table, write_report
from tendon_lab.reproduction.steps.stage_list import REPRODUCTION_STAGES, run_stages, with_needs
from tendon_lab.reproduction.steps.tip_stage import SINES
from tendon_newton.data.model_file import NamedValues, load_model, write_model
from tendon_newton.errors import InvalidOutput, UnknownName
from tendon_newton.scheduler import InTurn, JobOptions, open_executor
from tests.bad_input.damage import refusal

ONLY = ("tip",)


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
    """Run a stage and what it needs, on recordings that are there."""
    shutil.copytree(recorded, out / "data" / "unit_0")
    reproduction = Reproduction(
        settings=SETTINGS, out=out, bench=TinyBench(), causes=causes, executor=InTurn()
    )
    return reproduction, run_stages(reproduction, ONLY)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_numbers(recorded: Path, causes: Path, tmp_path: Path) -> None:
    """Two runs agree to the last bit; the report holds every number."""
    first, found = reproduced(recorded, tmp_path / "a", causes)
    _, again = reproduced(recorded, tmp_path / "b", causes)
    assert list(found) == ["recordings", "diagnosis", "networks", "tip"]
    assert [asdict(o)["rows"] for o in found.values()] == [
        asdict(o)["rows"] for o in again.values()
    ]
    assert found["tip"].numbers == again["tip"].numbers
    errors = found["tip"].numbers["tip_error_mm"]
    assert set(errors["open_sine"]) == set(MODELS)
    for kind in SINES:  # two minutes of data; the paper's Transformer is 41 % below
        assert errors[kind]["physical"][0] < 0.4 * errors[kind]["ideal"][0]
    (table, page) = write_report(first, found)
    assert json.loads(table.read_text())["stages"]["tip"]["rows"]
    text = page.read_text()
    assert "# The paper's results, reproduced (tiny)" in text
    assert "**The bench is virtual.**" in text
    assert "| tip, sinusoid about 0.2 rad | Transformer, RMSE | 8.61 mm |" in text
    assert "Not run: force" in text

    told: list[str] = []
    later = replace(first, tell=told.append)
    assert run_stages(later, ONLY) == found
    assert told == []  # nothing was done again
    assert run_stages(later, ["recordings"]) == found  # and all that is there is told


def test_a_fitted_model_is_a_file_for_other_verbs(recorded, causes, tmp_path) -> None:
    """The physical model of a bench has the causes that were given, and fitted numbers."""
    reproduction = Reproduction(
        settings=SETTINGS, out=tmp_path, folders=(recorded,), causes=causes, executor=InTurn()
    )
    run_stages(reproduction, ["diagnosis"])
    model = load_model(tmp_path / "models" / "unit_0" / "physical.toml")
    assert [effect.name for effect in model.effects] == ["load_dependent_friction"]
    assert model.effects[0].values["coefficient"] != 0.2
    assert 0.5 < float(model.actuator.values["torque_constant"]) < 3.0


@pytest.mark.slow
def test_two_processes_give_the_same_numbers(recorded: Path, tmp_path: Path) -> None:
    """Networks that two processes train are those of one."""
    found = []
    for name, options in (("one", JobOptions()), ("two", JobOptions(jobs=2))):
        (tmp_path / name).mkdir()
        with open_executor(options) as executor:
            reproduction = Reproduction(
                settings=SETTINGS, out=tmp_path / name, folders=(recorded,), executor=executor
            )
            found.append(run_stages(reproduction, ["networks"]))
    assert found[0] == found[1]


def test_a_folder_has_one_reproduction_and_keeps_all_else(recorded: Path, tmp_path: Path) -> None:
    """Other settings and recordings are refused in words; a user's own files stay in any case."""
    folder, out = tmp_path / "bench", tmp_path / "out"
    shutil.copytree(recorded, folder)
    for theirs in ("results/my_thesis", "networks/mine", "results/0123456789abcdef", "models"):
        (out / theirs).mkdir(parents=True)
        (out / theirs / "data.csv").write_text("x")
    whole = Reproduction(settings=SETTINGS, out=out, folders=(folder,), executor=InTurn())
    counted = [run_stages(replace(whole), ["recordings"]) for _ in range(2)]
    assert counted[0] == counted[1]
    before = contents(out)
    with pytest.raises(InvalidOutput, match="began with seed = 0, and now it is 1; use another"):
        run_stages(replace(whole, settings=replace(SETTINGS, seed=1)), ["recordings"])
    listing = folder / "recordings" / "dataset.toml"
    listing.write_text(listing.read_text() + "# changed\n")
    with pytest.raises(InvalidOutput, match="began with recordings"):
        run_stages(replace(whole), ["recordings"])
    assert contents(out) == before
    assert sum(path.name == "data.csv" for path in before) == 4


def contents(folder: Path) -> dict[Path, bytes]:
    """Return all files of a folder."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_an_interrupted_stage_goes_on_with_its_next_job(recorded: Path, tmp_path: Path) -> None:
    """A result that is kept is read; another job is done, and its result is as a file has it."""
    reproduction = Reproduction(
        settings=SETTINGS, out=tmp_path, folders=(recorded,), executor=InTurn()
    )
    assert reproduction.each(noted, ["a"]) == [["a", 1]]
    assert reproduction.each(noted, ["a", "b"]) == [["a", 1], ["b", 2]]
    with pytest.raises(NotDone):
        replace(reproduction, executor=None).each(noted, ["c"])


def test_jobs_simulate_on_the_cpu(tmp_path: Path) -> None:
    """Also where Warp would take a GPU by itself; afterwards it does so again."""
    before = str(wp.get_device())
    reproduction = Reproduction(settings=SETTINGS, out=tmp_path, executor=InTurn())
    assert reproduction.each(default_device, [0], keep=False) == ["cpu"]
    assert str(wp.get_device()) == before


def default_device(reproduction: Reproduction, item: int) -> str:
    """Return where Warp puts an array that is not told."""
    return str(wp.zeros(1, dtype=float).device)


def noted(reproduction: Reproduction, name: str) -> tuple[str, int]:
    """Count the pieces that are really done, in a file."""
    log = reproduction.out / "done.txt"
    lines = [*(log.read_text().splitlines() if log.is_file() else ()), name]
    log.write_text("\n".join(lines))
    return name, len(lines)


def test_stages_bring_what_they_need() -> None:
    """The tip needs all models, recordings none."""
    assert with_needs(["tip"]) == {"tip", "networks", "diagnosis"}
    assert with_needs(["recordings"]) == {"recordings"}
    with pytest.raises(UnknownName, match="did you mean 'tip'"):
        with_needs(["tips"])
    assert set(REPRODUCTION_STAGES) == with_needs(tuple(REPRODUCTION_STAGES))


def test_an_unknown_stage_is_one_line(recorded, tmp_path, capsys) -> None:
    """Exit code 2, and the stages are listed."""
    words = ["reproduce", "--out", str(tmp_path), "--recordings", str(recorded), "--only", "tips"]
    assert "No stage named 'tips'" in refusal(words, capsys)


def test_rows_show_the_papers_value_beside_ours() -> None:
    """Median with least and greatest; an empty cell where the paper has no number."""
    rows = [
        row("tip", "a model", "mm", [3.0, 1.0, 2.0], paper=8.61),
        row("ramp", "gap", "N", [1.0], over="bench", differs="shown only"),
    ]
    lines = rows_table(rows).splitlines()
    assert lines[2] == "| tip | a model | 8.61 mm | 2 mm (1 to 3) | 3 benches |  |"
    assert lines[3] == "| ramp | gap |  | 1 N | 1 bench | shown only |"
