"""Whatever door recorded data come in by: a mistake gets its line with the mend, and no advice."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.checks.command_checks import no_command
from tendon_newton.data.checks.lint import CHECKS
from tendon_newton.data.checks.read_checks import FAR, failed_rows, repeated_rows
from tendon_newton.data.dataset import load_dataset
from tendon_newton.diagnosis.accounts.checked_data import faults_of, findings_of
from tests.doors.logs import COUNT, ROWS, Door, csv_logs, own_dataset, sound
from tests.doors.mistakes import ANGLES, COMMANDS, DOORS, LEROBOT, OWN, Mistake
from tests.doors.told import EVERY, lines_said, spoiled_runs
from tests.made import recorded

ROOT = Path(__file__).parents[2]
ADVICE = re.compile("overload|horn|worn gear|knock|calibrate leader|too slow")
CASES = [
    pytest.param(
        door, mistake, id=f"{mistake.name}, {name}",
        # that door examines each joint for a second: what others tell too is asked of it at night
        marks=pytest.mark.slow
        if name == LEROBOT and OWN in mistake.doors and not mistake.thread else (),
    )
    for mistake in EVERY
    for name, door in mistake.doors.items()
]  # fmt: skip


@pytest.mark.parametrize("name", DOORS)
def test_sound_logs_pass_in_silence(name: str, tmp_path: Path) -> None:
    """Two joints that follow their commands late: no door finds anything to mend."""
    lines = lines_said(tmp_path, DOORS[name], [sound(0), sound(1)])
    assert not [line for line in lines if re.match("defect|caution|fix|.*->", line)]


@pytest.mark.parametrize(("door", "mistake"), CASES)
def test_a_mistake_gets_a_line_with_its_mend(door: Door, mistake: Mistake, tmp_path: Path) -> None:
    """What was done to the log is told, and no advice follows from how it then seems to move."""
    lines = lines_said(tmp_path, door, spoiled_runs(mistake))
    assert [line for line in lines if mistake.said in line], "\n".join(lines)
    assert not [line for line in lines if ADVICE.search(line)]


@pytest.mark.parametrize("mistake", [*ANGLES, *COMMANDS], ids=lambda mistake: mistake.name)
def test_a_diagnosis_says_so_too(mistake: Mistake, tmp_path: Path) -> None:
    """What is a defect at another door is one here, and then there is no other advice."""
    if OWN not in mistake.doors:
        return
    own_dataset(tmp_path, spoiled_runs(mistake))
    recordings = load_dataset(tmp_path / "own").train
    told = [f for f in findings_of(recordings) if mistake.said in f.evidence + f.consequence]
    assert told
    if told[0].severity == "defect":
        assert any(mistake.said in fault for fault in faults_of(recordings))


READ = ("zeros where the bus read nothing", "a neighbour's angle", "one row far off",
        "zeros in every fifth row", "the last reading again", "thirty rows of zeros")  # fmt: skip
MENDED = (*READ, "the encoder's seam inside the range", "rows out of order", "the last row first",
          "rows that overtook others", "a clock that begins again")  # fmt: skip


@pytest.mark.parametrize("name", MENDED)
def test_what_mend_leaves_is_the_sound_log(name: str, tmp_path: Path) -> None:
    """Rows that stay have angle and command of the log before its mistake."""
    (mistake,) = (mistake for mistake in EVERY if mistake.name == name)
    words = csv_logs()(tmp_path, spoiled_runs(mistake))
    assert main([*words, "--mend", "--test", "file=run_1"]) == 0
    before = sound(0)
    start = before["t"][ROWS // 2] if "clock" in name else 0.0
    mended = load_dataset(tmp_path / "out" / "pan").train
    rows = np.concatenate([
        np.searchsorted(before["t"], run.time + start * ("clock1" in run.name) - 1e-9)
        for run in mended
    ])  # fmt: skip
    angle = np.concatenate([run.motor_position[:, 0] for run in mended])
    goal = np.concatenate([run.command[:, 0] for run in mended])
    np.testing.assert_allclose(goal, before["goal_0"][rows], atol=1e-8)
    off = np.abs(angle - before["q_0"][rows])
    pace = np.abs(before["q_0"][2:] - before["q_0"][:-2]).max()
    assert off.max() < (FAR * pace if name in READ else 1e-8)
    wrong = np.abs(spoiled_runs(mistake)[0]["q_0"] - before["q_0"]) > 1e-8
    assert (off > 1e-8).sum() <= 0.3 * wrong.sum()
    assert len(rows) > ROWS - 1.1 * wrong.sum() - 20


def test_what_a_mend_changes_misleads_no_other_check(tmp_path: Path) -> None:
    """A seam that seems to turn a joint around is told as a seam alone."""
    (mistake,) = (mistake for mistake in EVERY if mistake.name == "a seam in the middle")
    own_dataset(tmp_path, spoiled_runs(mistake))
    told = faults_of(load_dataset(tmp_path / "own").train)
    assert told
    assert all("add the turns" in one for one in told)


def test_repeated_reads_are_found_where_many_fail() -> None:
    """Of rows that are off by more than jitter, five in six, where one read in four fails."""
    found = wrong = 0
    for seed in range(4):
        theta = sound(seed)["q_0"]
        read = theta.copy()
        for row in np.flatnonzero(np.random.default_rng(seed + 50).random(ROWS) < 0.25)[1:]:
            read[row] = read[row - 1]
        again, off = repeated_rows(read), np.abs(read - theta)
        assert not again[off == 0.0].any()
        far = off > 4.0 * COUNT
        found, wrong = found + int((again & far).sum()), wrong + int(far.sum())
    assert found > 5 / 6 * wrong


def test_the_page_names_every_check() -> None:
    """The table of docs/recordings_mapping.md has the checks of the code."""
    page = (ROOT / "docs" / "recordings_mapping.md").read_text()
    table = page[page.index("## What an import checks") : page.index("## All keys")]
    assert [check.name for check in CHECKS if check.name not in table] == []


def test_there_are_sixty_mistakes() -> None:
    """Each by its own name."""
    assert len({mistake.name for mistake in EVERY}) == len(EVERY) >= 60


def test_a_number_at_which_a_joint_rests_is_a_reading() -> None:
    """Two joints rest at one angle for a while; a failed read stays for a row or two."""
    time = np.arange(800) / 80.0
    angle = np.round((np.sin(2.0 * time) + 1.5) / 0.0015) * 0.0015
    for row in range(100, 700, 60):
        angle[row : row + 6] = 0.0
    assert not failed_rows(np.stack([angle, np.zeros_like(angle)], axis=1), 0).any()


@pytest.mark.parametrize(("hold", "rate", "most"), [(128, 0.4, np.inf), (40, 1.8, 0.5)])
def test_a_motor_that_is_too_slow_for_its_goals_has_them(hold, rate, most) -> None:
    """It goes half of the way, or reaches no goal: its speed is like them, and its angle is not."""
    time = np.arange(640) / 80.0
    goal = np.repeat(np.random.default_rng(11).uniform(-2.2, 2.2, 640 // hold), hold)
    angle = np.zeros_like(goal)
    for row in range(1, len(goal)):
        far = float(np.clip(goal[row - 1] - angle[row - 1], -most, most))
        angle[row] = angle[row - 1] + rate / 80.0 * far
    log = recorded(time, angle, bench="spring_weak", command=goal)
    assert list(no_command(log)) == []
    for size, pace in ((1.0, 1.0), (0.5, 6.0)):  # the second's speeds are far above its angles
        angle = size * np.sin(pace * time)
        asked = replace(
            log, command=np.gradient(angle, time)[:, None], motor_position=angle[:, None]
        )
        (found,) = no_command(asked)
        assert "speed of theta" in found.evidence


def test_a_weak_motor_amid_a_sine_is_not_driven_by_its_speed() -> None:
    """Its speed goes with the goal, but is zero at the middle of the goals and not at zero."""
    time = np.arange(2400) / 80.0
    goal = 1.8 + 1.55 * np.sin(4.0 * np.pi * time)
    angle = (
        1.2 - 0.027 * np.cos(4.0 * np.pi * time) - 0.05 * np.exp(-time / 3.0)
    )  # at first from its rest
    log = recorded(time, angle, bench="finger", command=goal)
    assert list(no_command(log)) == []
    speeds = replace(log, motor_position=np.cumsum(0.219 * goal[:, None], axis=0) / 80.0)
    (found,) = no_command(speeds)
    assert "it is a speed command" in " ".join(str(part) for part in vars(found).values())


def test_a_known_wrong_number_is_found_near_a_jump_too() -> None:
    """Some rows after a step of 1 rad a zero lies 0.2 rad beside the motion, far less than it."""
    time = np.arange(800) / 80.0
    angle = 1.2 + 0.5 * np.sin(np.pi * time)
    angle[400:430] = 0.2
    angle = np.round(angle / 0.0015) * 0.0015
    wrong = [60, 150, 250, 600, 700, 406]
    angle[wrong] = 0.0
    assert np.flatnonzero(failed_rows(angle[:, None], 0)).tolist() == sorted(wrong)


def test_a_number_in_most_rows_is_not_taken_for_a_failed_read() -> None:
    """What is left shows no motion to judge it by."""
    time = np.arange(600) / 80.0
    angle = np.round((np.sin(2.0 * time) + 1.5) / 0.0015) * 0.0015
    angle[np.arange(600) % 3 > 0] = 0.0
    assert not (failed_rows(np.stack([angle, time], axis=1), 0) & (angle == 0.0)).any()
