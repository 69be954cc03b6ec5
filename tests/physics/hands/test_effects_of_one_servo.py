"""An effect of one servo acts there as that of all does, and nowhere else."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import torch

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import BenchOverrides, Recording
from tendon_newton.data.servo_names import name_of
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.model_numbers import refuse_damaged
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Candidates, Rollout, Stepping, Trajectory
from tendon_newton.simulation.model.bench_numbers import BenchNumber
from tests.made import recorded
from tests.physics.runs import ASLEEP

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
OVERLOAD = {"overload_cut": {"duty": 0.1, "fraction": 0.01, "time": 0.1}}
OF_MOTOR = {"tendon_compliance": {"stiffness": 4e3}, "speed_limit": {"limit": 0.5}}


def recording(bench: str = "finger_antagonist") -> Recording:
    """Return commands of every servo, each in its own time."""
    time = np.arange(ROWS) / RATE
    tendons = range(len(load_mechanism(bench).tendons))
    command = np.stack([1.6 + np.sin(7.0 * time + 2.0 * d) for d in tendons], axis=1)
    blank = np.zeros_like(command)
    return recorded(time, blank, bench=bench, command=command, force=blank)


def effect(name: str, servo: int | None = None, **values: float) -> NamedValues:
    """Return an effect of one servo or of all."""
    return NamedValues(name=name, servo=servo, values=values)


def rollout_of(
    log: Recording, actuator: NamedValues, causes: Iterable[str], time_step: float = 1e-3
) -> Rollout:
    """Return a finger between two strings, with effects of all servos and of each."""
    names = [*causes, *(name_of(name, d) for name, d in product(causes, (0, 1)))]
    return Rollout(
        load_mechanism("finger_antagonist"), [log], Model(actuator=actuator),
        candidates=Candidates(effects=names, shared=list(causes)),
        stepping=Stepping(time_step=time_step), device="cpu",
    )  # fmt: skip


def run(*effects: NamedValues, log: Recording | None = None, time_step: float = 1e-3) -> Trajectory:
    """Simulate some effects in the kernel that holds all causes."""
    rollout = rollout_of(log or recording(), IDEAL, {**CAUSES, **OVERLOAD}, time_step)
    model = Model(actuator=IDEAL, effects=effects)
    return rollout.run(rollout.base_vectors(model)[None])[0][0]


@pytest.mark.parametrize(
    ("actuator", "causes"),
    [(IDEAL, {**CAUSES, **OVERLOAD}), (MOTOR, OF_MOTOR)],
    ids=["source", "motor"],
)
def test_the_same_at_each_servo_is_the_same_at_all(actuator, causes) -> None:
    """To the last bit; and one servo's alone is neither that nor nothing."""
    rollout = rollout_of(recording(), actuator, causes)
    models = [Model(actuator=actuator)]
    for name, values in causes.items():
        both, *own = (effect(name, servo, **values) for servo in (None, 0, 1))
        models += [
            Model(actuator=actuator, effects=chosen)
            for chosen in ((both,), tuple(own), (own[0],), (own[1],))
        ]
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


def test_an_overload_of_the_second_servo_is_cut_inside_a_step() -> None:
    """Its own time divides a step, not that of the first: so steps of 2 ms err by 1 mrad."""
    jump = np.where(np.arange(ROWS) < 10, 0.5, 2.5)
    log = replace(recording(), command=np.stack([np.full(ROWS, 0.5), jump], axis=1))
    cut = [
        effect("overload_cut", d, duty=0.3, fraction=0.01, time=time)
        for d, time in enumerate((0.9, 0.5013))
    ]
    coarse, fine = (run(*cut, log=log, time_step=h).motor_position[48:] for h in (2e-3, 1e-4))
    np.testing.assert_allclose(coarse, fine, atol=1e-3)
    assert fine[0, 1] - fine[5, 1] > 0.2  # it is let go


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


OF_FINGER = {
    # one of each way in which an effect reaches the joints, beside those of a servo
    "joint_stiffness_error": {"scale": 1.4},
    "joint_dry_friction": {"fraction": 0.2},
    "viscoelastic_spring": {"stiffness_ratio": 0.5, "relaxation_time": 0.3},
    "inertia_error": {"scale": 3.0},
}


def test_an_effect_of_one_finger_of_a_hand_is_that_of_such_a_finger_alone() -> None:
    """To the asset's float32; the other fingers move as without it, to the last bit."""
    causes = {"gain_error": CAUSES["gain_error"], **OF_FINGER}
    names = [*causes, *(name_of(name, d) for name, d in product(causes, range(4)))]
    whole = recording("hand")
    hand = Rollout(
        load_mechanism("hand"), [whole], Model(actuator=IDEAL),
        candidates=Candidates(effects=names, shared=list(causes)), device="cpu",
    )  # fmt: skip
    assert hand.kernels.structure.joint_count == 3
    finger = Rollout(
        load_mechanism("finger_routed"),
        [one_servo(whole, d) for d in range(4)],
        Model(actuator=IDEAL), candidates=Candidates(effects=list(causes)), device="cpu",
    )  # fmt: skip
    assert finger.kernels.structure == hand.kernels.structure
    sets: list[tuple[NamedValues, ...]] = [()]
    for name, values in causes.items():
        sets += [(effect(name, **values),), (effect(name, 2, **values),)]
    models = [Model(actuator=IDEAL, effects=own) for own in sets]
    together = hand.run(np.stack([hand.base_vectors(model) for model in models]))
    alone = finger.run(np.stack([finger.base_vectors(model) for model in models[1::2]]))
    none = together[0][0]
    for place, name in enumerate(causes):
        all_, third = (together[n][0] for n in (1 + 2 * place, 2 + 2 * place))
        for d in range(4):
            expected = alone[place][d]
            for signal, near in (("motor_position", 2e-4), ("force", 1e-3)):
                seen = getattr(all_, signal)[:, d]
                assert seen == pytest.approx(getattr(expected, signal)[:, 0], abs=near), name
                here = all_ if d == 2 else none
                assert np.array_equal(getattr(third, signal)[:, d], getattr(here, signal)[:, d])
        assert not np.array_equal(third.motor_position, none.motor_position), name


