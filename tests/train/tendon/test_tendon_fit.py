"""Give and slack of a tendon, found from tip and load cell, and what they do in a simulation."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tendon_newton.cli import main
from tendon_newton.data.dataset import Dataset, write_dataset
from tendon_newton.data.model_file import Model, NamedValues, load_model
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset
from tendon_newton.mechanisms.asset_library import asset_folder
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_train.tendon.taut_rows import TautRows
from tendon_train.tendon.tendon_fit import (
    as_effects,
    fit_tendon,
    line_through,
    solve,
    sums_of,
    unseen_error,
)
from tests.proposed import walk
from tests.train.policy.small import environment
from tests.train.tendon.pulled_benches import TRUE, pulled_log

NETWORK = asset_folder() / "networks" / "transformer-simulation-paper-0.safetensors"
IDEAL = Model(actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}))
STRING = (7000.0, 4.0e-4)  # [N/m], [m]


def logs() -> tuple[Recording, ...]:
    """Return recordings of a finger on a string of 7 kN/m, and of a slider."""
    finger = tuple(pulled_log("finger", seed=seed) for seed in (0, 1))
    return (*finger, pulled_log("spring_weak"))


def dataset_of(*train: Recording, test: tuple[Recording, ...] = ()) -> Dataset:
    """Put recordings into a dataset that lies nowhere."""
    return Dataset(path=Path("nowhere"), train=train, test=test)


def straight(stiffness: float, slack: float, noise: float = 0.0) -> list[TautRows]:
    """Return ten pieces of what a string gives under 0.5 to 9 N."""
    rng, force = np.random.default_rng(0), np.linspace(0.5, 9.0, 200)
    return [
        TautRows(force=force, surplus=slack + force / stiffness + noise * rng.normal(size=200))
        for _ in range(10)
    ]


def test_the_string_of_a_finger_is_found() -> None:
    """Stiffness and slack where arms are wrong by 1 and 2 % and a guide rubs by 5 %.

    Those errors of form move the stiffness by less than 15 % and the slack by 0.1 mm; a tenth of
    the error is left.
    """
    line = TRUE["finger"]
    fit, model = fit_tendon(dataset_of(*logs(), test=(pulled_log("finger", seed=2),)), IDEAL)
    assert (fit.bench, fit.held_out) == ("finger", True)
    assert fit.stiffness.value == pytest.approx(line.stiffness, rel=0.15)
    assert fit.slack.value == pytest.approx(line.slack, abs=1.5e-4)
    assert fit.error_after < 0.1 * fit.error_before
    assert [effect.name for effect in model.effects] == ["tendon_compliance", "tendon_slack"]
    again, same = fit_tendon(dataset_of(*logs()), model)
    assert again.error_before == again.error_after
    assert same == model


def test_intervals_hold_the_truth_and_shrink_with_the_noise() -> None:
    """Noise of 0.1 mm; a hundredth of it gives intervals a hundred times as narrow."""
    (stiffness, slack), ends = line_through(straight(*STRING, noise=1e-4))
    assert ends[0, 0] < STRING[0] < ends[0, 1]
    assert ends[1, 0] < STRING[1] < ends[1, 1]
    assert stiffness == pytest.approx(STRING[0], rel=0.02)
    assert slack == pytest.approx(STRING[1], abs=2e-5)
    _, narrow = line_through(straight(*STRING, noise=1e-6))
    assert np.ptp(narrow, axis=1) == pytest.approx(0.01 * np.ptp(ends, axis=1), rel=0.1)


def test_an_unseen_recording_is_measured_with_the_numbers_of_the_others() -> None:
    """Two strings, of k and of 2 k: each leaves what the other's stretch is off, F / 2 k."""
    (force,) = {piece.force.tobytes(): piece.force for piece in straight(*STRING)}.values()
    left = np.sqrt(np.mean((force / (2.0 * STRING[0])) ** 2))
    parts = [straight(*STRING), straight(2.0 * STRING[0], STRING[1])]
    assert unseen_error(parts, IDEAL) == pytest.approx(left, rel=1e-6)
    assert unseen_error([parts[0], parts[0]], IDEAL) == pytest.approx(0.0, abs=1e-9)


