"""Datasets come out as asked for, the same for the same seed, and know nothing of the simulator."""

import json
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.errors import UnknownName
from tests.interpreters import python
from tests.planted.generator import Recipe, main, make_dataset
from tests.planted.physics.commands import COMMANDS
from tests.planted.physics.sensors import (
    Sensors,
    coloured_noise,
    encoder,
    load_cell,
    speed_register,
)
from tests.planted.sets.draws import EFFECTS, MIX_OF, OUTSIDE

ROOT = Path(__file__).parents[2]
SHORT = (4.0, 5.0)  # [s] of each recording, where length proves nothing
FORBIDDEN = (
    "tendon_newton.simulation", "tendon_newton.effects", "tendon_newton.mechanisms",
    "tendon_newton.actuators", "tendon_newton.identification", "tendon_newton.diagnosis", "newton",
    "pxr",
)  # fmt: skip


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a folder."""
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def test_the_same_seed_gives_the_same_files(tmp_path: Path) -> None:
    """Bit for bit; another seed, or another cause, gives other recordings."""
    chosen = {"a": 1, "b": 1, "c": 2}
    truths = {
        name: make_dataset(
            tmp_path / name,
            Recipe(effects=("coulomb_friction",), seed=seed, mix="F", duration=SHORT),
        )
        for name, seed in chosen.items()
    }
    files = {name: content(tmp_path / name) for name in chosen}
    assert files["a"] == files["b"]
    assert files["a"] != files["c"]
    assert truths["a"] == truths["b"]


QUICK = "coulomb_friction"


@pytest.mark.parametrize(
    "cause",
    [QUICK, *(pytest.param(c, marks=pytest.mark.slow) for c in (*EFFECTS, *OUTSIDE) if c != QUICK)],
)
def test_every_cause_stands_out_of_the_noise(cause: str, tmp_path: Path) -> None:
    """Held-out force or angle moves by several floors; the folder does not say why."""
    mix = MIX_OF.get(cause, "A")
    recipe = Recipe(effects=(cause,), seed=5, mix=mix, duration=(6.0, 7.0))
    truth = make_dataset(tmp_path, recipe)
    assert truth.family == ("outside" if cause in OUTSIDE else "single")
    assert truth.parameters[cause]
    assert truth.strength > 2.0 or truth.strength_theta > 10.0
    assert truth.nominal > truth.true
    assert not any(cause.encode() in text for text in content(tmp_path).values())


def test_a_dataset_has_every_bench_in_both_splits(tmp_path: Path) -> None:
    """Five recordings to train on, three to test on, 12 to 19 s each at 80 Hz."""
    make_dataset(tmp_path, Recipe(seed=1))
    dataset: Dataset = load_dataset(tmp_path)
    assert (len(dataset.train), len(dataset.test)) == (5, 3)
    benches = {"finger", "spring_weak", "spring_strong"}
    for split in (dataset.train, dataset.test):
        assert {recording.bench for recording in split} == benches
        for recording in split:
            assert 11.9 < recording.duration < 19.0
            assert np.diff(recording.time) == pytest.approx(0.0125)
            assert (recording.tip is not None) == (recording.bench == "finger")


def test_nothing_planted_moves_nothing(tmp_path: Path) -> None:
    """The truth of a clean dataset is empty and its strength zero."""
    truth = make_dataset(tmp_path, Recipe(seed=1, mix="W"))
    assert (truth.effects, dict(truth.parameters), truth.family) == ((), {}, "clean")
    assert truth.strength == truth.strength_theta == 0.0
    assert truth.nominal == truth.true
    assert truth.true[0] == pytest.approx(0.05, rel=0.1)  # 3,000 draws
    assert truth.true[1] == pytest.approx(0.443e-3, rel=0.15)  # a staircase at rest is no dither


def test_two_causes_are_both_in_the_plant(tmp_path: Path) -> None:
    """A delay and a bias: the angle of the delay alone, the force of both."""
    names = ("command_delay", "load_cell_bias")
    truth = make_dataset(tmp_path, Recipe(effects=names, seed=1, duration=SHORT))
    assert truth.family == "pair"
    assert set(truth.parameters) == set(names)
    assert truth.strength_theta > 10.0
    assert truth.strength > abs(truth.parameters["load_cell_bias"]["offset"]) / 0.05


def test_a_tenth_of_the_size_is_about_a_tenth_of_the_strength(tmp_path: Path) -> None:
    """The same seed draws the same command, so only the cause is smaller."""
    whole, tenth = (
        make_dataset(
            tmp_path / str(s), Recipe(effects=("gain_error",), seed=4, size=s, duration=SHORT)
        )
        for s in (1.0, 0.1)
    )
    assert tenth.strength / whole.strength == pytest.approx(0.1, rel=0.3)


def test_a_bench_off_its_drawing_is_wrong_for_the_model_alone(tmp_path: Path) -> None:
    """Nothing is planted, the plant is itself, and yet the starting model errs."""
    truth = make_dataset(tmp_path, Recipe(seed=1, mix="F", off_nominal=0.05, duration=SHORT))
    assert truth.family == "clean"
    assert truth.strength == 0.0
    assert truth.nominal[1] > 5.0 * truth.true[1]


def test_unlisted_imperfections_stay_about_the_noise(tmp_path: Path) -> None:
    """At level 1 they move angle and force by about one sensor floor, and they do move them."""
    datasets = []
    for level in (0.0, 1.0):
        out = tmp_path / str(level)
        make_dataset(out, Recipe(seed=2, imperfection=level, duration=SHORT))
        datasets.append(load_dataset(out).test)
    pairs = list(zip(*datasets, strict=True))
    force = np.concatenate([a.force - b.force for a, b in pairs])
    theta = np.concatenate([a.motor_position - b.motor_position for a, b in pairs])
    assert 0.0 < np.sqrt(np.mean(force**2)) < 0.02
    assert np.sqrt(np.mean(theta**2)) < 2e-3


def test_a_bench_without_a_load_cell_logs_no_force(tmp_path: Path) -> None:
    """All else is what the same bench logs with one."""
    for without in (False, True):
        recipe = Recipe(
            effects=("coulomb_friction",), seed=3, mix="S", duration=SHORT, without_force=without
        )
        make_dataset(tmp_path / str(without), recipe)
    seen, blind = (load_dataset(tmp_path / str(without)).train for without in (False, True))
    assert all(recording.force is None for recording in blind)
    for one, other in zip(seen, blind, strict=True):
        assert np.array_equal(one.motor_position, other.motor_position)


def test_a_known_friction_is_in_the_model_and_adds_to_the_planted_one(tmp_path: Path) -> None:
    """The truth of a friction that the model knows in part is the new total."""
    effects = ("viscous_friction",)
    recipe = Recipe(effects=effects, seed=1, mix="S", duration=SHORT, known_friction=True)
    truth = make_dataset(tmp_path, recipe)
    known = {
        effect.name: dict(effect.values) for effect in load_model(tmp_path / "model.toml").effects
    }
    assert known == {"viscous_friction": {"coefficient": 1.5}, "coulomb_friction": {"force": 0.8}}
    assert truth.parameters["viscous_friction"]["coefficient"] > 2.2


def test_a_log_with_gaps_keeps_its_first_row_and_its_commands(tmp_path: Path) -> None:
    """Rows are lost after the fact: what is left equals the same dataset without gaps."""
    make_dataset(tmp_path / "gaps", Recipe(seed=1, mix="W", gaps=True))
    make_dataset(tmp_path / "whole", Recipe(seed=1, mix="W"))
    lost, whole = (load_dataset(tmp_path / name).train[0] for name in ("gaps", "whole"))
    assert lost.time[0] == 0.0
    assert 8 < whole.sample_count - lost.sample_count < 120
    left = np.isin(whole.time, lost.time)
    assert lost.command is not None
    assert np.array_equal(lost.command, whole.command[left])
    assert np.array_equal(lost.motor_position, whole.motor_position[left])


def test_the_command_line_writes_the_truth_beside_the_folder(tmp_path: Path) -> None:
    """OUT.truth.json, never inside OUT."""
    main([str(tmp_path / "set"), "--effect", "gain_error", "--seed", "3"])
    truth = json.loads((tmp_path / "set.truth.json").read_text())
    (effect,) = truth["effects"]
    assert effect["name"] == "gain_error"
    assert "scale" in effect["parameters"]
    assert not list((tmp_path / "set").glob("*.json"))


def test_an_unknown_cause_is_refused(tmp_path: Path) -> None:
    """With the names that are known."""
    with pytest.raises(UnknownName, match="viscous_friction"):
        make_dataset(tmp_path, Recipe(effects=("viscous_fricton",)))


@pytest.mark.parametrize("colour", [0.0, 0.6, 0.9])
def test_noise_has_the_colour_and_size_asked_for(colour: float) -> None:
    """Standard deviation 0.05 N, neighbours correlated by the colour."""
    force = np.full(200_000, 3.0)
    noise = load_cell(np.random.default_rng(0), force, Sensors(noise_colour=colour)) - 3.0
    assert noise.std() == pytest.approx(0.05, rel=0.03)  # 200,000 draws, fewer when coloured
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(colour, abs=0.01)
    assert abs(coloured_noise(np.random.default_rng(1), 9, colour)).max() < 5.0


def test_encoder_and_register_have_their_floors() -> None:
    """A count's rounding leaves 0.443 mrad without bias; speeds come in steps of 0.024 rad/s."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, 6.0, size=100_000)
    error = encoder(angle) - angle
    assert error.std() == pytest.approx(0.443e-3, rel=0.01)
    assert abs(error.mean()) < 1e-5
    speed = speed_register(rng, np.zeros(100_000))
    assert speed / 0.024 == pytest.approx(np.round(speed / 0.024), abs=1e-9)
    assert speed.std() == pytest.approx(np.hypot(0.02, 0.024 / np.sqrt(12.0)), rel=0.02)


