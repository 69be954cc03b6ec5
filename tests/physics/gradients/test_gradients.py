"""Gradients against central differences: right to 1e-3, and not silently zero."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.model_file import NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.effects import find_effect
from tendon_newton.gradients import substep_chain
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.gradients.taped_run import Adjoint
from tendon_newton.mechanisms.loading import load_mechanism
from tests.conftest import SEED
from tests.physics.runs import RADIUS, ROWS, held_run, ideal_model, run_of, stairs

EFFECTS = {
    "command_delay": {"delay": 0.0312},
    "position_offset": {"angle": 0.05},
    "gain_error": {"scale": 1.1},
    "viscous_friction": {"coefficient": 0.3},
    "coulomb_friction": {"force": 0.7},
    "load_dependent_friction": {"coefficient": 0.1},
    "joint_stiffness_error": {"scale": 1.1},
}
MORE_EFFECTS = {
    "gain_drift": {"rate": 0.05},
    "actuator_lag": {"time_constant": 0.02},
    "stribeck_friction": {"coulomb_force": 0.3, "static_force": 0.5, "stribeck_velocity": 1.0},
    "tendon_compliance": {"stiffness": 4000.0},
    "routing_friction": {"exponent": 0.1},
    "spool_radius_error": {"scale": 1.05},
    "joint_damping_error": {"scale": 1.3},
    "inertia_error": {"scale": 1.2},
    "joint_dry_friction": {"fraction": 0.02},
    "spring_stiffening": {"beta": 0.2},
    "viscoelastic_spring": {"stiffness_ratio": 0.3, "relaxation_time": 0.1},
    "obstruction": {"position": 1.0, "stiffness": 500.0},
    "gravity_misalignment": {"angle": 0.1},
    "load_cell_bias": {"offset": 0.2},
    "load_cell_gain": {"scale": 1.1},
    "load_cell_drift": {"rate": 0.05},
}
TIRING = {
    "viscous_friction": {"coefficient": 0.3},
    "torque_fade": {"fade": 0.01, "time_constant": 0.5},
    "speed_limit": {"limit": 3.0},
}
GEAR = {
    "viscous_friction": {"coefficient": 0.3},
    "gear_load_friction": {"coefficient": 0.05},
    "load_stribeck_friction": {
        "coefficient": 0.04,
        "static_coefficient": 0.06,
        "stribeck_velocity": 2.0,
    },
}
SERVO = {
    "duty_per_rad": 1.1, "max_duty": 0.9, "supply_voltage": 5.0, "torque_constant": 0.4,
    "resistance": 3.0, "armature": 0.002,
}  # fmt: skip
STRINGS = (
    {"load_dependent_friction": {"coefficient": 0.1}},
    {"tendon_compliance": {"stiffness": 8.0e3}, "tendon_slack": {"length": 1.0e-3}},
)
FRICTION = (1.0e-3, 5.0e-4)  # N m, at the joints
DURATION = 1.0  # s
SHORT = 0.4  # s, with stick, slip and stops: long enough where two ways of one walk are compared
NUDGE = 1.0e-7
"""Relative step of the difference. float64 leaves 1e-7 of the result; a longer step meets a row's
stop or start now and then,
where the loss has a kink."""
MECHANISM = {
    "stiffness": 0.03, "damping": 3e-4, "friction": 1e-3, "mass": 0.01, "arms": 0.005,
    "spool_radius": 0.0125,
}  # fmt: skip
"""Numbers of the bench and their size, in their units."""


def two_runs(rows: int) -> list[Recording]:
    """Return two runs of a finger, one from rest and one in motion."""
    rng = np.random.default_rng(SEED)
    return [
        run_of(stairs(rng, rows, 1.0, 5.0, 20)),
        run_of(stairs(rng, rows, 1.0, 4.0, 33), start="first_row", angle=0.6, speed=0.5),
    ]


def make_rollout(
    effects: dict[str, dict[str, float]],
    *,
    duration: float = DURATION,
    at_once: bool = False,
    segments: int = 1,
) -> DifferentiableRollout:
    """Return `two_runs` [s] of a finger with friction in the tendon and in its joints."""
    rollout = DifferentiableRollout(
        load_mechanism("finger"),
        two_runs(int(duration * ROWS) + 1),
        ideal_model(**effects),
        adjoint=Adjoint(at_once=at_once, segments=segments),
        device="cpu",
    )
    rollout.inputs.mechanism.friction.assign(np.tile(FRICTION, (2, 1)))
    return rollout


def random_seeds(rollout: DifferentiableRollout) -> dict[str, Array]:
    """Return a random loss by angle and force, each in units of its usual size."""
    rng = np.random.default_rng(SEED)
    readings = rollout.forward()
    shape = readings.force.numpy().shape
    return {"motor_position": rng.normal(size=shape), "force": 0.1 * rng.normal(size=shape)}


def loss_of(rollout: DifferentiableRollout, seeds: dict[str, Array]) -> float:
    """Return the loss of a fresh simulation."""
    readings = rollout.forward()
    return sum(float(np.sum(getattr(readings, name).numpy() * s)) for name, s in seeds.items())


def difference(
    array: object, place: tuple[int, ...], size: float, loss: Callable[[], float]
) -> float:
    """Return the central difference of a loss by one number of a Warp array."""
    values = array.numpy().copy()
    sides = []
    for sign in (1.0, -1.0):
        moved = values.copy()
        moved[place] += sign * NUDGE * size
        array.assign(moved)
        sides.append(loss())
    array.assign(values)
    return (sides[0] - sides[1]) / (2.0 * NUDGE * size)


Places = tuple[tuple[int, ...], ...]


def check_numbers(
    rollout: DifferentiableRollout, numbers: dict[str, Places], sizes: dict[str, float]
) -> None:
    """Compare the gradients by numbers of the bench, at some places of their arrays."""
    seeds = random_seeds(rollout)
    rollout.backward(**seeds)
    mechanism = rollout.inputs.mechanism
    taped = {name: getattr(mechanism, name).grad.numpy().copy() for name in numbers}
    wrong = []
    for name, places in numbers.items():
        for place in places:
            found = float(taped[name][place])
            expected = difference(
                getattr(mechanism, name), place, sizes[name], lambda: loss_of(rollout, seeds)
            )
            if expected == 0.0 or found != pytest.approx(expected, rel=1e-3):
                wrong.append(f"{name}{place}: tape {found:.6g}, difference {expected:.6g}")
    assert not wrong, "; ".join(wrong)


def check_gain_and_commands(rollout: DifferentiableRollout, places: Places) -> None:
    """Compare the gradients by each world's gain, and by its commands by row and servo."""
    seeds = random_seeds(rollout)
    inputs = rollout.backward(**seeds)
    gain = rollout.gradient("ideal", "gain").copy()
    command = inputs.command.grad.numpy().copy()
    for world in range(len(gain)):
        expected = difference(inputs.parameters, (world, 0), 4.2, lambda: loss_of(rollout, seeds))
        assert gain[world] == pytest.approx(expected, rel=1e-3)
        for row, servo in places:
            place = (rollout.rows_of(world).start + row, servo)
            expected = difference(inputs.command, place, 1.0, lambda: loss_of(rollout, seeds))
            assert command[place] == pytest.approx(expected, rel=1e-3)


