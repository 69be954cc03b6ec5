"""A diagnosis that was written is read again whole."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tendon_newton
from tendon_newton.cli import main
from tendon_newton.cli.diagnosis.diagnose import places, summary
from tendon_newton.data.model_file import write_model
from tendon_newton.diagnosis.explanation import Estimate, Setting
from tendon_newton.diagnosis.identifiability import Confounded
from tendon_newton.diagnosis.posterior import FittedSet, Posterior
from tendon_newton.diagnosis.report_words import headline
from tendon_newton.diagnosis.reporting.report_causes import errors_text
from tendon_newton.diagnosis.reporting.report_tables import key_numbers
from tendon_newton.diagnosis.result import (
    ActuatorFound,
    CandidateScore,
    Criterion,
    Diagnosis,
    Rival,
    write_diagnosis,
)
from tendon_newton.errors import InvalidDataset, InvalidDiagnosis
from tests.bad_input.damage import refusal
from tests.diagnosis.made_up import EXAMPLE, VERDICTS, diagnosis, named
from tests.proposed import proposed

KT = Estimate(value=0.4, ci95=(0.3, 0.5), unit="N m/A", flat=True)
CRITERION = Criterion(name="residuals", value=0.2, bar=0.1, passed=True)


def written(folder: Path, found: Diagnosis) -> Path:
    """Write the files that a diagnosis is read from."""
    folder.mkdir()
    write_model(folder / "model.toml", found.model)
    write_diagnosis(folder / "diagnosis.json", found)
    return folder


@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_diagnosis_comes_back_as_it_was(verdict, tmp_path: Path) -> None:
    """Every key of the file, the line that is printed, and the model."""
    found = diagnosis(verdict)
    out = written(tmp_path / "out", found)
    again = tendon_newton.load_diagnosis(out)
    table = json.loads((out / "diagnosis.json").read_text())
    assert again.to_json() == {key: value for key, value in table.items() if key != "files"}
    assert repr(again) == repr(found)
    assert again.model.effects == found.model.effects
    assert tendon_newton.load_diagnosis(out / "diagnosis.json").to_json() == again.to_json()
    if verdict == "partly_explained":
        assert len(again.plot().axes) == 2


def test_what_is_left_of_further_signals_is_told_and_comes_back(tmp_path: Path) -> None:
    """Encoders on joints: in the file, without each cause too, and in the report's numbers."""
    found = diagnosis("explained")
    more = {
        name: replace(getattr(found, name), others_rmse={"joint": size})
        for name, size in (("baseline", 0.02), ("extended", 2e-4))
    }
    effects = [replace(e, without=replace(e.without, others_rmse={"joint": 0.01}))
               for e in found.effects]  # fmt: skip
    found = replace(found, noise_others={"joint": 1e-4}, effects=tuple(effects), **more)
    out = written(tmp_path / "out", found)
    again = tendon_newton.load_diagnosis(out)
    assert again.to_json() == found.to_json()
    assert found.to_json()["effects"][0]["gain"]["joint_rmse"] == [0.01, 2e-4]
    (told,) = [row for row in key_numbers(again) if row["label"] == "joint angle, RMS error"]
    assert told["value"] == "20.0 → 0.200 mrad"
    assert errors_text(again.extended, again.scale).endswith("0.200 mrad (joint angle)")


def test_what_is_seldom_said_comes_back_too(tmp_path: Path) -> None:
    """Suspects, rivals, another actuator, fitted numbers, criteria, benches with numbers."""
    found = diagnosis("explained")
    tried = CandidateScore(
        name="tendon_slack", score=0.1, values={"length": 0.01}, at_bound={"length": 0.01},
        criteria=(CRITERION,), acts_in=("a.csv",), looked_at=2,
    )  # fmt: skip
    found = replace(
        found,
        suspected=(named("load_cell_bias", 0.5, reason="It is small.", criteria=(CRITERION,)),),
        rivals=(Rival(name="lag", effects=(), held_out=1.0, errors=found.extended, chosen=True),),
        actuator=ActuatorFound(
            stated="ideal", kind="pwm_servo", parameters={"torque_constant": KT},
            without=found.baseline,
        ),
        fitted={"gain": KT},
        candidates=(tried,),
        confounded=(Confounded(first="a.b", second="c.d", correlation=0.99),),
        start={"command_delay": {"delay": 0.1}},
        recorded=(Setting(bench="finger", seconds=3.0),),
        finished=False,
        servos=2,
    )  # fmt: skip
    out = written(tmp_path / "out", found)
    assert tendon_newton.load_diagnosis(out).to_json() == found.to_json()


def test_what_is_no_diagnosis_is_refused(tmp_path: Path) -> None:
    """A broken file says where; a diagnosis that is taken for a dataset says what takes it."""
    out = written(tmp_path / "out", diagnosis("explained"))
    with pytest.raises(InvalidDataset, match="holds a diagnosis: name the dataset") as refused:
        tendon_newton.load_dataset(out)
    assert [words[0] for words in proposed(str(refused.value).partition(" says")[0])] == ["explain"]
    table = json.loads((out / "diagnosis.json").read_text())
    (out / "diagnosis.json").write_text(json.dumps(table | {"noise_floor": {}}))
    with pytest.raises(InvalidDiagnosis, match="theta must be a finite number"):
        tendon_newton.load_diagnosis(out)


def test_the_commands_that_an_answer_proposes_can_be_typed(tmp_path: Path, capsys) -> None:
    """A space in the folder's name included; a cause's number in the answer is told beside it.

    No experiment is proposed that would answer that no other set is open.
    """
    found = diagnosis("partly_explained")
    out = written(tmp_path / "my answer", found)
    own = FittedSet(weight=0.5, causes=(), numbers=(), covariance=np.zeros((0, 0)))
    (explain,), (_, experiment) = (
        proposed("\n".join(places(out, one)))
        for one in (replace(found, posterior=Posterior(sets=sets)) for sets in ((own,), (own, own)))
    )
    assert experiment[0] == "experiment"
    assert main(explain) == 0
    capsys.readouterr()
    assert main([*explain, "command_delay"]) == 0
    assert "In the answer, beside all that was found, its delay 22.9" in capsys.readouterr().out


def test_a_search_that_was_cut_short_finds_nothing_about_causes() -> None:
    """To name none after a second is no word on any of them."""
    known = replace(diagnosis("unexplained"), start={"command_delay": {"delay": 0.1}})
    assert "a gap beyond what the starting model has, and no cause" in headline(known)
    assert "Already in the model that was started from: command_delay 100 ms" in summary(known)
    cut = replace(diagnosis("unexplained"), finished=False)
    assert "UNFINISHED: There is a gap. The time ended before" in summary(cut)
    assert "no effect of the catalogue accounts for it" not in summary(cut)


def test_results_do_not_replace_what_they_are_made_of(tmp_path: Path, capsys) -> None:
    """A dataset's own model, its recordings, those of another, and an earlier answer stay."""
    data, link = str(tmp_path / "data"), tmp_path / "link"
    shutil.copytree(EXAMPLE, data)
    link.symlink_to(data)
    model = str(link / "model.toml")
    for words in (
        ["diagnose", data, "--out", str(link)],
        ["diagnose", data, "--against", str(tmp_path), "--out", str(tmp_path)],
        ["simulate", data, "--model", model, "--out", data],
        ["diagnose", data, "--model", model, "--out", data],
        ["simulate", str(EXAMPLE), "--model", model, "--out", data],
        ["servo", "xl330", "--out", data],
        ["demo", "--out", data],
    ):
        assert "results need a folder of their own" in refusal(words, capsys)
