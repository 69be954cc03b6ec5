"""Every effect has a row for every target, and the documentation shows the table as it is."""

from dataclasses import replace
from pathlib import Path

import pytest

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidParameter, TendonNewtonError, UnknownName
from tendon_newton.exports import EXPORTS, find_export
from tendon_newton.exports.comparison import COMPARED, compare, comparison_table, plot_comparison
from tendon_newton.exports.mujoco.mujoco_target import IN_THE_FILE
from tendon_newton.exports.newton.plain import IN_THE_PRIMS
from tendon_newton.simulation.hosts.replay import bench_of
from tests.exports.models import ANGLE, FORCE, model_of, short_run

PAGE = Path(__file__).parents[2] / "docs" / "export.md"
WORDS = {"exact": "exact", "approximate": "nearly", "none": "-"}
COLUMNS = {
    "model.xml alone": IN_THE_FILE,
    "Newton's prims alone": IN_THE_PRIMS,
    **{name: target.coverage for name, target in EXPORTS.items()},
}
"""Ways of running an export, and what each says of every effect."""


def coverage_table() -> str:
    """Return what every target says of every effect, in Markdown; equal rows are one."""
    same: dict[str, list[str]] = {}
    for effect in EFFECTS:
        cells = " | ".join(WORDS[column[effect]] for column in COLUMNS.values())
        same.setdefault(cells, []).append(effect)
    lines = [f"| effect | {' | '.join(COLUMNS)} |", "|---|" + "---|" * len(COLUMNS)]
    return "\n".join([*lines, *(f"| {', '.join(names)} | {row} |" for row, names in same.items())])


@pytest.mark.parametrize("target", EXPORTS)
def test_every_effect_has_a_row_for_every_target(target: str) -> None:
    """A new effect is exact, nearly there, or not expressible; nobody may leave that open."""
    coverage = EXPORTS[target].coverage
    assert set(coverage) == set(EFFECTS)
    assert set(coverage.values()) <= set(WORDS)


def test_the_documentation_shows_the_table_as_it_is() -> None:
    """docs/export.md holds the text that the targets' own lists make."""
    assert coverage_table() in PAGE.read_text(encoding="utf-8")


def test_an_unknown_target_is_named_with_the_known_ones() -> None:
    """The message lists what there is."""
    with pytest.raises(UnknownName, match="mujoco"):
        find_export("gazebo")


BENCH = "spring_weak"
SERVO = model_of(BENCH, "pwm_servo")


def with_effect(name: str, servo: int | None = None, **values: float) -> Model:
    """Return the servo with one effect."""
    return replace(SERVO, effects=(NamedValues(name=name, values=values, servo=servo),))


def with_actuator(kind: str, **values: float) -> Model:
    """Return the servo as another kind, or with other numbers."""
    old = SERVO.actuator
    return replace(SERVO, actuator=replace(old, name=kind, values={**old.values, **values}))


DAMAGED = {
    "an unknown effect": with_effect("stiction", force=1.0),
    "an effect without its number": with_effect("coulomb_friction"),
    "a friction that drives": with_effect("coulomb_friction", force=-1.0),
    "an effect of one servo": with_effect("gain_error", servo=1, scale=1.2),
    "an unknown actuator": with_actuator("warp_drive"),
    "a motor without resistance": with_actuator("pwm_servo", resistance=0.0),
}


@pytest.mark.parametrize("target", EXPORTS)
@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_model_is_refused_and_nothing_is_written(target, damage, tmp_path) -> None:
    """One line says what was expected, and no program opens a file that is wrong."""
    with pytest.raises(TendonNewtonError) as refused:
        EXPORTS[target].write(tmp_path, bench_of(BENCH, SERVO), DAMAGED[damage])
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("target", ["mujoco", "newton", "isaaclab", "mjlab", "networks"])
def test_a_network_that_is_missing_leaves_nothing_behind(target: str, tmp_path: Path) -> None:
    """The message names the file."""
    values = {"file": str(tmp_path / "nothing.safetensors"), "spool_radius": 0.0125}
    model = Model(actuator=NamedValues(name="learned", values=values))
    with pytest.raises(TendonNewtonError, match=r"nothing\.safetensors"):
        EXPORTS[target].write(tmp_path, bench_of(BENCH, SERVO), model)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("target", ["mujoco", "newton", "isaaclab", "mjlab", "usd", "urdf"])
def test_an_optional_number_may_be_left_out(target: str, tmp_path: Path) -> None:
    """A limit without a knee goes everywhere."""
    model = with_effect("force_saturation", limit=3.0)
    assert EXPORTS[target].write(tmp_path, bench_of(BENCH, model), model).files


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
    assert {"mujoco", "newton"} <= set(COMPARED) & set(EXPORTS)


def test_an_unknown_simulator_is_named_with_the_known_ones() -> None:
    """The message lists what there is."""
    model = model_of("finger", "ideal")
    with pytest.raises(UnknownName, match="mjcf"):
        compare(("gazebo",), bench_of("finger", model), model, [])