def one_servo(whole: Recording, d: int) -> Recording:
    """Return what one finger of a hand does, as a recording of a finger."""
    signals = {name: getattr(whole, name)[:, d : d + 1]
               for name in ("command", "motor_position", "motor_velocity", "force")}  # fmt: skip
    return replace(whole, bench="finger_routed", **signals)


def test_numbers_of_a_hands_joints_may_differ_in_one_finger() -> None:
    """A mass that a candidate replaces is that finger's, and no other feels it."""
    numbers = [
        BenchNumber(bench="hand", key="mass", joint=j, value=0.01, name=f"mass_{j}")
        for j in range(12)
    ]
    rollout = Rollout(
        load_mechanism("hand"), [recording("hand")], Model(actuator=IDEAL),
        candidates=Candidates(unknown=numbers), device="cpu",
    )  # fmt: skip
    base = rollout.base_vectors(Model(actuator=IDEAL))
    heavy = base.copy()
    heavy[:, rollout.table.column("bench", "mass_7")] = 0.02
    plain, moved, both = rollout.run(np.stack([base, heavy, heavy]))
    assert np.array_equal(moved[0].force, both[0].force)
    same = (plain[0].joint_position == moved[0].joint_position).all(axis=0)
    assert same.reshape(4, 3).all(axis=1).tolist() == [True, True, False, True]
    stated = replace(
        recording("hand"), bench_overrides=BenchOverrides(mass=(*[0.01] * 7, 0.02, *[0.01] * 4))
    )
    (expected,) = replay([stated], Model(actuator=IDEAL))
    assert moved[0].joint_position == pytest.approx(expected.joint_position, abs=1e-5)


def test_the_base_and_the_clock_of_a_hand_are_no_fingers() -> None:
    """A tilt and a wrong period have no owner, and a hand has no fifth servo."""
    for entry, words in (
        (effect("gravity_misalignment", 1, angle=0.1), "is not about a servo"),
        (effect("sample_period_error", 1, scale=1.1), "is not about a servo"),
        (effect("joint_dry_friction", 4, fraction=0.1), "0 to 3; it is 4"),
    ):
        with pytest.raises(InvalidModelFile, match=words):
            replay([recording("hand")], Model(actuator=IDEAL, effects=(entry,)))


def test_gradients_refuse_an_effect_of_one_finger() -> None:
    """One line says which effect and why, before a whole hand would be compiled for hours."""
    model = Model(actuator=IDEAL, effects=(effect("joint_dry_friction", 1, fraction=0.2),))
    with pytest.raises(InvalidModelFile, match=r"joint_dry_friction is of one of 4 fingers"):
        DifferentiableRollout(load_mechanism("hand"), [recording("hand")], model, device="cpu")


def test_a_control_loop_holds_effects_of_one_finger() -> None:
    """Its rows are those of a rollout, and its numbers stand by finger."""
    own = (effect("gain_error", 1, scale=0.7), effect("joint_stiffness_error", 3, scale=1.4))
    asleep = tuple(effect(name, **values) for name, values in ASLEEP.items())
    model = Model(actuator=IDEAL, effects=(*asleep, *own))
    loop = ControlLoop(load_mechanism("hand"), model, 2, rate=RATE, device="cpu")
    assert loop.numbers("gain_error", "scale").tolist() == 2 * [[1.0, 0.7, 1.0, 1.0]]
    assert loop.numbers("joint_stiffness_error", "scale").tolist() == 2 * [[1.0, 1.0, 1.0, 1.4]]
    require_rows_of_a_rollout(loop, recording("hand"), model)


def require_rows_of_a_rollout(loop: ControlLoop, rows: Recording, model: Model) -> None:
    """Give all worlds of a loop the same commands, and look at the last."""
    assert rows.command is not None
    (expected,) = replay([rows], model, time_step=5e-4)
    command = torch.tensor(np.stack(loop.world_count * [rows.command], axis=1), dtype=torch.float32)
    loop.reset(command[0])
    for k in range(1, ROWS):
        seen = loop.step(command[k - 1]).motor_position.numpy()[-1].copy()
        # 2e-3 rad: a loop reads before the next command, in single precision and longer steps
        assert seen == pytest.approx(expected.motor_position[k], abs=2e-3), k


def test_an_export_refuses_effects_of_one_servo() -> None:
    """What it cannot hold is not left out silently."""
    model = Model(actuator=IDEAL, effects=(effect("gain_error", 1, scale=0.8),))
    with pytest.raises(InvalidModelFile, match="'gain_error' is of servo 1 alone"):
        refuse_damaged(model)


def test_a_control_loop_holds_effects_of_one_servo() -> None:
    """Its rows are those of a rollout, and its numbers by world are the servo's."""
    entry = effect("gain_error", 1, scale=0.7)
    model = Model(actuator=IDEAL, effects=(entry,))
    loop = ControlLoop(load_mechanism("finger_antagonist"), model, 1, rate=RATE, device="cpu")
    assert loop.numbers(entry.cause, "scale").tolist() == [0.7]
    require_rows_of_a_rollout(loop, recording(), model)
