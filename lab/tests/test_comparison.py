"""The comparison's tables, and its baseline."""

import json
from argparse import Namespace
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.results.__main__ import with_table
from lab.results.doubts import doubts
from lab.results.readme_table import origin
from lab.results.record import ROOT, Record, combined, fingerprint, records
from lab.results.tables import TABLES, shown
from lab.studies.comparison import bam
from lab.studies.comparison.four_numbers import Grid, fitted, simulate
from lab.studies.comparison.rows import alike, keep, of_bam, waits
from lab.studies.comparison.settings import at_price
from lab.studies.comparison.settings import table as settings_table
from lab.studies.comparison.splits import Split
from lab.studies.comparison.table import (
    OURS,
    REPEATS,
    TOLD,
    distinct_fits,
    errors,
    ratios,
    rests_on,
    shares_of_arm,
    tables,
)
from tests.physics.runs import ideal_model


def test_a_row_that_was_not_made_waits() -> None:
    """Nothing stands in for a fit that nobody has made."""
    text = tables(
        {
            "xl330: test kp 100": {
                "data sheet": {
                    "held_out": 12.34,
                    "trained": 5.67,
                    "numbers": 0,
                    "seconds": 0.0,
                    "says": "",
                }
            }
        }
    )
    assert "| data sheet, nothing fitted | 12.3 | 0 | 0 s |" in text
    assert "| Rhoban/bam m6 | waits |  |  |" in text
    assert "repeats" not in text


def test_a_search_that_has_not_ended_is_in_brackets() -> None:
    """It says so, or a model that it contains fits the training logs better."""
    made = {"held_out": 12.34, "trained": 5.0, "numbers": 1, "seconds": 1.0, "says": ""}
    rows = {
        "bam m1": made,
        "bam m2": made | {"says": "64 trials in 6 searches, not converged"},
        "bam m3": made | {"trained": 5.1},
    }
    text = tables({"xl330: test kp 100": rows, "xl330: test kp 200": {**rows, "bam m2": made}})
    assert "| Rhoban/bam m1 | 12.3 | 12.3 |" in text
    assert "| Rhoban/bam m2 | (12.3) | 12.3 |" in text
    assert "| Rhoban/bam m3 | (12.3) | (12.3) |" in text


def cells(**left: float) -> dict[str, dict[str, Any]]:
    """Return rows that leave some errors."""
    return {
        row: {"held_out": error, "says": "backlash", "seconds": 9.0, "commit": "0123456789"}
        for row, error in left.items()
    }


def test_a_split_that_a_rival_won_is_told_and_all_are_counted() -> None:
    """What no model can beat, and a split without a diagnosis, count for nothing."""
    won = cells(**{"data sheet": 90.0, "Coulomb friction": 40.0, REPEATS: 4.0, OURS: 30.0})
    lost = cells(**{"data sheet": 20.0, OURS: 30.0})
    text = ratios({"sts3215: arm": won, "sts3215: heavy": lost, "xl330: kp 100": cells(told=1.0)})
    *_, last, _, said = text.splitlines()
    assert last == "| sts3215: heavy | 30.0 | data sheet | 20.0 | 1.50 | backlash | `0123456` |"
    assert "sts3215: arm" not in text
    assert said == "2 splits; ratio: median 1.12, greatest 1.50; 1 at 1.05 or less."


def test_splits_with_the_same_training_logs_are_one_fit() -> None:
    """What the data sheet leaves of training logs tells which they are, but for rows that wait."""
    one, two = ({"data sheet": {"held_out": 9.0, "trained": left}} for left in (4.0, 5.0))
    results = {"a: x": one, "a: y": one, "a: z": two, "a: waits": {}}
    assert distinct_fits(results, ["a: x", "a: y", "a: z"]) == 2
    assert distinct_fits(results, ["a: z", "a: waits"]) == 2
    assert "The 2 splits are 1 different fits" in errors(results, ["a: x", "a: y"])


def test_an_arm_is_told_by_shares_of_the_squared_error() -> None:
    """Pooled, the pair that was told worse counts more; alike, each pair counts once."""
    one = cells(**{TOLD: 10.0, "plain": 5.0, OURS: 1.0})
    two = cells(**{TOLD: 2.0, "plain": 2.0, OURS: 1.0})
    text = shares_of_arm({"so101: Jaw by a and b": one, "so101: Jaw by a and c": two})
    assert f"| {OURS} | 0.019 | 0.130 |" in text
    assert "| plain | 0.279 | 0.625 |" in text


