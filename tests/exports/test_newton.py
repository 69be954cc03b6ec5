"""An identified model in Newton: what its reader makes of the prims, and how the drive moves."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from newton.actuators import parse_actuator_prim

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.departure import standard_runs
from tendon_newton.exports.newton.drive_numbers import columns, path_of
from tendon_newton.exports.newton.newton_target import DRIVE_FILE, PROGRAM_FILE, write_newton_target
from tendon_newton.exports.written_program import load_program
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import bench_of, replay
from tests.exports.models import ANGLE, FORCE, PWM, TYPICAL, model_of, strays, strays_of
from tests.physics.runs import run_of

SERVO_SIDE = (
    "command_delay", "actuator_lag", "viscous_friction", "load_dependent_friction",
    "routing_friction", "viscoelastic_spring", "inertia_error", "gravity_misalignment",
    "joint_dry_friction",
)  # fmt: skip
ROTOR_SIDE = ("tendon_slack", "coulomb_friction", "tendon_compliance", "torque_fade", "speed_limit")
WAYS = 3.0e-5  # m: a hundredth of the thumb's excursion, a fifth of what a spool's count winds in


@pytest.mark.parametrize(
    ("bench", "actuator", "effects"),
    [
        ("finger", "ideal", SERVO_SIDE),
        ("finger", "pwm_servo", ROTOR_SIDE),
        ("spring_weak", "pwm_servo", ()),
        pytest.param("thumb", "ideal", (), marks=pytest.mark.slow),
        ("pendulum", "pwm_servo", ("gear_load_friction",)),
        ("spring_weak", "pwm_servo", ("coulomb_friction", "presliding", "routing_friction")),
        ("finger", "learned", ()),
    ],
)
def test_the_drive_moves_a_bench_in_newton_as_our_simulation_does(
    bench: str, actuator: str, effects: tuple[str, ...], tmp_path: Path
) -> None:
    """It strays by less than an encoder count and 0.05 N."""
    found = strays(tmp_path, "newton", PROGRAM_FILE, bench, actuator, *effects)
    assert found.angle < ANGLE
    assert found.force < FORCE


def test_links_that_a_diagnosis_found_longer_and_heavier_move_in_newton(tmp_path: Path) -> None:
    """Stated numbers that a fit moved are in the bench that Newton reads."""
    own = BenchOverrides(mass=(0.0118, 0.0081), length=(0.033, 0.024), moment_arm=(0.0081, 0.0054))
    model = replace(
        model_of("finger", "ideal", "viscous_friction"), bench_overrides={"finger": own}
    )
    found = strays_of(tmp_path, "newton", PROGRAM_FILE, "finger", model)
    assert found.angle < ANGLE
    assert found.force < FORCE


def test_a_jump_turns_a_spool_that_rests_round_at_once(tmp_path: Path) -> None:
    """The cell reads friction on the side on which the spool then slides, in the very row."""
    model = model_of("finger", "pwm_servo", "coulomb_friction")
    mechanism = bench_of("finger", model)
    (standard,) = standard_runs(mechanism, PWM["spool_radius"])
    run = run_of(standard.command[:81])  # the last row is a jump down
    exported = write_newton_target(tmp_path, mechanism, model)
    found, (ours,) = exported.replays[PROGRAM_FILE](run), replay([run], model)
    sides = 2.0 * TYPICAL["coulomb_friction"]["force"]  # N between sliding in and out
    assert found.force[-1, 0] == pytest.approx(ours.force[-1, 0], abs=0.1 * sides)


def test_nothing_pulls_inside_a_gap(tmp_path: Path) -> None:
    """A command that lands in the play of a rotor's gear lets the string go, at once."""
    model = model_of("finger", "pwm_servo", "backlash")
    mechanism = bench_of("finger", model)
    held = np.full((40, 1), 1.2)
    (before,) = replay([run_of(held)], model)
    assert before.force[-1, 0] > 1.0
    command = np.concatenate([held, np.full((1, 1), before.motor_position[-1, 0] - 0.01)])
    run = run_of(command)
    exported = write_newton_target(tmp_path, mechanism, model)
    found = exported.replays[PROGRAM_FILE](run)
    (ours,) = replay([run], model)
    assert found.force[:-1] == pytest.approx(ours.force[:-1], abs=FORCE)
    assert ours.force[-1, 0] == 0.0
    assert found.force[-1, 0] == 0.0


@pytest.fixture(scope="module")
def slider(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A slider with a late servo, for Newton."""
    folder = tmp_path_factory.mktemp("slider")
    model = model_of("spring_weak", "pwm_servo", "command_delay", "gain_error")
    write_newton_target(folder, bench_of("spring_weak", model), model)
    return folder


def actuator_prims(path: Path) -> list[Any]:
    """Return what Newton's own reader makes of a file's actuators."""
    from pxr import Usd

    stage = Usd.Stage.Open(str(path))
    parsed = [parse_actuator_prim(prim) for prim in stage.Traverse()]
    return [entry for entry in parsed if entry is not None]


def test_newton_reads_our_drive_once_it_is_registered(slider: Path) -> None:
    """Each joint of a tendon has a prim, which names the class of the file beside it."""
    program = load_program(slider / PROGRAM_FILE)
    program.register()
    (parsed,) = actuator_prims(slider / DRIVE_FILE)
    assert parsed.drive_class is program.TendonDrive
    assert parsed.drive_kwargs == {"tendon": 0, "joint": 0}


def test_many_worlds_move_as_one(slider: Path) -> None:
    """Three worlds under three commands end where a world of each ends; a reset leaves no trace."""
    program = load_program(slider / PROGRAM_FILE)
    commands = np.array([[0.5], [1.0], [2.0]])
    many = program.Simulation(worlds=3, device="cpu")
    alone = program.Simulation(device="cpu")
    many.reset(np.full((3, 1), 0.4), [0.004])
    many.command(commands)
    many.step(600)
    for world, command in enumerate(commands):
        alone.reset([0.4], [0.004])
        alone.command(command)
        alone.step(600)
        there = alone.states[alone.at].joint_q.numpy()[0]
        assert many.states[many.at].joint_q.numpy()[world] == pytest.approx(there, abs=1e-7)


def test_what_the_drive_leaves_out_is_told(tmp_path: Path) -> None:
    """Nobody has a load cell in Newton."""
    model = model_of("finger", "ideal", "load_cell_bias", "coulomb_friction")
    exported = write_newton_target(tmp_path, bench_of("finger", model), model)
    assert exported.left_out == {PROGRAM_FILE: ("load_cell_bias",)}


def test_a_joint_with_two_tendons_is_refused(tmp_path: Path) -> None:
    """Newton's actuators have one command per joint."""
    model = model_of("finger", "ideal")
    with pytest.raises(InvalidModelFile, match="one tendon must drive"):
        write_newton_target(tmp_path, load_mechanism("finger_antagonist"), model)
    assert not list(tmp_path.iterdir())


def test_a_routed_tendon_s_way_is_a_polynomial() -> None:
    """It strays from the thumb's path by less than it says, between the samples too."""
    mechanism = load_mechanism("thumb")
    (tendon,) = mechanism.tendons
    path = path_of(mechanism, tendon)
    rng = np.random.default_rng(3)
    ends = np.array([joint.limits for joint in mechanism.joints])
    q = ends[:, 0] + rng.random((200, len(ends))) * (ends[:, 1] - ends[:, 0])
    length = np.array([excursion(tendon, row) for row in q])
    assert np.abs(columns(q, path.powers) @ path.factor - length).max() < WAYS
    assert path.stray < WAYS
