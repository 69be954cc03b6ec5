"""Held out stays held out: nothing but a report depends on a test recording, in the lab's verbs."""

from pathlib import Path

import pytest

from lab.tests.held_out import CASES
from tendon_newton.cli import VERBS, every_verb
from tests.held_out import differences

pytestmark = pytest.mark.usefixtures("own_trust")
SLOW = {"reproduce": pytest.mark.slow, "exam": pytest.mark.slow}
"""An exam is diagnoses; `make nightly` runs all."""


def test_every_verb_is_looked_at() -> None:
    """A verb either has a case or is known to read no dataset."""
    assert {*CASES} == {*every_verb()} - {*VERBS} | {"import"}


@pytest.mark.parametrize("verb", [pytest.param(v, marks=SLOW.get(v, ())) for v in CASES])
def test_nothing_but_the_report_depends_on_a_test_recording(verb: str, tmp_path: Path) -> None:
    """Test recordings turned to noise: the same models and names, to the bit; another report."""
    assert differences(CASES[verb], tmp_path) == []
