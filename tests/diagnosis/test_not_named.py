"""What must not be named: recordings that contradict each other, and numbers beyond any range."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import write_model
from tests.planted.answers import answer_of
from tests.planted.generator import starting_model
from tests.planted.physics.bench import BENCHES
from tests.planted.physics.causes import Causes
from tests.planted.physics.plant import simulate
from tests.planted.physics.sensors import Sensors
from tests.planted.recordings import Slot, draw_run, record

KINDS = ("steps", "sine", "ramp", "steps")
"""Commands of three training recordings and of the test recording."""


def diagnosed(
    folder: Path, causes: Sequence[Causes], seconds: float = 4.5, held_out: Causes | None = None
) -> dict[str, Any]:
    """Diagnose a weak spring whose three recordings each have a cause; the test has the last."""
    rng, own = np.random.default_rng(1), (*causes, held_out or causes[-1])
    slots = [
        Slot(file=f"{kind}_{number}.csv", bench="spring_weak", kind=kind)
        for number, kind in enumerate(KINDS)
    ]
    runs = [
        draw_run(rng, slot, each, BENCHES, (0.9 * seconds, 1.1 * seconds))
        for slot, each in zip(slots, own, strict=True)
    ]
    recordings = [
        record(rng, slot, run, motion, Sensors(), gaps=False)
        for slot, run, motion in zip(slots, runs, simulate(runs), strict=True)
    ]
    write_dataset(folder / "dataset", recordings[:-1], recordings[-1:])
    write_model(folder / "dataset" / "model.toml", starting_model(known_friction=False))
    return answer_of(folder / "dataset", folder / "answer")


def named(answer: dict[str, Any]) -> dict[str, dict[str, tuple[float, float]]]:
    """Return the intervals of the numbers of what is named."""
    return {
        effect["name"]: {name: tuple(e["ci95"]) for name, e in effect["parameters"].items()}
        for effect in answer["effects"]
    }


@pytest.mark.slow
def test_what_one_recording_has_and_others_contradict_is_no_cause(tmp_path: Path) -> None:
    """A cell is 0.6 N off in one of three recordings, beside a gain of 1.25 in all.

    A bias of 0.2 N lessens the error of all three together, and tells nothing of a further one.
    """
    gained = Causes(gain_scale=1.25)
    found = named(diagnosed(tmp_path, (replace(gained, cell_bias=0.6), gained, gained)))
    assert list(found) == ["gain_error"]
    low, high = found["gain_error"]["scale"]
    assert low <= 1.25 <= high


@pytest.mark.slow
def test_a_number_that_changes_between_recordings_has_an_interval_that_says_so(tmp_path) -> None:
    """Viscous friction of 1.0, 1.5 and 2.0 N s/rad: each is as true as their mean."""
    causes = [Causes(viscous=coefficient) for coefficient in (1.0, 1.5, 2.0)]
    low, high = named(diagnosed(tmp_path, causes, seconds=8.0))["viscous_friction"]["coefficient"]
    assert low <= 1.0
    assert high >= 2.0


def test_a_cause_beyond_its_range_is_not_named_at_the_edge(tmp_path: Path) -> None:
    """A cell that reads 15 N too much, where 10 N is the most that makes sense.

    At the edge a bias of 10 N with a drift would explain 96 % of it.
    """
    answer = diagnosed(tmp_path, [Causes(cell_bias=15.0)] * 3)
    assert answer["identifiability"]["at_bound"] == []
    assert "load_cell_bias" not in named(answer)


def test_what_does_not_lessen_the_error_of_what_was_held_out_is_no_cause(tmp_path: Path) -> None:
    """A gain of 1.25 in all that was learned from, and none in what was held out."""
    answer = diagnosed(tmp_path, [Causes(gain_scale=1.25)] * 3, held_out=Causes())
    assert (answer["verdict"], answer["effects"], answer["suspected"]) == ("unexplained", [], [])
    assert answer["explained_fraction"] <= 0.0
    assert any("on held-out recordings no smaller" in note for note in answer["notes"])


def test_a_tenth_of_a_second_names_nothing(tmp_path: Path) -> None:
    """Thirteen rows a recording: a next step says how much is too little."""
    answer = diagnosed(tmp_path, [Causes(viscous=1.0)] * 3, seconds=0.15)
    assert (answer["verdict"], answer["effects"]) == ("unexplained", [])
    assert any("too little for a name: they last 0." in step for step in answer["next_steps"])
