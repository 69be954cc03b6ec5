"""An effect of one servo acts there as that of all does, and nowhere else."""

from itertools import product

import numpy as np
import pytest
import torch

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import name_of
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.model_numbers import refuse_damaged
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Rollout, Trajectory

ROWS, RATE = 120, 80.0
IDEAL = NamedValues(name="ideal", values={"gain": 4.2})
MOTOR = NamedValues(
    name="pwm_servo",
    values={
        "duty_per_rad": 0.25, "max_duty": 0.9, "supply_voltage": 5.0, "torque_constant": 0.9,
        "resistance": 15.0, "armature": 1e-4, "duty_offset": 0.0,
    },
)  # fmt: skip
# one of each way in which an effect reaches a servo: its clock, spool, error, gear, memory, cells
CAUSES = {
    "command_delay": {"delay": 0.031},
    "spool_radius_error": {"scale": 1.2},
    "gain_error": {"scale": 0.7},
    "actuator_lag": {"time_constant": 0.04},
    "coulomb_friction": {"force": 0.6},
    "hysteresis": {"force": 0.5, "travel": 0.05},
    "load_cell_lag": {"time_constant": 0.03},
    "load_cell_delay": {"delay": 0.02},
}
OF_MOTOR = {"tendon_compliance": {"stiffness": 4e3}, "speed_limit": {"limit": 0.5}}


def recording(bench: str = "finger_antagonist") -> Recording:
    """Return commands of every servo, each in its own time."""
    time = np.arange(ROWS) / RATE
    tendons = range(len(load_mechanism(bench).tendons))
    command = np.stack([1.6 + np.sin(7.0 * time + 2.0 * d) for d in tendons], axis=1)
    blank = np.zeros_like(command)
    return Recording(
        name="run.csv", bench=bench, time=time, command=command,
        motor_position=blank, motor_velocity=blank, force=blank,
    )  # fmt: skip


def effect(name: str, servo: int | None = None, **values: float) -> NamedValues:
    """Return an effect of one servo or of all."""
    return NamedValues(name=name, servo=servo, values=values)


def run(*effects: NamedValues, actuator: NamedValues = IDEAL) -> Trajectory:
    """Simulate the finger between two strings."""
    (out,) = replay([recording()], Model(actuator=actuator, effects=effects), time_step=1e-3)
    return out


@pytest.mark.parametrize(
    ("actuator", "causes"), [(IDEAL, CAUSES), (MOTOR, OF_MOTOR)], ids=["source", "motor"]
)
def test_the_same_at_each_servo_is_the_same_at_all(
    actuator: NamedValues, causes: dict[str, dict[str, float]]
) -> None:
    """To the last bit; and one servo's alone is neither that nor nothing."""
    names = [*causes, *(name_of(name, d) for name, d in product(causes, (0, 1)))]
    rollout = Rollout(
        load_mechanism("finger_antagonist"), [recording()], actuator=actuator.name,
        effects=names, shared=list(causes), device="cpu",
    )  # fmt: skip
    models = [Model(actuator=actuator)]
    for name, values in causes.items():
        both, *own = (effect(name, servo, **values) for servo in (None, 0, 1))
        models += [Model(actuator=actuator, effects=chosen) for chosen in (
            (both,), tuple(own), (own[0],), (own[1],)
        )]  # fmt: skip
    vectors = np.stack([rollout.base_vectors(model) for model in models])
    signals = rollout.run_rows(vectors, 1e-3)
    for place, name in enumerate(causes):
        none, all_, each, first, second = (
            np.concatenate([signals[key][n] for key in ("angle", "force")], axis=1)
            for n in (0, *range(1 + 4 * place, 5 + 4 * place))
        )
        assert np.array_equal(all_, each), name
        different = [none, first, second]
        assert len({x.tobytes() for x in different}) == len(different), name
        if EFFECTS[name].side == "sensor":  # what a cell shows moves nothing else
            assert np.array_equal(first[:, 3], none[:, 3]), name
            assert np.array_equal(first[:, 2], all_[:, 2]), name


def test_what_one_servo_has_counts_there_before_what_all_have() -> None:
    """An effect of all servos and one of servo 1 are two effects of one servo each."""
    both = run(effect("gain_error", scale=0.8), effect("gain_error", 1, scale=1.0))
    own = run(effect("gain_error", 0, scale=0.8))
    assert np.array_equal(both.motor_position, own.motor_position)
    assert np.array_equal(both.force, own.force)


def test_an_effect_of_the_only_servo_is_that_of_all() -> None:
    """On a bench of one servo the key changes nothing."""
    finger = recording("finger")
    runs = [
        replay([finger], Model(actuator=IDEAL, effects=(effect("gain_error", d, scale=0.8),)))[0]
        for d in (None, 0)
    ]
    assert np.array_equal(runs[0].motor_position, runs[1].motor_position)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (effect("gain_error", 2, scale=0.8), r"'gain_error' must be .* 0 to 1; it is 2"),
        (
            effect("joint_damping_error", 0, scale=2.0),
            r"'joint_damping_error' is not about a servo",
        ),
        (
            effect("sample_period_error", 0, scale=1.1),
            r"'sample_period_error' is not about a servo",
        ),
    ],
)
def test_a_servo_that_is_not_there_is_refused(entry: NamedValues, words: str) -> None:
    """So is one of an effect that no servo has."""
    with pytest.raises(InvalidModelFile, match=words):
        run(entry)


def test_fingers_that_share_nothing_are_refused() -> None:
    """A hand's kernels are those of one finger, which has one servo."""
    model = Model(actuator=IDEAL, effects=(effect("gain_error", 1, scale=0.8),))
    hand = load_mechanism("hand")
    with pytest.raises(InvalidModelFile, match=r"equal ones apart.*gain_error"):
        replay([recording("hand")], model)
    with pytest.raises(InvalidModelFile, match=r"equal ones apart.*gain_error"):
        ControlLoop(hand, model, 1, device="cpu")


def test_an_export_refuses_effects_of_one_servo() -> None:
    """What it cannot hold is not left out silently."""
    model = Model(actuator=IDEAL, effects=(effect("gain_error", 1, scale=0.8),))
    with pytest.raises(InvalidModelFile, match="'gain_error' is of servo 1 alone"):
        refuse_damaged(model)


def test_a_control_loop_holds_effects_of_one_servo() -> None:
    """Its rows are those of a rollout, and its numbers by world are the servo's."""
    entry = effect("gain_error", 1, scale=0.7)
    model = Model(actuator=IDEAL, effects=(entry,))
    mechanism, rows = load_mechanism("finger_antagonist"), recording()
    assert rows.command is not None
    loop = ControlLoop(mechanism, model, 1, rate=RATE, device="cpu")
    assert loop.numbers(entry.cause, "scale").tolist() == [0.7]
    (expected,) = replay([rows], model, time_step=5e-4)
    command = torch.tensor(rows.command[:, None], dtype=torch.float32)
    loop.reset(command[0])
    for k in range(1, ROWS):
        seen = loop.step(command[k - 1]).motor_position.numpy()[0].copy()
        # 2e-3 rad: a loop reads before the next command, in single precision and longer steps
        assert seen == pytest.approx(expected.motor_position[k], abs=2e-3), k
