"""Every cause that was tried has an account, and it says in plain words what stopped it."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.diagnosis.accounts.account_file import Accounts, read_accounts
from tendon_newton.diagnosis.accounts.account_words import line, sentences
from tendon_newton.diagnosis.result import (
    CandidateScore,
    Criterion,
    Diagnosis,
    NamedEffect,
    write_diagnosis,
)
from tendon_newton.diagnosis.search.decide.account import (
    ADDED,
    BEHIND,
    HELD_OUT,
    IN_RANGE,
    LOSS,
    OPEN,
    TOGETHER,
    acts_in,
)
from tendon_newton.errors import InvalidDiagnosis
from tests.diagnosis.made_up import diagnosis, named

PRICE = 0.1  # [nat per row]
PASSED = (
    Criterion(name=LOSS, value=1.2, bar=PRICE, passed=True),
    Criterion(name=HELD_OUT, value=0.5, bar=PRICE, passed=True),
    Criterion(name=IN_RANGE, value=0.0, bar=0.0, passed=True),
)
CAUSES = (
    CandidateScore(name="command_delay", score=0.40, values={"delay": 0.02}, criteria=PASSED),
    CandidateScore(name="viscous_friction", score=0.30, values={"coefficient": 0.8},
        criteria=PASSED),
    CandidateScore(name="speed_limit", score=0.82, values={"limit": 7.0},
        criteria=(Criterion(name=ADDED, value=0.05, bar=PRICE, passed=False),),
        acts_in=("steps.csv",), looked_at=5),
    CandidateScore(name="backlash", score=0.2, values={"width": 0.01},
        criteria=(Criterion(name=ADDED, value=0.3, bar=PRICE, passed=True),
        Criterion(name=BEHIND, value=0.2, bar=0.0, passed=False))),
    CandidateScore(name="deadband", score=0.1, values={"width": 0.2}, at_bound={"width": 0.2},
        criteria=()),
    CandidateScore(name="force_saturation", score=-0.01, values={"limit": np.inf}, criteria=()),
)  # fmt: skip


def told(verdict: Any = "partly_explained", **changes: Any) -> Diagnosis:
    """A made-up diagnosis with an account of six causes."""
    return replace(diagnosis(verdict), candidates=CAUSES, **changes)


def accounts(folder: Path, found: Diagnosis) -> Accounts:
    """Write a diagnosis and read its accounts."""
    write_diagnosis(folder / "diagnosis.json", found)
    return read_accounts(folder)


def text(read: Accounts, name: str) -> str:
    """Return the account of one cause."""
    cause = read.find(name)
    assert cause is not None
    return "\n".join(sentences(cause))


def test_a_refused_cause_says_its_number_where_it_acts_and_what_it_lacks(tmp_path: Path) -> None:
    """A gain of 0.05 nat is 4.9 % off the residuals, and 0.1 nat is 9.5 %."""
    said = text(accounts(tmp_path, told()), "speed_limit")
    assert "speed_limit 7.00 rad/s explains 82 % of the gap alone" in said
    assert "acts in 1 of 5 recordings (steps.csv)" in said
    assert "it promises residuals 5 % smaller; 10 % smaller is asked" in said
    assert "large steps become ramps of one slope" in said
    assert "Record more like steps.csv" in said


def test_a_named_cause_says_what_it_passed(tmp_path: Path) -> None:
    """1 - exp(-0.5) is 39 %."""
    said = text(accounts(tmp_path, told()), "viscous_friction")
    assert "the data cannot tell it from actuator_lag" in said
    assert "it makes them 39 % smaller; 10 % smaller is asked" in said
    assert "To tell them apart, Record steps" in said


def test_each_way_of_being_stopped_has_its_own_words(tmp_path: Path) -> None:
    """Beaten in a real refit, at a bound, unsure, and refused with all that was found."""
    read = accounts(tmp_path, told())
    assert "was beaten: its residuals, with a price for every cause, are 22 % larger" in text(
        read, "backlash"
    )
    assert "width ended at the edge of the range" in text(read, "deadband")
    unsure = Criterion(name=OPEN, value=1.0, bar=0.0, passed=False)
    scores = (replace(CAUSES[0], criteria=(unsure,)),)
    assert "it is suspected, not named" in text(
        accounts(tmp_path, replace(told("no_gap"), candidates=scores)), "command_delay"
    )
    stop = Criterion(name=TOGETHER, value=0.45, bar=0.2, passed=False)
    scores = (replace(CAUSES[0], criteria=(*PASSED, stop)),)
    whole = accounts(tmp_path, replace(told("unexplained"), candidates=scores))
    assert "leave 45 % of the squared error above the noise; at most 20 %" in text(
        whole, "command_delay"
    )


def test_a_rival_is_no_refusal(tmp_path: Path) -> None:
    """A cause of the class of a named one is called that, whatever it did not pass."""
    rival = replace(CAUSES[2], name="actuator_lag", values={"time_constant": 0.05})
    read = accounts(tmp_path, replace(told(), candidates=(*CAUSES[:2], rival)))
    cause = read.find("actuator_lag")
    assert cause is not None
    assert line(cause).endswith("not told apart from viscous_friction")


def test_named_causes_stand_first_then_by_what_each_explains_alone(tmp_path: Path) -> None:
    """The order of the list is the order of interest."""
    names = [cause.name for cause in accounts(tmp_path, told()).causes]
    assert names[:3] == ["viscous_friction", "command_delay", "speed_limit"]


def test_a_number_at_an_infinite_null_does_not_break_the_file(tmp_path: Path) -> None:
    """JSON has no infinity: the file is read back without that number."""
    read = accounts(tmp_path, told())
    cause = read.find("force_saturation")
    assert cause.values == {}
    assert "force_saturation explains nothing alone." in text(read, "force_saturation")


def test_a_criterion_without_a_sentence_is_told_plainly(tmp_path: Path) -> None:
    """What a later release asks besides stands there with value and bar."""
    other = Criterion(name="agreement of two halves [1]", value=0.25, bar=0.5, passed=False)
    read = accounts(tmp_path, replace(told(), candidates=(replace(CAUSES[2], criteria=(other,)),)))
    assert "agreement of two halves [1]: 0.25, asked 0.5: not passed." in text(read, "speed_limit")


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("candidates", None, "candidates must be a list of objects"),
        ("candidates", [{"name": "x", "score": "much"}], "score must be a finite number"),
        ("candidates", [{"name": "x", "score": 1, "criteria": 3}], "criteria must be a list"),
        (
            "candidates",
            [{"name": "x", "score": 1, "parameters": 3}],
            "parameters must be an object",
        ),
    ],
)
def test_a_broken_account_is_refused_with_its_place(tmp_path, key, value, said) -> None:
    """The file, the entry and what came are named."""
    table = {**told().to_json(), key: value}
    path = tmp_path / "diagnosis.json"
    path.write_text(json.dumps(table))
    with pytest.raises(InvalidDiagnosis, match=said):
        read_accounts(path)


def test_the_verb_lists_all_and_explains_one(tmp_path, capsys) -> None:
    """One line each; a misspelt cause gets a suggestion, one that was not tried a reason."""
    write_diagnosis(tmp_path / "diagnosis.json", told())
    assert main(["explain", str(tmp_path)]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert rows[0] == "verdict: partly explained"
    assert sum(row.split()[:1] == ["speed_limit"] for row in rows) == 1
    assert main(["explain", str(tmp_path), "speed_limit"]) == 0
    assert "explains 82 %" in capsys.readouterr().out
    assert main(["explain", str(tmp_path), "speed_limits"]) == 2
    assert "did you mean 'speed_limit'" in capsys.readouterr().err
    assert main(["explain", str(tmp_path), "obstruction"]) == 0
    assert "obstruction was not tried" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("cause", "servos", "said"),
    [
        ("gain_error of servo 5", 2, "no servo 5: they have the servos 0 to 1."),
        ("gain_error of servo 1", 1, "no servo 1: they have servo 0 alone."),
        ("gain_error of servo 0", 1, "is of the only servo: ask for gain_error."),
        ("inertia_error of servo 1", 2, "of the bench, and of no servo: ask for inertia_error."),
    ],
)
def test_a_cause_of_a_servo_that_is_not_there_says_so(
    cause: str, servos: int, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The servos that are there, or the name to ask for, stand in the answer."""
    write_diagnosis(tmp_path / "diagnosis.json", told(servos=servos))
    assert main(["explain", str(tmp_path), cause]) == 0
    assert " ".join(capsys.readouterr().out.split()).endswith(said)


