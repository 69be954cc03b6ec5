"""Whatever door recorded data come in by: a mistake gets its line with the mend, and no advice."""

import re
from pathlib import Path

import pytest

from tendon_newton.data.dataset import load_dataset
from tendon_newton.diagnosis.accounts.checked_data import faults_of, findings_of
from tests.doors.logs import Door, own_dataset, sound
from tests.doors.mistakes import ANGLES, COMMANDS, DOORS, OWN, Mistake
from tests.doors.told import EVERY, lines_said, spoiled_runs

ADVICE = re.compile("overload|horn|worn gear|knock|calibrate leader|too slow")
CASES = [
    pytest.param(door, mistake, id=f"{mistake.name}, {name}")
    for mistake in EVERY
    for name, door in mistake.doors.items()
]


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


def test_there_are_sixty_mistakes() -> None:
    """Each by its own name."""
    assert len({mistake.name for mistake in EVERY}) == len(EVERY) >= 60
