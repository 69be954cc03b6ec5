"""Faults of one of two servos are named with their owner; data come from a plant of its own."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.model_file import Model, NamedValues, load_model
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import servo_of
from tendon_newton.diagnosis.diagnosis_file import StatedDiagnosis, read_diagnosis
from tendon_newton.exam.exam import ANSWER, answer_one
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay, rollout_of
from tests.planted.two_strings.finger import (
    GAIN,
    ROW_RATE,
    SPOOL,
    STRINGS,
    Faults,
    Motion,
    Run,
    simulate,
)
from tests.planted.two_strings.sets import (
    KINDS,
    OF_MECHANISM,
    OF_SERVO,
    SILENT,
    Recipe,
    Truth,
    commands,
    make_datasets,
    truth_of,
)

ENCODER, CELL = 0.44e-3, 0.05  # [rad], [N] floors of the sensors
FORM = 3e-3  # [rad] by which Coulomb's law misses bristles, and [0.1 N] likewise
CLOSE = 0.1  # [1] a number's error over its distance from none
QUICK = ((SILENT, None),)
"""What is diagnosed whenever tests run; the others take minutes each."""


def test_strings_are_as_long_as_the_assets() -> None:
    """Two derivations that share no code give the same excursions to 10 nm in every posture."""
    mechanism = load_mechanism("finger_antagonist")
    for q in np.random.default_rng(0).uniform(0.0, 1.5, (40, 2)):
        own = STRINGS.at(q[None])[0][0]
        there = [float(excursion(tendon, q)) for tendon in mechanism.tendons]
        assert own == pytest.approx(there, abs=1e-8)


def moved(run: Run, step: float) -> Motion:
    """Simulate one run at a step [s]."""
    return simulate([run], step=step)[0]


def test_the_plant_converges_with_its_step() -> None:
    """With every fault at once, half the step moves angles by less than half an encoder's floor."""
    faults = Faults(
        coulomb=(0.4, 0.2),
        viscous=(0.2, 0.1),
        slack=(0.001, 0.002),
        delay=(0.02, 0.01),
        lag=(0.02, 0.0),
    )
    run = Run(command=commands(np.random.default_rng(1))[:40], faults=faults)
    fine, finer = (moved(run, step) for step in (1e-4, 5e-5))
    assert np.sqrt(np.mean((fine.angle - finer.angle) ** 2)) < 0.5 * ENCODER
    assert np.sqrt(np.mean((fine.force - finer.force) ** 2)) < 0.5 * CELL


def planted_effects() -> tuple[tuple[Faults, tuple[NamedValues, ...]], ...]:
    """Return faults of the plant, and what they are in a model."""

    def effect(name: str, servo: int | None, **values: float) -> NamedValues:
        return NamedValues(name=name, servo=servo, values=values)

    return (
        (Faults(), ()),
        (
            Faults(gain=(1.0, 0.7), delay=(0.03, 0.0), cell_gain=(1.2, 1.0), cell_bias=(0.0, 0.5)),
            (
                effect("gain_error", 1, scale=0.7),
                effect("command_delay", 0, delay=0.03),
                effect("load_cell_gain", 0, scale=1.2),
                effect("load_cell_bias", 1, offset=0.5),
            ),
        ),
        (
            Faults(
                viscous=(0.4, 0.0),
                slack=(0.0, 0.003),
                lag=(0.02, 0.0),
                stiffness=1.6,
                damping=2.0,
            ),
            (
                effect("actuator_lag", 0, time_constant=0.02),
                effect("viscous_friction", 0, coefficient=0.4),
                effect("tendon_slack", 1, length=0.003),
                effect("joint_stiffness_error", None, scale=1.6),
                effect("joint_damping_error", None, scale=2.0),
            ),
        ),
    )


def test_plant_and_simulator_do_the_same_with_faults_of_one_servo() -> None:
    """Less than the sensors' floors apart in angle and force of both servos."""
    command = commands(np.random.default_rng(4))
    faults, effects = zip(*planted_effects(), strict=True)
    motions = simulate([Run(command=command, faults=own) for own in faults])
    blank = np.zeros_like(command)
    recording = Recording(
        name="run.csv",
        bench="finger_antagonist",
        time=np.arange(len(command)) / ROW_RATE,
        command=command,
        motor_position=blank,
        motor_velocity=blank,
        force=blank,
    )
    source = NamedValues(name="ideal", values={"gain": GAIN})
    models = [Model(actuator=source, effects=own) for own in effects]
    rollout = rollout_of(
        load_mechanism(recording.bench),
        [recording],
        models[0],
        effects=[effect.cause for own in effects for effect in own],
        time_step=2.5e-4,
    )
    found = rollout.run(np.stack([rollout.base_vectors(model) for model in models]))
    for motion, (own,) in zip(motions, found, strict=True):
        assert np.sqrt(np.mean((own.motor_position - motion.angle) ** 2)) < 2.0 * ENCODER
        assert np.sqrt(np.mean((own.force - motion.force) ** 2)) < CELL