def test_rows_of_a_fast_motion_do_not_decide() -> None:
    """A tenth of the rows with a reading that is late by 2 N moves the stiffness by 2 % at most."""
    late = [
        TautRows(force=piece.force + 2.0 * (np.arange(200) % 10 == 0), surplus=piece.surplus)
        for piece in straight(*STRING, noise=1e-5)
    ]
    (stiffness, _), _ = line_through(late)
    assert stiffness == pytest.approx(STRING[0], rel=0.02)


def test_a_rigid_string_and_one_that_was_homed_under_tension_stay_in_bounds() -> None:
    """Neither slack nor give is ever negative."""
    (rigid,) = straight(np.inf, 1e-3)[:1]
    assert as_effects(*solve(sums_of(rigid, np.ones(200)))) == pytest.approx((1e6, 1e-3))
    (tight,) = straight(5000.0, -2e-4)[:1]
    stiffness, slack = as_effects(*solve(sums_of(tight, np.ones(200))))
    assert stiffness > 5000.0
    assert slack == 0.0


def test_a_dataset_that_does_not_show_the_string_is_refused() -> None:
    """Without a tip, without a load cell, or with nothing but sliders."""
    finger, _, slider = logs()
    for unfit in (replace(finger, tip=None), replace(finger, force=None), slider):
        with pytest.raises(InvalidDataset, match="force, tip_x and tip_z"):
            fit_tendon(dataset_of(unfit), IDEAL)


def test_a_user_completes_a_force_network(tmp_path, capsys, monkeypatch) -> None:
    """The verb writes a model on which fingers rest as their string says: r theta = l + s + F / k.

    By rows at rest in the loop of the training, with the network as actuator; in float32.
    """
    finger, _, slider = logs()
    write_dataset(tmp_path / "recordings", [finger, slider], [])
    words = [str(tmp_path / "recordings"), "--force", str(NETWORK), "--out", str(tmp_path / "fit")]
    monkeypatch.chdir(tmp_path)
    assert walk(["fit-tendon", *words]) == ["fit-tendon", "train-policy", "evaluate-policy"]
    assert "mm before" in capsys.readouterr().out
    assert main(["fit-tendon", *words[:-1], str(tmp_path / "recordings")]) == 2
    assert "results need a folder of their own" in capsys.readouterr().err
    found = json.loads((tmp_path / "fit" / "tendon.json").read_text())
    own = {e.name: e.values for e in load_model(tmp_path / "fit" / "model.toml").effects}
    stiffness = float(own["tendon_compliance"]["stiffness"])
    slack = float(own["tendon_slack"]["length"])
    assert (found["stiffness"]["value"], found["slack"]["value"]) == (stiffness, slack)
    world = environment(force=str(tmp_path / "fit" / "model.toml"), worlds=3)
    world.loop.reset(torch.zeros(3, 1))
    for _ in range(60):
        world.loop.step(torch.tensor([[1.0], [2.0], [3.0]]))
    reading = world.loop.reading
    taken = excursion(world.mechanism.tendons[0], reading.joint_position.numpy())
    pull, angle = reading.force[:, 0].numpy(), reading.motor_position[:, 0].numpy()
    assert pull.min() > 0.3
    np.testing.assert_allclose(
        0.0125 * angle, taken + slack + pull / stiffness, atol=2e-5
    )  # a thousandth of the motion: the finger still creeps


def test_a_string_that_does_not_give_leaves_the_model_as_it_was(tmp_path, capsys) -> None:
    """The bundled example has a rigid string: what noise suggests must not enter a model."""
    example = Path(__file__).parents[3] / "examples" / "hidden_friction"
    assert main(["fit-tendon", str(example), "--out", str(tmp_path / "fitted")]) == 0
    assert "the fit did not see: the model stays as it was" in capsys.readouterr().out
    assert load_model(tmp_path / "fitted" / "model.toml").effects == ()
    found = json.loads((tmp_path / "fitted" / "tendon.json").read_text())
    assert found["unseen_after"] >= found["unseen_before"]