def check_gradients(rollout: DifferentiableRollout, names: tuple[str, ...]) -> None:
    """Compare the gradients by all parameters and by some numbers of the bench."""
    seeds = random_seeds(rollout)
    rollout.backward(**seeds)
    inputs = rollout.inputs
    taped = {"parameters": inputs.parameters.grad.numpy().copy()}
    taped |= {name: getattr(inputs.mechanism, name).grad.numpy().copy() for name in names}
    places = [
        ("parameters", (0, k), f"{owner}.{p.name}", max(abs(inputs.parameters.numpy()[0, k]), 1e-2))
        for k, (owner, p) in enumerate(rollout.table.owners)
        if p.needs in ("", *rollout.table.effects)
    ]
    for name in names:
        places += [
            (name, place, f"{name}{place}", MECHANISM[name])
            for place in np.ndindex(taped[name].shape)
            if place[0] == 0
        ]
    wrong = []
    for name, place, label, size in places:
        array = inputs.parameters if name == "parameters" else getattr(inputs.mechanism, name)
        expected = difference(array, place, size, lambda: loss_of(rollout, seeds))
        found = float(taped[name][place])
        if expected == 0.0 or found != pytest.approx(expected, rel=1e-3):
            wrong.append(f"{label}: tape {found:.6g}, difference {expected:.6g}")
    assert not wrong, "; ".join(wrong)


