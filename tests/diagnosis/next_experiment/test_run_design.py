"""The next run is designed: its command, what it is expected to tell, and its limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_newton.data.excitations import LARGEST_COMMAND
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.by_hand import best_by_hand
from tendon_newton.diagnosis.next_experiment.designed_command import (
    NUMBERS,
    SEGMENTS,
    DesignedCommand,
)
from tendon_newton.diagnosis.next_experiment.expected_run import Forecast, shrinks
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets, play
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan, library_plans, plan_run
from tendon_newton.diagnosis.next_experiment.run_design import SEED, design, usual_task
from tendon_newton.diagnosis.next_experiment.worst_case import DRAWS, WorstCase, within_limit
from tendon_newton.diagnosis.posterior import Coordinate, FittedSet, OpenNumber, Posterior
from tendon_newton.effects import find_effect
from tendon_newton.identification.noise_floor import NoiseFloor
from tests.made import stated_model

TIME = np.arange(960) / 80.0
MODEL = stated_model("ideal", {"gain": 4.2, "spool_radius": 0.0125})


@given(st.integers(0, 2**32 - 1))
def test_every_command_stays_inside_the_servos_range(seed: int) -> None:
    """Drawn or varied, at the rate of a bench: four rows hold each command."""
    rng = np.random.default_rng(seed)
    drawn = DesignedCommand.draw(rng)
    for command in (drawn, drawn.moved(rng, 0.4, 0.3)):
        angles = command.at(TIME)
        assert angles.min() >= 0.0
        assert angles.max() <= LARGEST_COMMAND
        assert (angles.reshape(-1, 4) == angles[::4, None]).all()


def test_a_command_moves_at_its_speed_and_holds_there() -> None:
    """To half the range at 0.3 rad/s: one ramp goes on through eight equal segments."""
    numbers = np.full((SEGMENTS, NUMBERS), 0.5)
    numbers[:, 1] = 0.0
    numbers[:, 3] = 0.0
    slow = DesignedCommand(numbers=numbers).at(TIME)
    np.testing.assert_allclose(slow[::4], np.minimum(0.3 * TIME[::4], np.pi), atol=1e-9)
    numbers[:, 1] = 1.0
    fast = DesignedCommand(numbers=numbers).at(TIME)
    np.testing.assert_allclose(fast[8:], LARGEST_COMMAND / 2.0)


def open_sets(spread: float = 0.1, *causes: tuple[str, float]) -> OpenSets:
    """Sets of one cause each, equally likely: a tilt and an offset, alike on a weak spring.

    Args:
        spread: Half of the numbers' intervals, as a share of their values [1].
    """
    sets: list[FittedSet] = []
    for cause, value in causes or (("gravity_misalignment", 0.3), ("position_offset", 0.3)):
        (parameter,) = find_effect(cause).parameters
        scale = Coordinate(
            kind="linear", origin=0.0, unit=1.0, lower=parameter.lower, upper=parameter.upper
        )
        number = OpenNumber(owner=cause, name=parameter.name, coordinate=scale, place=value)
        covariance = np.array([[(spread * value / 1.96) ** 2]])
        sets.append(
            FittedSet(weight=0.5, causes=(cause,), numbers=(number,), covariance=covariance)
        )
    return OpenSets(
        posterior=Posterior(sets=tuple(sets)),
        model=MODEL,
        noise=NoiseFloor(theta=0.00044, force=0.05),
    )


def task(bench: str = "finger") -> Plan:
    """A run to predict."""
    return usual_task(Setting(bench=bench), 4.0)


def test_a_run_as_informative_as_all_data_brings_half_a_bit() -> None:
    """Twice the information shrinks an interval by the root of two, whatever the rows are worth."""
    run = plan_run(Setting(bench="finger"), "random_steps", 0, 4.0)
    question = open_sets(0.1, ("gravity_misalignment", 0.3))
    (played,) = play(question, [run])
    (known,) = question.posterior.sets[0].covariance.ravel()
    worth = 1.0 / (known * played.slopes[0][0].item())
    (again,) = Forecast(question, task(), worth).runs([run])
    assert again.told.numbers == pytest.approx({"gravity_misalignment.angle": 0.5}, abs=0.02)
    assert 0.0 < again.told.task < 0.5  # at most, and less where some spread matters to nobody


def test_a_number_that_is_certain_already_learns_nothing() -> None:
    """Its variance stays zero, and zero over zero is no gain."""
    with np.errstate(all="raise"):
        assert shrinks(np.array([0.0, 4.0]), np.array([0.0, 1.0])).tolist() == [1.0, 4.0]


def test_a_run_tells_names_apart_where_no_set_can_imitate_another() -> None:
    """On a spring a tilt is like an offset; a finger tells one from the other, which is a bit."""
    alike = open_sets(0.1, ("gravity_misalignment", 0.08), ("position_offset", 0.013))
    forecast = Forecast(alike, task(), 1.0e-2)
    assert forecast.entropy == pytest.approx(1.0)
    plans = [plan_run(Setting(bench=b), "ramps", 0, 4.0) for b in ("finger", "spring_weak")]
    told = {e.plan.setting.bench: e.told.names for e in forecast.runs(plans)}
    assert told["finger"] > 0.8
    assert told["spring_weak"] < 0.05


def test_a_caliper_settles_whether_the_spool_is_wrong() -> None:
    """A spool a twentieth too large against a load cell: a bit of names, for two minutes."""
    question = open_sets(0.1, ("spool_radius_error", 1.05), ("load_cell_gain", 1.05))
    worth = best_by_hand(Forecast(question, task(), 1.0e-2))
    assert worth.number == "spool_radius_error.scale"
    assert worth.told.names > 0.5  # of one
    assert worth.rate == pytest.approx(0.5 * (worth.told.names + worth.told.task))
    assert worth.text().startswith("measure the spool with a caliper (2 min): 1.0 bits about names")
    tilted = open_sets(0.1, ("gravity_misalignment", 0.3))
    assert best_by_hand(Forecast(tilted, task(), 1.0e-2)) is None
    known = open_sets(1e-4, ("spool_radius_error", 1.05))
    assert best_by_hand(Forecast(known, task(), 1.0e-2)) is None, "0.0 bits are no advice"


@pytest.mark.slow
def test_designed_commands_beat_the_library_and_keep_the_limit() -> None:
    """The search never ends below where it began, and no run pulls beyond what it may."""
    forecast, settings = Forecast(open_sets(), task(), 1.0e-2), [Setting(bench="finger")]
    rng = np.random.default_rng(0)
    found = design(forecast, settings, rng, duration=4.0, force_limit=12.0).runs
    worst = WorstCase(open_sets(), np.random.default_rng(0))
    library = forecast.runs(library_plans(settings, (SEED,), 4.0))
    best = within_limit(library, worst, 12.0).runs
    assert found[0].told.worth >= max(e.told.worth for e in best) > 0.0
    assert all(e.peak_force is not None and e.peak_force < 12.0 for e in found)


def test_no_run_comes_back_whose_worst_case_was_not_looked_at() -> None:
    """A limit between the middle model and the worst one drawn: the calm half is searched on.

    Few runs are looked at together. Where the best of a bench are refused, the next are looked at,
    and what comes back has a largest tension of the worst case and not only of the middle.
    """
    uncertain = open_sets(spread=0.9)
    settings = [Setting(bench="finger"), Setting(bench="spring_weak")]
    plans = [plan_run(s, "random_steps", seed, 4.0) for s in settings for seed in range(12)]
    found = Forecast(uncertain, task(), 1.0e-2).runs(plans)
    middle = [e.peak_force for e in found if e.peak_force is not None]
    limit = float(np.median(middle))
    designs = within_limit(found, WorstCase(uncertain, np.random.default_rng(0)), limit)
    anew = WorstCase(uncertain, np.random.default_rng(1))
    again = anew.drawn([e.plan for e in designs.runs], DRAWS)
    assert designs.runs
    assert designs.refused
    by_command = {e.plan.command.tobytes(): e.peak_force for e in found}
    for run, other in zip(designs.runs, again, strict=True):
        assert run.peak_force != by_command[run.plan.command.tobytes()]
        assert run.peak_force is not None
        assert run.peak_force < limit
        assert other < limit  # of other draws


def test_an_unlikely_set_is_drawn_for_the_limit_too() -> None:
    """A cell that reads twice as much is as hard a pull as a likely one."""
    question = open_sets(0.1, ("gravity_misalignment", 0.0), ("load_cell_gain", 2.0))
    likely, unlikely = question.posterior.sets
    rare = Posterior(sets=(replace(likely, weight=0.99), replace(unlikely, weight=0.01)))
    plans = [plan_run(Setting(bench="finger"), "random_steps", 0, 4.0)]
    alone, together = (
        WorstCase(replace(question, posterior=own), np.random.default_rng(0)).drawn(plans, 8)[0]
        for own in (Posterior(sets=(likely,)), rare)
    )
    assert together > 1.8 * alone


def test_a_string_that_hardly_stretches_pulls_no_harder_than_its_servo() -> None:
    """35 MN/m behind a rotor and guides: a step of 0.5 ms winds as much as 300 N stretch."""
    volts = {"duty_per_rad": 0.08, "max_duty": 0.73, "supply_voltage": 8.9}
    servo = {"torque_constant": 1.56, "resistance": 15.7, "armature": 0.002}
    guides = NamedValues(name="routing_friction", values={"exponent": 0.063})
    lag = NamedValues(name="actuator_lag", values={"time_constant": 0.054})
    model = Model(
        actuator=NamedValues(name="pwm_servo", values={**volts, **servo, "spool_radius": 0.0125}),
        effects=(guides, lag),
    )
    scale = Coordinate(kind="inverse", origin=1.0e4, unit=1.0, lower=0.0, upper=20.0)
    stiff = OpenNumber(owner="tendon_compliance", name="stiffness", coordinate=scale, place=3e-4)
    own = FittedSet(
        weight=1.0, causes=("tendon_compliance",), numbers=(stiff,), covariance=np.array([[1e-12]])
    )
    question = replace(open_sets(), posterior=Posterior(sets=(own,)), model=model)
    time = TIME[:720]
    rng = np.random.default_rng(0)
    plans = [
        Plan(
            setting=Setting(bench="spring_weak"),
            excitation="designed",
            time=time,
            command=DesignedCommand.draw(rng).at(time),
        )
        for _ in range(12)
    ]
    worst = WorstCase(question, np.random.default_rng(0)).drawn(plans, 1)
    assert worst.max() < 0.73 * 8.9 * 1.56 / 15.7 / 0.0125  # what it gives at standstill
