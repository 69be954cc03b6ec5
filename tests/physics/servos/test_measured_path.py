"""A shaft led along a measured path under a load: its torque and the joint follow from the laws."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_file import write_csv
from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Forecast
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets
from tendon_newton.diagnosis.next_experiment.planned_runs import plan_run
from tendon_newton.diagnosis.posterior import Posterior
from tendon_newton.diagnosis.search.fixed_set import fit_set
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile, InvalidParameter, InvalidRecording
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.study import Study
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.measured_motion import led_timeline
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tests.made import stated_model
from tests.physics.runs import RADIUS, led

LOAD = 5.0  # [N]
TRIANGLE = 3.0 * np.abs(np.linspace(-1.0, 1.0, 401))  # [rad]: out, then in
TRAVEL = 1.0e-3  # [rad]


Numbers = dict[str, dict[str, float]]  # Effect -> parameter -> value


def model_of(effects: Numbers, fit: tuple[str, ...] = (), twist: float = 0.0) -> Model:
    """A measured path with some effects."""
    return stated_model("measured_path", {"travel": TRAVEL, "twist": twist}, effects, fit=fit)


def run(model: Model, path: np.ndarray = TRIANGLE, load: float = LOAD) -> Recording:
    """What the slider with the weak spring logs."""
    recording = led(path, np.full(len(path), -load))
    return simulated_recording(recording, replay([recording], model)[0])


def spring(q: np.ndarray) -> np.ndarray:
    """The force of the slider's spring [N]."""
    joint = load_mechanism("spring_weak").joints[0]
    return joint.stiffness * (q - joint.rest)


def test_without_friction_the_shaft_feels_load_and_spring() -> None:
    """F = load + k q and q = r theta, whichever way the shaft turns (float32 assets: 1e-5)."""
    found = run(model_of({}))
    q = RADIUS * TRIANGLE
    assert found.joint_position[:, 0] == pytest.approx(q, abs=1e-6)
    assert found.force[:, 0] == pytest.approx(LOAD + spring(q), rel=1e-5)


def test_friction_takes_its_part_on_both_sides_of_the_string() -> None:
    """Winding, the guides leave T exp(-mu), and the shaft asks for T (1 + c) + F_C besides."""
    frictions = {
        "coulomb_friction": {"force": 1.5},
        "load_dependent_friction": {"coefficient": 0.2},
        "routing_friction": {"exponent": 0.3},
    }
    found = run(model_of(frictions))
    needed = LOAD + spring(RADIUS * TRIANGLE)
    for rows, side in ((slice(50, 195), -1.0), (slice(250, 400), 1.0)):
        tension = needed[rows] * np.exp(0.3 * side)
        expected = tension * (1.0 + 0.2 * side) + 1.5 * side
        assert found.force[rows, 0] == pytest.approx(expected, rel=1e-4)


def test_a_string_that_stretches_lets_the_shaft_turn_while_the_joint_sticks() -> None:
    """After a reversal the joint waits until the tension has changed by both frictions over k."""
    found = run(
        model_of(
            {"tendon_compliance": {"stiffness": 5000.0}, "joint_dry_friction": {"fraction": 0.2}},
            twist=1.0e-4,
        )
    )
    joint = load_mechanism("spring_weak").joints[0]
    friction = 0.2 * joint.stiffness * (joint.limits[1] - joint.rest)
    still = found.joint_position[200:, 0] < found.joint_position[200, 0] + 1e-7
    waits = (np.argmin(still) - 1) * RADIUS * np.ptp(TRIANGLE) / 200.0
    assert waits == pytest.approx(2.0 * friction / 5000.0, abs=RADIUS * np.ptp(TRIANGLE) / 200.0)
    q = found.joint_position[100, 0] + 1.0e-4 * LOAD  # the coupling's twist
    tension = LOAD + spring(q) - friction
    assert RADIUS * TRIANGLE[100] - q == pytest.approx(tension / 5000.0, rel=1e-4)


