"""Splits that no logs have, and logs that are none: one line each, and nothing is written."""

import pytest

from tests.bad_input.damage import refusal
from tests.importers.logs import xl330_log


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--test", "kp=400"], "--test kp=400 meets no log; there are 200.0"),
        (["--test", "gain=200"], "No --test condition named 'gain'; known: file, kp, length"),
        (["--test", "kp"], "--test must be given as key=value"),
        (["--test", "kp=200"], "some log must be left to fit"),
        (["--test", "trajectory=a", "--train", "kp=200"], "--test and --train both select kp200_a"),
    ],
)
def test_a_split_that_cannot_be_is_refused(options, said, tmp_path, capsys) -> None:
    """Conditions must exist, select something and leave something."""
    for name in ("kp200_a.json", "kp200_b.json"):
        xl330_log(tmp_path / "logs" / name)
    arguments = ["import", "xl330", str(tmp_path / "logs"), "--out", str(tmp_path / "out")]
    assert said in refusal([*arguments, *options], capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "must be JSON"),
        ("[]", "must be a JSON object; it is a list"),
        ('{"mass": 0.49}', "must state 'length'; it states mass"),
        (
            '{"mass": 1, "length": 1, "kp": 0, "vin": 7, "entries": [0]}',
            "timestamp must be a number",
        ),
        ('{"mass": 1, "length": 1, "kp": 1, "vin": 7, "entries": []}', "one object per row"),
        ('{"mass": 1, "length": 1, "kp": 1, "vin": 7, "entries": [], "motor": "mx106"}', "'mx106'"),
    ],
)
def test_a_broken_log_is_refused_with_its_name(content, said, tmp_path, capsys) -> None:
    """A log that lacks something is named, and nothing is written."""
    (tmp_path / "log.json").write_text(content)
    line = refusal(["import", "xl330", str(tmp_path), "--out", str(tmp_path / "out")], capsys)
    assert said in line
    assert "log.json" in line
    assert not (tmp_path / "out").exists()