def test_a_slow_cell_is_filled_in_linearly_and_held_at_the_ends() -> None:
    """At 20 Hz every fourth row is a reading, from a first row of 0 to 3."""
    force = np.random.default_rng(2).uniform(0.0, 9.0, size=402)
    firsts = set()
    for seed in range(12):
        filled = load_cell(np.random.default_rng(seed), force, Sensors(cell_rate=20.0))
        (bends,) = np.nonzero(np.abs(np.diff(filled, 2)) > 1e-9)
        first = int((bends[0] + 1) % 4)
        assert {int((row + 1) % 4) for row in bends} == {first}
        assert np.ptp(filled[: first + 1]) == 0.0
        firsts.add(first)
    assert firsts == {0, 1, 2, 3}


@pytest.mark.parametrize("kind", list(COMMANDS))
def test_commands_stay_within_one_turn(kind: str) -> None:
    """Every command lies in [0, 2 pi] rad and moves."""
    for seed in range(20):
        command = COMMANDS[kind](np.random.default_rng(seed), 1200)
        assert command.shape == (1200,)
        assert command.min() >= 0.0
        assert command.max() <= 2.0 * np.pi
        assert np.ptp(command) > 0.5


def test_the_generator_knows_nothing_of_the_simulator() -> None:
    """A fresh interpreter that imported it holds none of the fitted equations."""
    code = "import json, sys, lab.exams.draw; print(json.dumps(list(sys.modules)))"
    loaded = set(json.loads(python("-c", code).stdout.splitlines()[-1]))
    assert not [name for name in FORBIDDEN if name in loaded]
