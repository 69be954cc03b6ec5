"""Goals from keys, files and lines; what is none changes nothing."""

import os
import time
from math import pi
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.control.goals import (
    FixedGoal,
    LineGoals,
    open_goals,
    parse_goal,
    read_goals,
    stairs,
)
from tendon_hardware.control.keyboard import Keyboard, split_keys
from tendon_newton.errors import InvalidGoal

BOUNDS = (0.0, pi / 2.0)


def test_keys_move_the_goal_within_its_bounds() -> None:
    """Arrows move by three degrees, digits go to ninths of the range, nothing leaves it."""
    goal = FixedGoal(0.0, BOUNDS)
    goal.key("down")
    assert goal.value(0.0) == 0.0
    for _ in range(2):
        goal.key("up")
    assert goal.value(0.0) == pytest.approx(pi / 30.0)
    goal.key("9")
    goal.key("right")
    assert goal.value(0.0) == pytest.approx(pi / 2.0)
    goal.key("z")
    assert goal.value(0.0) == pytest.approx(pi / 2.0)


def test_the_stairs_are_those_of_the_paper() -> None:
    """From 0 to pi/2 and back by pi/10, 1.5 s on each."""
    steps = stairs()
    levels = [steps.value(1.5 * k + 0.7) / (pi / 10.0) for k in range(11)]
    np.testing.assert_allclose(levels, [0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0], atol=1e-9)
    assert steps.end == 15.0


def test_a_file_gives_goals_at_their_times(tmp_path: Path) -> None:
    """Lines of seconds and radians, with comments, commas or spaces."""
    path = tmp_path / "goals.txt"
    path.write_text("# t alpha\n0 0.1\n1.5, 0.9  # close\n\n3 0\n")
    goals = read_goals(path)
    assert [goals.value(t) for t in (0.0, 1.49, 1.5, 2.9, 99.0)] == [0.1, 0.1, 0.9, 0.9, 0.0]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "there is none"),
        ("0 0.1\n0 0.2\n", "line 2: times must increase"),
        ("-1 0.1\n", "times must increase from 0"),
        ("0 nan\n", "line 1"),
        ("0 0.1 0.2\n", "line 1"),
        ("now 0.1\n", "line 1"),
        ("\x00", "zero byte"),
    ],
)
def test_a_file_of_something_else_is_refused(tmp_path: Path, content: str, said: str) -> None:
    """The message names the line."""
    path = tmp_path / "goals.txt"
    path.write_text(content)
    with pytest.raises(InvalidGoal, match=said):
        read_goals(path)


def test_lines_give_goals_as_they_come() -> None:
    """The last whole line counts; half a line waits; nonsense is told once; the end is told."""
    read_end, write_end = os.pipe()
    goals = LineGoals(0.2, read_end)
    assert goals.value(0.0) == 0.2
    os.write(write_end, b"0.5\n0.7\n0.")
    assert goals.value(0.0) == 0.7
    os.write(write_end, b"9\nclose it\n\xff\n")
    assert goals.value(0.0) == 0.9
    assert len(goals.notes) == 1
    assert "close it" in goals.notes[0]
    os.close(write_end)
    assert goals.value(0.0) == 0.9
    assert goals.value(0.0) == 0.9
    assert goals.notes[1:] == ["No more goals come; the last one stays."]
    os.close(read_end)


def test_a_word_names_a_kind_of_goals(tmp_path: Path) -> None:
    """An angle, the stairs, the keyboard or a file; anything else is a file that is not there."""
    assert open_goals("0.8", BOUNDS).value(0.0) == 0.8
    assert open_goals("1.5708", BOUNDS).value(0.0) == pytest.approx(pi / 2.0)
    assert open_goals("keyboard", BOUNDS).value(0.0) == 0.0
    assert open_goals("stairs", BOUNDS).value(3.1) == pytest.approx(pi / 5.0)
    with pytest.raises(InvalidGoal, match="no such file"):
        open_goals(str(tmp_path / "keybord"), BOUNDS)


def test_goals_in_degrees_are_refused(tmp_path: Path) -> None:
    """The policy took its greatest goal for each, without a word."""
    with pytest.raises(InvalidGoal, match=r"0 to 1\.571 rad, .* it is 60 "):
        open_goals("60", BOUNDS)
    path = tmp_path / "goals.txt"
    path.write_text("0 0.5\n1 45\n")
    with pytest.raises(InvalidGoal, match=r"line 2: goals of this policy are 0 to 1\.571 rad"):
        open_goals(str(path), BOUNDS)


def test_goals_that_are_set_have_an_end(tmp_path: Path) -> None:
    """Eleven stairs of 1.5 s last 16.5 s; a file's last goal is held as long; keys never end."""
    assert open_goals("stairs", BOUNDS).length == pytest.approx(16.5)
    path = tmp_path / "goals.txt"
    path.write_text("0 0.1\n4 0.3\n")
    assert open_goals(str(path), BOUNDS).length == pytest.approx(5.5)
    assert open_goals("keyboard", BOUNDS).length is None
    assert open_goals("0.8", BOUNDS).length is None


@pytest.mark.parametrize("line", ["", "nan", "inf", "1e999", "0.1 0.2", "0x10", "1" * 300, "0,5"])
def test_what_is_no_number_is_no_goal(line: str) -> None:
    """One finite number in decimal, nothing else."""
    with pytest.raises(InvalidGoal):
        parse_goal(line)


def test_keys_of_a_terminal_are_told_apart() -> None:
    """Arrow keys in both modes, letters, and no half of a foreign sequence that means stop."""
    assert split_keys(b"\x1b[A\x1bOBq 5") == ["up", "down", "q", " ", "5"]
    assert split_keys(b"\xff\x00\x1b") == []


def test_a_keyboard_gives_the_terminal_back() -> None:
    """Keys come without Enter inside the context; afterwards the terminal is as it was."""
    import termios

    master, slave = os.openpty()
    before = termios.tcgetattr(slave)
    with Keyboard(slave) as keyboard:
        assert keyboard.there
        assert keyboard.pressed() == []
        os.write(master, b"\x1b[A")
        deadline = time.monotonic() + 5.0
        while not (keys := keyboard.pressed()) and time.monotonic() < deadline:
            time.sleep(0.001)
        assert keys == ["up"]
    assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)


def test_without_a_terminal_no_key_comes() -> None:
    """Under a service manager there is none, and nothing is waited for."""
    read_end, write_end = os.pipe()
    os.write(write_end, b"x")
    with Keyboard(read_end) as keyboard:
        assert not keyboard.there
        assert keyboard.pressed() == []
    os.close(read_end)
    os.close(write_end)
