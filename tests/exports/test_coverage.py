"""Every effect has a row for every target, and the documentation shows the table as it is."""

from dataclasses import replace
from pathlib import Path

import pytest

from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import TendonNewtonError
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.mujoco.mujoco_target import IN_THE_FILE
from tendon_newton.simulation.hosts.replay import bench_of
from tests.bad_input.damage import refusal
from tests.exports.models import model_of
from tests.made import stated_model

PAGE = Path(__file__).parents[2] / "docs" / "export.md"
WORDS = {"exact": "exact", "approximate": "nearly", "none": "-"}
COLUMNS = {
    "model.xml alone": IN_THE_FILE,
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


@pytest.mark.parametrize("target", ["mujoco", "newton"])
def test_a_network_that_is_missing_leaves_nothing_behind(target: str, tmp_path: Path) -> None:
    """The message names the file."""
    values = {"file": str(tmp_path / "nothing.safetensors"), "spool_radius": 0.0125}
    model = stated_model("learned", values)
    with pytest.raises(TendonNewtonError, match=r"nothing\.safetensors"):
        EXPORTS[target].write(tmp_path, bench_of(BENCH, SERVO), model)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("target", list(EXPORTS))
def test_an_optional_number_may_be_left_out(target: str, tmp_path: Path) -> None:
    """A limit without a knee goes everywhere."""
    model = with_effect("force_saturation", limit=3.0)
    assert EXPORTS[target].write(tmp_path, bench_of(BENCH, model), model).files


@pytest.mark.parametrize("target", list(EXPORTS))
def test_a_model_that_takes_its_angle_as_given_is_refused(target, tmp_path, capsys) -> None:
    """A shaft led along a path has no servo: one line says so before anything is written."""
    model = stated_model("measured_path")
    write_model(tmp_path / "model.toml", model)
    words = ["export", str(tmp_path / "model.toml"), "--bench", "pendulum", "--to", target]
    said = refusal([*words, "--out", str(tmp_path / "out")], capsys)
    assert "'measured_path' takes the angle as given, and there is no servo to carry" in said
    assert not (tmp_path / "out").exists()