def test_a_fit_finds_what_led_a_shaft() -> None:
    """Six numbers at once from one path, each within 2 % where the signals have no noise."""
    truth = {
        "coulomb_friction": {"force": 1.0},
        "load_dependent_friction": {"coefficient": 0.15},
        "routing_friction": {"exponent": 0.25},
        "tendon_compliance": {"stiffness": 8000.0},
    }
    rng = np.random.default_rng(3)
    path = np.interp(np.arange(800), np.arange(0, 801, 40), rng.uniform(0.5, 4.0, 21))
    loads = [2.0, 8.0]
    data = [run(model_of(truth, twist=2.0e-4), path, load) for load in loads]
    start = {name: {key: 1.6 * x for key, x in values.items()} for name, values in truth.items()}
    study = Study(data, model_of(start, ("travel", "twist"), 1.0e-4), tuple(truth))
    worlds = SearchWorlds(study)
    found = fit_set(worlds, model_of(start, ("travel", "twist"), 1.0e-4), tuple(truth))
    values = values_of(worlds, found.columns, found.place)
    numbers = {study.table.owners[column]: value for column, value in values.items()}
    named = {(owner, p.name): value for (owner, p), value in numbers.items()}
    for name, parameters in truth.items():
        for key, value in parameters.items():
            assert named[name, key] == pytest.approx(value, rel=0.02)
    assert named["measured_path", "twist"] == pytest.approx(2.0e-4, rel=0.02)


def test_a_joint_that_is_led_may_rub_more_than_its_spring_gives() -> None:
    """Cables pull it both ways: a friction of 1.4 springs is fitted, and elsewhere ends at 0.8."""
    spring_at_end = 200.0 * 0.08  # [N] of the slider
    rng = np.random.default_rng(3)
    path = np.interp(np.arange(800), np.arange(0, 801, 40), rng.uniform(0.5, 4.0, 21))
    rubbing = model_of({"joint_dry_friction": {"fraction": 1.4}})
    data = [run(rubbing, path, load) for load in (2.0, 8.0)]
    assert data[0].force is not None
    assert np.ptp(data[0].force) > 2.0 * 1.4 * spring_at_end
    start = model_of({"joint_dry_friction": {"fraction": 0.7}})
    study = Study(data, start, ("joint_dry_friction",))
    found = fit_set(SearchWorlds(study), start, ("joint_dry_friction",))
    values = values_of(SearchWorlds(study), found.columns, found.place)
    (column,) = study.table.columns("joint_dry_friction")
    assert values[column] == pytest.approx(1.4, rel=0.02)
    assert EFFECTS["joint_dry_friction"].parameters[0].on(BenchScale()).upper == 0.8


def test_a_swing_asks_for_weight_inertia_and_damping() -> None:
    """A pendulum's shaft feels m g l sin q + m l2 q'' + c q', to what five rows tell of a path.

    A cubic through rows of 12.5 ms misses 0.03 % of a rate and 0.15 % of an acceleration at 1 Hz.
    """
    time = np.arange(401) / 80.0
    w = 2.0 * np.pi
    path = 0.5 + 0.8 * np.sin(w * time)
    mass, length, damping, tilt = 0.49, 0.3, 0.2, 0.1
    numbers = BenchOverrides(mass=(mass,), length=(length,), damping=(damping,))
    recording = replace(
        led(path, np.zeros(401), bench="pendulum"), joint_position=None, bench_overrides=numbers
    )
    model = model_of({"gravity_misalignment": {"angle": tilt}})
    found = simulated_recording(recording, replay([recording], model)[0])
    weight = mass * 9.81 * length * np.sin(path + tilt)
    inertia = -mass * length**2 * w**2 * 0.8 * np.sin(w * time)
    friction = damping * w * 0.8 * np.cos(w * time)
    inner = slice(3, -3)  # at the ends a cubic is not in the middle of its rows
    expected = (weight + inertia + friction)[inner]
    assert found.force is not None
    assert found.force[inner, 0] == pytest.approx(expected, abs=0.0025 * np.abs(inertia).max())


@pytest.mark.parametrize(
    ("time", "frequency"),
    [
        (np.arange(600) / 20.0, 3.0),
        (np.arange(2400) / 80.0, 12.0),
        (np.arange(2400) / 80.0, 1.0),  # whose counts repeat: one width leaves more than its like
        (np.r_[np.arange(300) / 10.0, 30.0 + np.arange(200) / 1000.0], 0.5),
        (np.r_[np.arange(800), np.arange(1400, 2200)] / 200.0, 0.7),  # a gap of three seconds
        (np.arange(6000) / 1000.0, 0.5),  # a count lasts for many rows
    ],
)
def test_a_measured_motion_has_the_rate_of_its_oscillation(time, frequency) -> None:
    """Also of one of less than seven rows, and where some rows are a hundred times as close."""
    w, count = 2.0 * np.pi * frequency, 2.0 * np.pi / 4096.0
    path = count * np.round(0.3 * np.sin(w * time) / count)
    found = led_timeline(replace(led(path, np.zeros_like(time)), time=time))
    rate, acceleration = found.motion[found.measured].T
    scored = found.trusted
    assert np.std((rate - 0.3 * w * np.cos(w * time))[scored]) < 0.03 * 0.3 * w
    assert np.std((acceleration + 0.3 * w**2 * np.sin(w * time))[scored]) < 0.1 * 0.3 * w**2


