"""Diagnoses of a made-up servo of which only the position is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tendon_newton.cli.simulate import errors_text
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import Evidence, diagnose, extended_model
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.reporting.held_out import compare
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study
from tendon_newton.simulation.hosts.rollout import Trajectory
from tests.made import recorded, stated_model

Array = NDArray[np.float64]
ROW, STEPS = 0.02, 20  # Time from row to row [s], and steps in it
DELAY, LAG, BAND = 0.038, 0.048, 0.008  # What the servo does: [s], [s], [rad]
COUNT = 2.0 * np.pi / 4096.0  # [rad]

TOLD = stated_model("ideal_position")  # it is where it was told


def measured(name: str, goal: Array) -> Recording:
    """Return the log of the made-up servo under a command [rad], shape (T,)."""
    step, shaft = ROW / STEPS, float(goal[0])
    theta = np.zeros(len(goal))
    for k in range(len(goal) * STEPS):
        if k % STEPS == 0:
            theta[k // STEPS] = COUNT * np.round(shaft / COUNT)
        error = goal[max(0, int((k * step - DELAY) / ROW + 1e-9))] - shaft
        if abs(error) > BAND:
            shaft += (1.0 - np.exp(-step / LAG)) * (error - np.sign(error) * BAND)
    time, speed = np.arange(len(goal), dtype=np.float64) * ROW, np.gradient(theta, ROW)
    return recorded(time, theta, name=name, command=goal, motor_velocity=speed, start="first_row")


def sweep(seconds: float, last: float) -> Array:
    """Return a sine of 0.15 rad whose frequency grows to a last one [Hz]."""
    time = np.arange(0.0, seconds, ROW)
    return 0.15 * np.sin(
        2.0
        * np.pi
        * 0.05
        * seconds
        / np.log(last / 0.05)
        * ((last / 0.05) ** (time / seconds) - 1.0)
    )


def ramps(seconds: float, speed: float) -> Array:
    """Return ramps of 0.4 rad up and down at some speed [rad/s]."""
    way = speed * np.arange(0.0, seconds, ROW)
    return 0.4 - np.abs(way % 0.8 - 0.4)


def test_a_cause_that_only_fast_rows_show_is_named(tmp_path: Path) -> None:
    """Delay and lag differ in the fast end of a sweep alone; elsewhere both do as well."""
    data = Dataset(
        path=tmp_path,
        train=(measured("sweep", sweep(60.0, 2.5)), measured("ramps", ramps(30.0, 0.08))),
        test=(measured("other", ramps(20.0, 0.5)),),
    )
    servo = stated_model("ideal_position")
    diagnosis, _ = diagnose(data, servo)
    assert {e.name for e in diagnosis.effects} == {"actuator_lag", "command_delay", "deadband"}
    found = {name: e.value for effect in diagnosis.effects for name, e in effect.parameters.items()}
    for name, truth in (("delay", DELAY), ("time_constant", LAG), ("width", BAND)):
        assert abs(found[name] / truth - 1.0) < 0.1  # a count is a fifth of the deadband


def test_a_limit_that_is_found_to_be_none_leaves_the_model() -> None:
    """A stated profile goes where its limit ended at infinity; a speed that is free is left out."""
    stated = NamedValues(name="acceleration_limit", values={"limit": 39.0, "speed": 100.0})
    servo = Model(actuator=NamedValues(name="ideal_position", values={}), effects=(stated,))
    study = Study([measured("ramps", ramps(2.0, 0.5))], servo, tuple(EFFECTS))
    limit, speed = study.table.columns("acceleration_limit")
    gone = extended_model(study, servo, {limit: np.inf, speed: 5.0}, ["acceleration_limit"])
    assert gone.effects == ()
    (found,) = extended_model(study, servo, {limit: 20.0, speed: np.inf}, [stated.name]).effects
    assert found.values == {"limit": 20.0}


def test_what_follows_a_gap_is_no_error_of_the_model() -> None:
    """A command that jumps amid lost rows is unknown to a simulation; such rows count nowhere."""
    goal = np.repeat([0.0, 0.4, -0.3, 0.2], 100)
    whole = measured("whole", goal)
    kept = np.r_[:80, 120 : len(goal)]  # the step at row 100 is lost, and 0.4 s around it
    lost = replace(
        whole,
        time=whole.time[kept],
        command=goal[kept, None],
        motor_position=whole.motor_position[kept],
        motor_velocity=whole.motor_velocity[kept],
        enabled=whole.enabled[kept],
    )
    told = []
    for recording in (whole, lost):
        (error,) = evaluate_models(Study([recording], TOLD, ()), [{}])
        told.append(error)
    rows = [error.signals["theta"][1].sum() for error in told]
    assert rows[1] < rows[0] - 40.0 - 49.0  # nor does the second that follows
    study = Study([lost], TOLD, ())
    (shown,) = compare(Evidence(baseline={}, extended={}, test=study, train=study))
    assert np.isnan(shown.theta).sum(axis=1).tolist() == [50, 50]
    still = Trajectory(
        time=lost.time,
        motor_position=np.zeros((len(kept), 1)),
        motor_velocity=np.zeros((len(kept), 1)),
        force=np.zeros((len(kept), 1)),
        joint_position=np.zeros((len(kept), 1)),
    )
    assert errors_text(lost, still).endswith(" mrad RMS, without 50 rows after gaps")


def test_a_log_in_which_nothing_moves_has_no_gap() -> None:
    """Half a count beside its command: no warning, no gap, and what to record is told."""
    rest = measured("still.csv", np.full(200, 0.3))
    rest = replace(rest, motor_position=np.full((200, 1), 0.3 - 0.52 * COUNT))
    again = replace(rest, name="again.csv")
    dataset = Dataset(path=Path("made_up"), train=(rest,), test=(again,))
    model = stated_model("ideal_position")
    found, _ = diagnose(dataset, model, progress=lambda _: None)
    assert found.verdict == "no_gap"
    assert "nothing moves, so nothing can be told" in found.next_steps[0]
