"""Faults of one of two servos are named with their owner; data come from a plant of its own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.checks.lint import lint_recording
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import servo_of
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tests.planted.owners.checks import (
    check_agreement,
    check_answer,
    check_convergence,
    check_strings,
    diagnosed,
    effect,
)
from tests.planted.owners.plant import GAIN, ROW_RATE, SPOOL, Faults, Run, simulate
from tests.planted.owners.sets import Recipe, commands
from tests.planted.two_strings.bench import FINGER, TWO_STRINGS

COUNT = 2.0 * np.pi / 4096.0  # [rad] of an encoder


def test_strings_are_as_long_as_the_assets() -> None:
    """Two derivations that share no code give the same excursions to 10 nm in every posture."""
    check_strings(FINGER, "finger_antagonist")


def logs_of(commands: list[np.ndarray], sticks: float) -> list[Recording]:
    """Record the finger between two strings, of which the extensor's servo sticks [N]."""
    runs = [Run(command=u, faults=Faults(coulomb=(0.0, sticks))) for u in commands]
    return [
        Recording(
            name=f"run_{number}.csv",
            bench="finger_antagonist",
            time=np.arange(len(run.command)) / ROW_RATE,
            command=run.command,
            motor_position=(angle := COUNT * np.round(motion.angle / COUNT)),
            motor_velocity=np.gradient(angle, 1.0 / ROW_RATE, axis=0),
            force=motion.force,
        )
        for number, (run, motion) in enumerate(zip(runs, simulate(FINGER, runs), strict=True))
    ]


def swings(rng: np.random.Generator, turns: float | None) -> np.ndarray:
    """Return commands of both servos: steps at random, or a sine of so many turns."""
    low, high = np.array(TWO_STRINGS.levels).T
    share = 0.5 + 0.5 * np.sin(2.0 * np.pi * (turns or 0.0) * np.arange(400) / 400.0)
    shares = np.stack([share, np.roll(share, 3)], axis=1)
    if turns is None:
        held = [np.repeat(rng.uniform(size=20), rng.integers(25, 60, 20))[:400] for _ in range(2)]
        shares = np.stack(held, axis=1)
    return low + (high - low) * shares


def test_what_the_other_string_moves_is_no_fault_of_a_log(rng) -> None:
    """A string that is pulled by the other servo turns its own motor, against its command too."""
    for log in logs_of([swings(rng, turns) for turns in (None, 2.0, 8.0, None)], 1.1):
        assert [f for f in lint_recording(log) if f.severity == "defect"] == []


def test_commands_that_are_turned_or_exchanged_are_told_of_two_strings(rng) -> None:
    """What the other command explains does not hide it."""
    (log,) = logs_of([swings(rng, None)], 0.0)
    for place in (0, 1):
        sign = np.where(np.arange(2) == place, -1.0, 1.0)
        told = lint_recording(replace(log, command=sign * log.command))
        assert [(f.check, f.channel) for f in told if f.severity == "defect"] == [
            ("no command", f"theta_d_{place}")
        ]
    told = lint_recording(replace(log, command=log.command[:, ::-1]))
    exchanged = {f.channel for f in told if f.check == "exchanged joints"}
    assert "theta_0" in exchanged


@pytest.mark.slow
def test_the_plant_converges_with_its_step() -> None:
    """With every fault at once, half the step moves angles by less than half an encoder's floor."""
    faults = Faults(
        coulomb=(0.4, 0.2),
        viscous=(0.2, 0.1),
        slack=(0.001, 0.002),
        delay=(0.02, 0.01),
        lag=(0.02, 0.0),
    )
    check_convergence(TWO_STRINGS, faults)


def test_plant_and_simulator_do_the_same_with_faults_of_one_servo() -> None:
    """Less than the sensors' floors apart in angle and force of both servos."""
    electric = Faults(
        gain=(1.0, 0.7), delay=(0.03, 0.0), cell_gain=(1.2, 1.0), cell_bias=(0.0, 0.5)
    )
    mechanical = Faults(
        viscous=(0.4, 0.0), slack=(0.0, 0.003), lag=(0.02, 0.0), stiffness=(1.6,), damping=(2.0,)
    )
    planted = (
        (Faults(), ()),
        (
            electric,
            (
                effect("gain_error", 1, scale=0.7),
                effect("command_delay", 0, delay=0.03),
                effect("load_cell_gain", 0, scale=1.2),
                effect("load_cell_bias", 1, offset=0.5),
            ),
        ),
        (
            mechanical,
            (
                effect("actuator_lag", 0, time_constant=0.02),
                effect("viscous_friction", 0, coefficient=0.4),
                effect("tendon_slack", 1, length=0.003),
                effect("joint_stiffness_error", None, scale=1.6),
                effect("joint_damping_error", None, scale=2.0),
            ),
        ),
    )
    check_agreement(TWO_STRINGS, planted)


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


def recipe(fault: str, servo: int | None, seed: int = 5) -> Recipe:
    """Return a set of the finger between two strings."""
    return Recipe(bench=TWO_STRINGS, fault=fault, servo=servo, seed=seed)


def test_a_fault_of_one_servo_is_named_with_its_owner(tmp_path: Path) -> None:
    """In recordings of 2 s, whenever tests run; the others take a minute and more."""
    check_answer(tmp_path, replace(recipe("load_cell_gain", 0), duration=2.0))


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "servo"), TWO_STRINGS.kinds)
def test_a_fault_is_named_with_its_owner_and_no_other(fault, servo, tmp_path) -> None:
    """With its number within 10 % in the extended model too; a clean set is silent."""
    check_answer(tmp_path, recipe(fault, servo))


@pytest.mark.slow
def test_a_law_at_the_edge_of_its_range_gives_way_to_its_special_case(tmp_path: Path) -> None:
    """Bristles of 60 um look like the shortest hysteresis; Coulomb friction stands in its place."""
    said, truth = diagnosed(tmp_path, recipe("coulomb_friction", 1, seed=7013))
    assert [cause.name for cause in said.effects] == [truth.recipe.cause]


@pytest.mark.slow
def test_a_fault_of_one_servo_is_never_named_on_the_other(tmp_path: Path) -> None:
    """Other causes of the finger may stand beside it, but none of the sound servo."""
    said, truth = diagnosed(tmp_path, recipe("gain_error", 1))
    names = [cause.name for cause in said.effects]
    assert truth.recipe.cause in names
    assert {servo_of(name) for name in names} <= {1, None}


def test_commands_leave_a_finger_one_place_to_rest() -> None:
    """The extensor pulls little, and commands move on within some rows."""
    command = commands(np.random.default_rng(2), TWO_STRINGS.levels, 4.0)
    assert command[:, 1].max() <= 1.0  # [rad] from 1.2 on a finger may rest in two ways
    assert np.abs(np.diff(command, axis=0)).max() < 0.5  # [rad] a row