@pytest.fixture(scope="module")
def rollout() -> DifferentiableRollout:
    """Return the runs with gain and seven effects, which a nudge leaves as they were."""
    return make_rollout(EFFECTS)


def test_gradients_by_actuator_effects_and_bench(rollout: DifferentiableRollout) -> None:
    """Joint springs, damping, dry friction, masses, moment arms, spool.

    Gain and seven effects, through a second with stick and slip.
    """
    check_gradients(rollout, tuple(MECHANISM))


@pytest.mark.slow
@pytest.mark.parametrize("half", [0, 1])
def test_gradients_by_every_other_effect(half: int) -> None:
    """The rest of the catalogue in two kernels, beside viscous friction."""
    names = list(MORE_EFFECTS)[half::2]
    rest = {name: MORE_EFFECTS[name] for name in names}
    check_gradients(make_rollout({"viscous_friction": {"coefficient": 0.3}, **rest}), ())


@pytest.mark.slow
def test_gradients_by_a_motor_that_tires_at_its_greatest_speed() -> None:
    """What load has built up is carried from step to step, and so is its derivative.

    The greatest speed is reached both ways, held while the finger meets its stops, and left.
    """
    check_gradients(make_rollout(TIRING), ())


@pytest.mark.slow
def test_gradients_by_a_gear_under_load() -> None:
    """Both sides' load, sliding and breaking away, beside viscous friction.

    It falls so slowly with speed that the finger does not chatter, where differences mean nothing.
    """
    check_gradients(make_rollout(GEAR), ())


@pytest.mark.slow
@pytest.mark.parametrize("string", STRINGS, ids=["taut or slack", "elastic"])
def test_gradients_by_a_motor_with_a_rotor(string: dict[str, dict[str, float]]) -> None:
    """The rotor's inertia, and a spool that leads its finger or lags behind its slack string."""
    rng = np.random.default_rng(SEED)
    run = run_of(stairs(rng, int(DURATION * ROWS) + 1, -1.0, 5.0, 20))
    effects = {"viscous_friction": {"coefficient": 0.3}, **string}
    servo = NamedValues(name="pwm_servo", values={**SERVO, "spool_radius": RADIUS})
    model = replace(ideal_model(**effects), actuator=servo)
    check_gradients(DifferentiableRollout(load_mechanism("finger"), [run], model, device="cpu"), ())


def test_gradients_by_the_commands(rollout: DifferentiableRollout) -> None:
    """A command moves what follows it, and nothing before it."""
    seeds = random_seeds(rollout)
    found = rollout.backward(**seeds).command.grad.numpy().copy()
    rows = (0, 25, 60, 81, 110)
    expected = [
        difference(rollout.inputs.command, (row, 0), 1.0, lambda: loss_of(rollout, seeds))
        for row in rows
    ]
    assert found[list(rows), 0] == pytest.approx(expected, rel=1e-3)
    last = rollout.rows_of(0).stop - 1
    only_early = {"motor_position": np.zeros_like(seeds["motor_position"])}
    only_early["motor_position"][rollout.rows_of(0).start + 5] = 1.0
    assert rollout.backward(**only_early).command.grad.numpy()[last, 0] == 0.0


@pytest.mark.parametrize("travel", [0.0, 2.0e-4])
def test_gradients_of_a_run_that_friction_holds_where_it_begins(travel: float) -> None:
    """No equilibrium moves with the gain there: the log says where it starts.

    Where bristles bend they are bent by what holds the servo.
    """
    model = ideal_model(**EFFECTS, presliding={"travel": travel})
    run = held_run(model, "finger")
    rollout = DifferentiableRollout(load_mechanism("finger"), [run], model, device="cpu")
    check_gain_and_commands(rollout, ((60, 0), (140, 0)))
    first = {name: np.zeros_like(s) for name, s in random_seeds(rollout).items()}
    first["motor_position"][0] = 1.0
    rollout.backward(**first)
    assert rollout.gradient("ideal", "gain")[0] == pytest.approx(0.0, abs=1e-6)