def test_lag_delay_deadband_and_offset_are_found() -> None:
    """A servo that is nothing else is told by its four numbers."""
    time = 0.005 * np.arange(600)
    command = np.stack([np.sign(np.sin(2.0 * time)), np.sin(3.0 * time)], axis=1)
    still = np.zeros_like(command)
    grid = Grid(command=command, position=still, enabled=still + 1.0, valid=still + 1.0)
    known = np.array([0.06, 0.02, 0.02, 0.05])
    found = fitted(replace(grid, position=simulate(grid, known)))
    assert np.abs(found) == pytest.approx(known, rel=0.05)  # a search downhill


def test_a_motor_that_is_off_stays() -> None:
    """The baseline knows no weight."""
    command = np.ones((50, 1))
    off = Grid(command=command, position=0.0 * command, enabled=0.0 * command, valid=command)
    assert np.all(simulate(off, np.array([0.05, 0.0, 0.0, 0.0])) == 0.0)


def test_a_rival_that_fits_worse_than_a_model_that_it_contains_is_no_result(monkeypatch) -> None:
    """Each model begins where those that it contains ended, and may not end above them."""
    started: list[dict[str, Any]] = []

    def run(python: Path, *words: Any) -> None:
        after = dict(pairwise(words))
        if "--model" in words:
            started.extend(
                json.loads(Path(w).read_text()) for w in words[words.index("--known") + 1 :]
            )
            found = {"found": {"kt": 1.0}, "trials": 64, "searches": 6}
            Path(after["--out"]).write_text(json.dumps(found | {"converged": False}))
        elif "--json" in words:
            left = 0.03 if "train" in str(after["--logdir"]) else 0.04
            Path(after["--json"]).write_text(json.dumps({"m4": {"mean": left}}))

    monkeypatch.setattr(bam, "run", run)
    empty = Split(servo="xl330", name="", train=(), test=(), start=ideal_model(), floor=None)
    rows = [{"trained": 31.0, "found": {"kt": 2.0}}, {"trained": 32.0, "found": {"kt": 3.0}}]
    row = bam.fit(empty, "m4", Path("python"), 1.0, rows)
    assert started == [{"kt": 2.0}, {"kt": 3.0}]
    assert (row["trained"], row["held_out"]) == (pytest.approx(30.0), pytest.approx(40.0))
    assert row["says"] == "64 trials in 6 searches, not converged"
    with pytest.raises(AssertionError, match="m4 contains a model that fits better"):
        bam.fit(empty, "m4", Path("python"), 1.0, [{"trained": 29.0, "found": {}}])


def test_a_fit_to_the_same_logs_is_looked_for_once(monkeypatch, tmp_path: Path) -> None:
    """If that search ended: one that was stopped, or of other code, is no more than a start."""
    one = Split(servo="xl330", name="one", train=(), test=(), start=ideal_model(), floor=None)
    two = replace(one, name="two")
    assert alike(one, [one, two, replace(two, servo="sts3215")]) == (two.key,)
    asked: list[tuple[float, int]] = []

    def fit(split: Split, model: str, python: Path, seconds: float, starts: Any) -> dict[str, Any]:
        asked.append((seconds, len(starts)))
        return {"held_out": 1.0, "seconds": 0.1, "says": "0 trials, not converged"}

    monkeypatch.setattr(bam, "fit", fit)
    chosen = Namespace(results=tmp_path / "all.json", seconds=60.0, alike={one.key: (two.key,)})
    row = {"held_out": 9.0, "seconds": 33.0, "says": "64 trials"}
    for more in ({}, {"says": "64 trials, not converged"}):
        keep(chosen.results, two, "bam m1", row | more)
        found = of_bam(one, "m1", Path("python"), chosen)
    assert asked == [(0.0, 1), (60.0, 1)]
    assert found["says"] == "0 trials, not converged"
    keep(chosen.results, two, "bam m1", row)
    assert of_bam(one, "m1", Path("python"), chosen) == {**row, "held_out": 1.0}


def test_another_setting_stands_beside_the_answer_on_the_same_fits() -> None:
    """With how many answers name other causes; a fit that waits is not counted."""
    answer = {"held_out": 30.0, "named": {"coulomb_friction": 1.0}}
    other = {"held_out": 40.0, "named": {"viscous_friction": 1.0}}
    results = {"xl330: a": {OURS: answer}, "xl330: b": {OURS: answer}, "xl330: c": {OURS: answer}}
    made = {"xl330: a": {at_price(0.2): other}, "xl330: b": {at_price(0.05): answer}}
    *_, cheap, usual, dear = settings_table(made, results).splitlines()
    assert cheap == "| a price of 0.05 nat | 30.0 (30.0 to 30.0), 1 fits | 0 of 1 |"
    assert usual == "| a price of 0.1 nat | 30.0 (30.0 to 30.0), 2 fits | 0 of 2 |"
    assert dear == "| a price of 0.2 nat | 40.0 (40.0 to 40.0), 1 fits | 1 of 1 |"


