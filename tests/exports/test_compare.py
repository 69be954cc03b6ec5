"""One command through several simulators."""

from pathlib import Path

import pytest

from examples.studies.exports import model_of
from tendon_newton.errors import InvalidParameter, UnknownName
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.comparison import COMPARED, compare, comparison_table, plot_comparison
from tendon_newton.simulation.hosts.replay import bench_of
from tests.exports.models import ANGLE, FORCE, short_run


def test_simulators_stand_in_one_table_and_one_picture(tmp_path: Path) -> None:
    """The exported program is ours to an encoder count; the file alone is farther away."""
    model = model_of("spring_weak", "ideal")
    mechanism, run = bench_of("spring_weak", model), short_run("spring_weak", model)
    found = compare(("mujoco", "mjcf"), mechanism, model, [run])
    assert found.departures["mujoco"].angle < ANGLE
    assert found.departures["mujoco"].force < FORCE
    assert found.departures["mujoco"].angle < found.departures["mjcf"].angle
    assert [line.split(" | ")[0] for line in comparison_table(found).splitlines()[2:]] == [
        "| mujoco",
        "| mjcf",
    ]
    plot_comparison(tmp_path / "compare.png", found)
    assert (tmp_path / "compare.png").stat().st_size > 10_000


def test_a_simulator_that_cannot_hold_the_model_says_so() -> None:
    """The file alone has no force network."""
    model = model_of("finger", "learned")
    with pytest.raises(InvalidParameter, match="cannot run here"):
        COMPARED["mjcf"](bench_of("finger", model), model, [short_run("finger", model)])


def test_a_simulator_that_has_no_program_for_the_bench_lists_what_has() -> None:
    """Newton's own prims drive one joint each, so that a finger's string is the drive's alone."""
    model = model_of("finger", "ideal")
    with pytest.raises(InvalidParameter, match=r"cannot run here: there is tendon_drive\.py"):
        COMPARED["prims"](bench_of("finger", model), model, [short_run("finger", model)])


def test_every_target_that_moves_by_itself_can_be_compared() -> None:
    """A target is left out where another program must bring the simulation."""
    assert {"mujoco", "newton", "bam"} <= set(COMPARED) & set(EXPORTS)


def test_an_unknown_simulator_is_named_with_the_known_ones() -> None:
    """The message lists what there is."""
    model = model_of("finger", "ideal")
    with pytest.raises(UnknownName, match="mjcf"):
        compare(("gazebo",), bench_of("finger", model), model, [])