def test_a_delay_of_zero_has_the_derivative_of_a_small_delay() -> None:
    """At its null value, where edges fall on the substeps' own instants.

    The delay's gradient is one-sided, not zero.
    """
    nulls = {name: {p.name: p.null for p in find_effect(name).parameters} for name in EFFECTS}
    rollout = make_rollout(nulls)  # the kernels of the other tests, and none of their effects
    # not the force: its reading in the row of a jump is that before the jump as soon as there is
    # a delay
    seeds = {"motor_position": random_seeds(rollout)["motor_position"]}
    rollout.backward(**seeds)
    found = rollout.gradient("command_delay", "delay")[0]
    parameters = rollout.inputs.parameters
    values = parameters.numpy().copy()
    before = loss_of(rollout, seeds)
    moved = values.copy()
    moved[0, rollout.table.column("command_delay", "delay")] = 1.0e-7
    parameters.assign(moved)
    assert found == pytest.approx((loss_of(rollout, seeds) - before) / 1.0e-7, rel=1e-3)


def repeated(rollout: DifferentiableRollout, count: int) -> list[list[Array]]:
    """Return the gradients by all that went in, as often as a run is repeated."""
    seeds, found = random_seeds(rollout), []
    for _ in range(count):
        inputs = rollout.backward(**seeds)
        arrays = [inputs.parameters, inputs.command]
        arrays += [getattr(inputs.mechanism, name) for name in rollout.bench_names]
        found.append([array.grad.numpy().copy() for array in arrays])
    return found


def all_gradients(rollout: DifferentiableRollout) -> list[Array]:
    """Return the second gradients, from a captured run, by all that went in."""
    return repeated(rollout, 2)[1]


@pytest.fixture(scope="module")
def thrice() -> list[list[Array]]:
    """Return the gradients of a short run and of two repetitions."""
    return repeated(make_rollout(EFFECTS, duration=SHORT), 3)


def test_repeated_gradients_are_the_same(thrice: list[list[Array]]) -> None:
    """The first run launches one by one, the later ones are graphs.

    Nothing is left over from run to run.
    """
    for first, second, third in zip(*thrice, strict=True):
        assert np.array_equal(first, second)
        assert np.array_equal(first, third)


@pytest.fixture(scope="module")
def tiring() -> tuple[DifferentiableRollout, list[Array]]:
    """Return a short run with effects that remember, and its gradients."""
    rollout = make_rollout(TIRING, duration=SHORT)
    return rollout, all_gradients(rollout)


def test_many_substeps_at_once_give_the_same(tiring, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a GPU does: slopes of many substeps, a sweep along them, what they add up to.

    In three parts of the run, with effects that remember, to the rounding of another order.
    """
    monkeypatch.setattr(substep_chain, "TOGETHER", 2 * 280)
    at_once = all_gradients(make_rollout(TIRING, duration=SHORT, at_once=True))
    for one_by_one, together in zip(tiring[1], at_once, strict=True):
        assert together == pytest.approx(one_by_one, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("at_once", [False, True])
def test_a_run_in_segments_gives_the_same(tiring, at_once: bool) -> None:
    """Only a seventh of the states is kept; the others are simulated again, to the same bits."""
    whole, gradients = tiring
    parts = make_rollout(TIRING, duration=SHORT, at_once=at_once, segments=7)
    for kept, again in zip(gradients, all_gradients(parts), strict=True):
        assert again == pytest.approx(kept, rel=1e-9, abs=1e-9)
    for name in ("joint_position", "motor_position", "force"):
        readings = [getattr(rollout.readings, name).numpy() for rollout in (whole, parts)]
        assert np.array_equal(*readings)


def test_more_divided_substeps_than_there_was_room_for(thrice, monkeypatch) -> None:
    """The list of substeps that events divide grows with them, also after a run was captured."""
    monkeypatch.setattr(substep_chain, "LEAST_ROOM", 1)
    rollout = make_rollout(EFFECTS, duration=SHORT)
    friction = rollout.inputs.mechanism.friction
    friction.zero_()
    all_gradients(rollout)
    friction.assign(np.tile(FRICTION, (2, 1)))
    for roomy, grown in zip(thrice[1], all_gradients(rollout), strict=True):
        assert grown == pytest.approx(roomy, rel=1e-9, abs=1e-9)