@pytest.mark.parametrize("name", TABLES)
def test_a_page_shows_what_was_measured(name: str) -> None:
    """``python -m lab.results --write`` would change nothing."""
    text = (ROOT / TABLES[name][0]).read_text(encoding="utf-8")
    assert with_table(text, name, shown(name, records())) == text


def test_a_table_tells_of_which_code_its_figures_are() -> None:
    """All do: the README's in each row."""
    kept = records()
    assert shown("exam", kept).endswith(f"Measured at {origin(kept['exam'])}, {kept['exam'].date}.")
    assert "`" in shown("names", kept).splitlines()[-1].split("; ")[1]


def test_a_number_that_was_edited_by_hand_is_noticed() -> None:
    """A table with another number is not that of its record."""
    text = (ROOT / TABLES["readme"][0]).read_text(encoding="utf-8")
    edited = text.replace(" times**", "1 times**")
    assert edited != text
    assert with_table(edited, "readme", shown("readme", records())) == text


def test_a_docstring_changes_no_result_and_a_number_does(tmp_path: Path) -> None:
    """A fingerprint is of the code alone, and of the numbers that it reads."""
    file = tmp_path / "law.py"
    file.write_text('"""Old words."""\nMU = 0.1  # source\n')
    before = fingerprint(tmp_path, "law.py")
    file.write_text('"""New words."""\n\nMU = 0.1\n')
    assert fingerprint(tmp_path, "law.py") == before
    file.write_text('"""New words."""\n\nMU = 0.2\n')
    assert fingerprint(tmp_path, "law.py") != before


def cell(record: Record, row: str, **more: Any) -> dict[str, Any]:
    """A cell of a record's own code."""
    code = combined({name: record.code[name] for name in rests_on(row)})
    return {"held_out": 1.0, "commit": record.commit, "clean": True, "code": code} | more


def test_a_cell_of_other_code_that_is_not_told_fails_the_check() -> None:
    """By its fingerprint, whatever commit it names; and so does one of a tree with changes."""
    kept = records()["comparison"]
    sound = {"servo: split": {row: cell(kept, row) for row in (OURS, "bam m1", REPEATS)}}
    told = replace(kept, data=None, older={}, clean=None)
    assert not list(doubts(replace(told, rows=sound)))
    for row, more in ((OURS, {"code": "0" * 16}), ("bam m1", {"code": None})):
        stale = {"servo: split": sound["servo: split"] | {row: cell(kept, row, **more)}}
        (said,) = doubts(replace(told, rows=stale))
        assert "cells of other code" in said
        counted = {kept.commit[:8]: 1}
        assert not list(doubts(replace(told, rows=stale, older=counted)))
    changed = {"servo: split": {OURS: cell(kept, OURS, clean=False)}}
    assert any("git saw changed" in said for said in doubts(replace(told, rows=changed)))


@pytest.mark.parametrize(
    ("stated", "clean", "fault"),
    [
        ("abc123", True, None),
        ("abc123-dirty", True, "clean is True"),
        ("abc123-dirty", False, None),
        ("def456", True, "its commit"),
        (None, True, "no commit"),
        (None, None, None),
    ],
)
def test_whether_a_tree_was_clean_is_what_its_file_says(stated, clean, fault, tmp_path) -> None:
    """Git's word at the time of measuring; what nobody asked is not known."""
    file = tmp_path / "figures.json"
    file.write_text(json.dumps({"x": 1.0} | ({} if stated is None else {"commit": stated})))
    record = replace(records()["units"], commit="abc123", clean=clean, data=str(file))
    said = list(doubts(record))
    assert (said == []) if fault is None else (fault in said[0])


@pytest.mark.parametrize("name", records())
def test_a_record_says_truly_where_it_comes_from(name: str) -> None:
    """``python -m lab.results --check`` doubts none."""
    assert list(doubts(records()[name])) == []


def test_a_row_says_what_it_was_made_of(tmp_path: Path) -> None:
    """Commit, whether git saw a change, and the code; anew, a row of another commit waits."""
    split = Split(servo="xl330", name="", train=(), test=(), start=ideal_model(), floor=None)
    keep(tmp_path / "kept.json", split, "bam m1", {"held_out": 1.0})
    made = json.loads((tmp_path / "kept.json").read_text())
    row = made[split.key]["bam m1"]
    assert row.keys() == {"held_out", "commit", "clean", "code"}
    row["commit"] = "0" * 40
    assert waits(made, split, "bam m1", anew=True)
    assert not waits(made, split, "bam m1", anew=False)
    assert waits(made, split, "bam m2", anew=False)


@pytest.mark.parametrize("record", records().values(), ids=records())
def test_a_record_is_complete(record) -> None:
    """What measures it again, on what it was measured, and the code that it rests on."""
    assert record.command
    assert record.minutes > 0
    assert record.code
    assert all(record.code.values()), "python -m lab.results --stamp NAME"
    assert record.figures
