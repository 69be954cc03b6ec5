"""Held out stays held out: nothing but a report depends on a test recording, in any verb."""

from pathlib import Path

import pytest

from tendon_newton.cli import VERBS
from tests.held_out import CASES, NO_DATASET, differences

pytestmark = pytest.mark.usefixtures("own_trust")


def test_every_verb_is_looked_at() -> None:
    """A verb either has a case or is known to read no dataset."""
    looked_at = {case.split()[0] for case in CASES}
    own = [verb for verb, module in VERBS.items() if module.startswith("tendon_newton.")]
    assert sorted([*looked_at, *NO_DATASET]) == sorted(own)


@pytest.mark.parametrize("verb", CASES)
def test_nothing_but_the_report_depends_on_a_test_recording(verb: str, tmp_path: Path) -> None:
    """Test recordings turned to noise: the same models and names, to the bit; another report."""
    folder = tmp_path / verb
    folder.mkdir()
    assert differences(CASES[verb], folder) == []