@pytest.mark.parametrize("bits", [12, 14])
def test_an_acceleration_keeps_its_size(bits: int) -> None:
    """By what its windows cut off an inertia would be too large: by less than a part in 2000.

    Thousands of rows tell an inertia to that. Quintics, as long as noise let them, cut off 0.1 %.
    """
    time, count = np.arange(3000) / 100.0, 2.0 * np.pi / 2**bits
    path, true = np.zeros_like(time), np.zeros_like(time)
    for frequency, phase in ((0.2, 0.3), (0.5, 1.0), (0.85, 2.0)):
        w = 2.0 * np.pi * frequency
        path += 0.4 * np.sin(w * time + phase)
        true -= 0.4 * w**2 * np.sin(w * time + phase)
    angle = count * np.round(path / count)
    found = led_timeline(replace(led(angle, np.zeros_like(time)), time=time))
    acceleration = found.motion[found.measured, 1]
    assert true @ acceleration / (true @ true) == pytest.approx(1.0, abs=5e-4)
    assert np.std(acceleration - true) < 0.02 * np.std(true)


def test_a_late_cell_reports_what_the_path_asked_for_before() -> None:
    """A delay of 30 ms shifts the force by as much, and a lag of 40 ms rounds it off so."""
    path = led(2.0 + np.sin(np.arange(801) / 80.0), np.full(801, -LOAD))
    plain, late, lagging = (
        simulated_recording(path, replay([path], model_of(effects))[0]).force
        for effects in (
            {},
            {"load_cell_delay": {"delay": 0.03}},
            {"load_cell_lag": {"time_constant": 0.04}},
        )
    )
    assert plain is not None
    assert late is not None
    assert lagging is not None
    force = spring(RADIUS * (2.0 + np.sin(path.time - 0.03))) + LOAD
    assert late[40:, 0] == pytest.approx(force[40:], abs=1e-4)
    slope = np.gradient(lagging[:, 0], path.time)
    assert (lagging[:, 0] + 0.04 * slope)[40:-1] == pytest.approx(plain[40:-1, 0], abs=1e-4)


def test_a_path_and_its_actuator_go_together() -> None:
    """Neither a commanded recording nor another actuator is taken for a path."""
    path = led(TRIANGLE, np.full(len(TRIANGLE), -LOAD))
    finger = replace(path, bench="finger", bench_overrides=BenchOverrides())
    commanded = replace(path, command=path.motor_position)
    ideal = stated_model("ideal", {"gain": 4.2})
    for recording, model in ((commanded, model_of({})), (path, ideal)):
        with pytest.raises(InvalidRecording, match="go together"):
            replay([recording], model)
    with pytest.raises(InvalidModelFile, match="no place for 'voltage_sag'"):
        replay([path], model_of({"voltage_sag": {"sag": 0.1}}))
    with pytest.raises(InvalidModelFile, match="one joint and one tendon"):
        replay([finger], model_of({}))


def test_what_needs_a_command_refuses_a_path() -> None:
    """No run is designed where nothing can be told."""
    question = OpenSets(
        posterior=Posterior(), model=model_of({}), noise=NoiseFloor(theta=1e-3, force=1.0)
    )
    with pytest.raises(InvalidParameter, match="lead it more slowly"):
        Forecast(question, [], plan_run(Setting(bench="finger"), "ramps", 0, 4.0))


def test_a_path_under_a_load_is_written_and_read_back(tmp_path: Path) -> None:
    """A CSV file keeps the joint's angle and load to the bit."""
    recording = run(model_of({}))
    write_csv(tmp_path / "led.csv", recording)
    again = read_recording_file(tmp_path / "led.csv", bench=recording.bench)
    assert again.driven_by == "path"
    assert np.array_equal(again.compared_angle, recording.compared_angle)
    assert again.joint_load is not None
    assert np.array_equal(again.joint_load, np.full(len(TRIANGLE), -LOAD))