def test_a_cause_acts_where_it_moves_a_signal_beyond_what_is_left_over() -> None:
    """Two recordings: the angle moves by ten floors in the one, by a tenth in the other."""
    of_force = np.array([False, False, True] * 2)
    where = SimpleNamespace(
        recording=np.array([0, 0, 0, 1, 1, 1]),
        sizes=lambda scales: np.where(of_force, scales.force, scales.theta),
        signals=(("theta", ~of_force), ("force", of_force)),
    )
    study = SimpleNamespace(wholes=[SimpleNamespace(name=n) for n in ("a.csv", "b.csv")])
    pool: Any = SimpleNamespace(
        worlds=SimpleNamespace(where=where, study=study),
        floors=SimpleNamespace(theta=0.001, force=0.1),
    )
    before: Any = SimpleNamespace(residual=np.zeros(6))
    after: Any = SimpleNamespace(residual=np.array([0.01, 0.01, 0.0, 1e-4, 1e-4, 0.05]))
    assert acts_in(pool, before, after) == ("a.csv",)
    assert acts_in(pool, before, None) is None


def test_what_is_named_needs_no_hint(tmp_path: Path) -> None:
    """A cause that passed everything is not said to be easily confused."""
    alone: NamedEffect = named("command_delay", 0.02)
    said = text(accounts(tmp_path, replace(told(), effects=(alone,))), "command_delay")
    assert "What would tell" not in said
    assert "passed everything that is asked" in said