def test_of_two_places_to_rest_a_recording_starts_in_the_one_that_was_measured() -> None:
    """A strong extensor buckles the finger: both rests have one command, and each is kept."""
    mechanism = load_mechanism("finger_antagonist")
    model = Model(
        actuator=NamedValues(name="ideal", values={"gain": GAIN}),
        effects=(NamedValues(name="gain_error", servo=1, values={"scale": 1.442}),),
    )
    command = np.tile([2.1475, 0.948], (20, 1))
    for rest in ([0.439, 0.741], [0.0, 1.143]):
        angle = [float(excursion(tendon, np.array(rest))) / SPOOL for tendon in mechanism.tendons]
        recording = Recording(
            name="run.csv",
            bench="finger_antagonist",
            time=np.arange(len(command)) / ROW_RATE,
            command=command,
            motor_position=np.tile(angle, (len(command), 1)),
            motor_velocity=np.zeros_like(command),
            force=None,
        )
        (own,) = replay([recording], model, time_step=1e-3)
        assert own.joint_position[0] == pytest.approx(rest, abs=2e-3)  # rounded to mrad above
        assert own.joint_position[-1] == pytest.approx(own.joint_position[0], abs=1e-6)


def diagnosed(
    folder: Path, fault: str, servo: int | None, seed: int = 5
) -> tuple[StatedDiagnosis, Truth]:
    """Make a set and diagnose it."""
    recipe = Recipe(fault=fault, servo=servo, seed=seed)
    make_datasets([folder / "set"], [recipe])
    assert answer_one((folder / "set", folder)) is not None, (folder / "error.txt").read_text()
    return read_diagnosis(folder / ANSWER), truth_of(recipe)


@pytest.mark.parametrize(
    ("fault", "servo"),
    [pytest.param(*kind, marks=() if kind in QUICK else pytest.mark.slow) for kind in KINDS],
)
def test_a_fault_is_named_with_its_owner_and_no_other(
    fault: str, servo: int | None, tmp_path: Path
) -> None:
    """With its number within 10 % in the extended model too; a clean set is silent."""
    said, truth = diagnosed(tmp_path, fault, servo)
    names = [cause.name for cause in said.effects]
    if truth.recipe.cause is None:
        assert (said.verdict, names) == ("no_gap", [])
        return
    assert names == [truth.recipe.cause]
    assert truth.value is not None
    planted = {**OF_SERVO, **OF_MECHANISM}[fault]
    null = 1.0 if planted.parameter == "scale" else 0.0
    found = said.effects[0].parameters[planted.parameter].value
    assert abs(found - truth.value) < CLOSE * abs(truth.value - null)
    (entry,) = load_model(tmp_path / "model.toml").effects
    assert (entry.name, entry.servo) == (fault, servo)
    assert entry.values[planted.parameter] == found


@pytest.mark.slow
def test_a_law_at_the_edge_of_its_range_gives_way_to_its_special_case(tmp_path: Path) -> None:
    """Bristles of 60 um look like the shortest hysteresis; Coulomb friction stands in its place."""
    said, truth = diagnosed(tmp_path, "coulomb_friction", 1, seed=7013)
    assert [cause.name for cause in said.effects] == [truth.recipe.cause]


def test_a_fault_of_one_servo_is_never_named_on_the_other(tmp_path: Path) -> None:
    """Other causes of the finger may stand beside it, but none of the sound servo."""
    said, truth = diagnosed(tmp_path, "gain_error", 1)
    names = [cause.name for cause in said.effects]
    assert truth.recipe.cause in names
    assert {servo_of(name) for name in names} <= {1, None}


def test_commands_leave_a_finger_one_place_to_rest() -> None:
    """The extensor pulls little, and commands move on within some rows."""
    command = commands(np.random.default_rng(2))
    assert command[:, 1].max() <= 1.0  # [rad] from 1.2 on a finger may rest in two ways
    assert np.abs(np.diff(command, axis=0)).max() < 0.5  # [rad] a row
