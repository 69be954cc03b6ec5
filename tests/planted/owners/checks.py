"""What tests ask of a bench's plant and of the diagnosis of its sets."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.model_file import Model, NamedValues, load_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnosis_file import StatedDiagnosis, read_diagnosis
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.hosts.rollout import Candidates, Stepping
from tests.planted.answers import ANSWER, answer_of
from tests.planted.owners.plant import GAIN, ROW_RATE, Faults, Finger, Run, simulate
from tests.planted.owners.sets import (
    FAULTS,
    Bench,
    Recipe,
    Truth,
    commands,
    make_datasets,
    truth_of,
)

ENCODER, CELL = 0.44e-3, 0.05  # [rad], [N] floors of the sensors
CLOSE = 0.1  # [1] a number's error over its distance from none
Planted = tuple[Faults, tuple[NamedValues, ...]]
"""Faults of the plant, and what they are in a model."""


def effect(name: str, servo: int | None, **values: float) -> NamedValues:
    """Return an effect of one servo, or of all."""
    return NamedValues(name=name, servo=servo, values=values)


def check_strings(finger: Finger, asset: str) -> None:
    """Expect the asset's excursions, to 10 nm in every posture."""
    mechanism = load_mechanism(asset)
    for q in np.random.default_rng(0).uniform(0.0, 1.5, (40, len(finger.mass))):
        there = [float(excursion(tendon, q)) for tendon in mechanism.tendons]
        assert finger.strings.at(q[None])[0][0] == pytest.approx(there, abs=1e-8)


def check_convergence(bench: Bench, faults: Faults) -> None:
    """Expect that half the step moves nothing by half of a sensor's floor."""
    run = Run(command=commands(np.random.default_rng(1), bench.levels, 4.0)[:40], faults=faults)
    (fine,), (finer,) = (simulate(bench.finger, [run], step=step) for step in (1e-4, 5e-5))
    assert np.sqrt(np.mean((fine.angle - finer.angle) ** 2)) < 0.5 * ENCODER
    assert np.sqrt(np.mean((fine.force - finer.force) ** 2)) < 0.5 * CELL


def check_agreement(bench: Bench, planted: Sequence[Planted]) -> None:
    """Expect that plant and simulator do the same, to the sensors' floors at each servo."""
    command = commands(np.random.default_rng(4), bench.levels, 2.0)
    motions = simulate(bench.finger, [Run(command=command, faults=own) for own, _ in planted])
    blank = np.zeros_like(command)
    recording = Recording(
        name="run.csv",
        bench=bench.name,
        time=np.arange(len(command)) / ROW_RATE,
        command=command,
        motor_position=blank,
        motor_velocity=blank,
        force=blank,
    )
    source = NamedValues(name="ideal", values={"gain": GAIN})
    models = [Model(actuator=source, effects=own) for _, own in planted]
    rollout = rollout_of(
        load_mechanism(bench.name),
        [recording],
        models[0],
        candidates=Candidates(effects=[effect.cause for _, own in planted for effect in own]),
        stepping=Stepping(time_step=2.5e-4),
    )
    found = rollout.run(np.stack([rollout.base_vectors(model) for model in models]))
    for motion, (own,) in zip(motions, found, strict=True):
        angle, force = own.motor_position - motion.angle, own.force - motion.force
        assert np.sqrt(np.mean(angle**2, axis=0)).max() < 2.0 * ENCODER
        assert np.sqrt(np.mean(force**2, axis=0)).max() < CELL


def diagnosed(folder: Path, recipe: Recipe) -> tuple[StatedDiagnosis, Truth]:
    """Make a set and diagnose it."""
    make_datasets([folder / "set"], [recipe])
    answer_of(folder / "set", folder)
    return read_diagnosis(folder / ANSWER), truth_of(recipe)


def check_answer(folder: Path, recipe: Recipe) -> None:
    """Expect the planted cause of its owner and no other, with its number in the model too."""
    said, truth = diagnosed(folder, recipe)
    assert is_right(said, recipe), said.effects
    if truth.value is None:
        return
    parameter = FAULTS[recipe.fault].parameter
    null = 1.0 if parameter == "scale" else 0.0
    found = said.effects[0].parameters[parameter].value
    assert abs(found - truth.value) < CLOSE * abs(truth.value - null)
    (entry,) = load_model(folder / "model.toml").effects
    assert (entry.name, entry.servo) == (recipe.fault, recipe.servo)
    assert entry.values[parameter] == found


def is_right(said: StatedDiagnosis, recipe: Recipe) -> bool:
    """Tell whether the planted cause is named with its owner, and no other; or nothing at all."""
    names = [cause.name for cause in said.effects]
    if recipe.cause is None:
        return said.verdict == "no_gap" and not names
    return names == [recipe.cause]
