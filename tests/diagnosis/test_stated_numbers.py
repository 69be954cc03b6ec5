"""What a data sheet says of a motor may settle a doubt, but names no cause by itself."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.importers.xl330 import duty_per_rad, start_model
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import BenchOverrides, Recording
from tendon_newton.diagnosis.gate import Gate
from tendon_newton.diagnosis.greedy import Fit, Round, Search
from tendon_newton.identification.study import Study

MASS, ARM, ARMATURE, SUPPLY = 0.49, 0.1, 2.0e-3, 7.4  # [kg], [m], [kg m^2], [V]
TORQUE_CONSTANT, RESISTANCE = 0.41, 4.2
"""[N m/A] as the data sheet has it; [ohm], of which it says 3.4."""
DRY = 0.03  # [N m]
ROW, STEPS = 5.0e-3, 10  # [s], and steps in it
COUNT = 2.0 * np.pi / 4096.0  # [rad]
CAUSES = ("coulomb_friction", "gain_error")


def swing(kp: float, frequency: float) -> Recording:
    """Return the log of a made-up servo that turns a pendulum: dry friction and its own winding."""
    time = np.arange(500, dtype=np.float64) * ROW
    goal = 1.2 * np.sin(2.0 * np.pi * frequency * time)
    inertia, step = MASS * ARM**2 + ARMATURE, ROW / STEPS
    angle, speed, log = 0.0, 0.0, np.zeros((len(time), 2))
    for k in range(len(time) * STEPS):
        if k % STEPS == 0:
            log[k // STEPS] = angle, speed
        duty = np.clip(duty_per_rad(kp) * (goal[k // STEPS] - angle), -1.0, 1.0)
        torque = TORQUE_CONSTANT * (duty * SUPPLY - TORQUE_CONSTANT * speed) / RESISTANCE
        free = speed + step * (torque - MASS * 9.81 * ARM * np.sin(angle)) / inertia
        speed = np.sign(free) * max(0.0, abs(free) - step * DRY / inertia)
        angle += step * speed
    return Recording(
        name=f"kp{kp:g}_{frequency:g}",
        bench="pendulum",
        time=time,
        command=goal[:, None],
        motor_position=COUNT * np.round(log[:, :1] / COUNT),
        motor_velocity=log[:, 1:],
        start="first_row",
        bench_overrides=BenchOverrides(mass=(MASS,), length=(ARM,)),
        actuator_overrides={"duty_per_rad": duty_per_rad(kp)},
    )


def stated(logs: Sequence[Recording]) -> Model:
    """Return the model from which an import of these logs starts."""
    of_file = {"conditions": {"vin": SUPPLY}, "source": Path("made_up.json"), "sha256": ""}
    return start_model([ImportedLog(recording=log, **of_file) for log in logs])


@pytest.fixture(scope="module")
def study() -> Study:
    """Four logs, and the model that the import of real ones begins with."""
    logs = [swing(kp, hertz) for kp in (100, 200) for hertz in (0.4, 0.9)]
    return Study(logs, stated(logs), CAUSES, time_step=1.0e-3)


@pytest.fixture(scope="module")
def search(study: Study) -> Search:
    """Fits with torque constant, resistance and armature free."""
    return Search(study, stated(study.recordings))


def gate_and_round(search: Search) -> tuple[Gate, Round, Fit]:
    """Take the friction as found, and try an error of the gain beside it."""
    rng = np.random.default_rng(0)
    noise, baseline = search.study.noise, search.baseline()
    gate = Gate(search=search, known=(), noise=noise, baseline=baseline, rng=rng)
    friction = search.extend(baseline, (), CAUSES[:1]).fits[0]
    tried = search.extend(friction.candidate, friction.effects, CAUSES[1:])
    return gate, tried, tried.fits[0]


def test_a_wrong_data_sheet_names_no_cause(search: Search) -> None:
    """With 3.4 ohm for 4.2 a lower gain is beyond doubt; with the resistance free it is nothing."""
    gate, tried, lower_gain = gate_and_round(search)
    assert gate.is_decisive_as_stated(tried, lower_gain)
    assert not gate.opens(tried, lower_gain, gate.chance(tried))


def test_as_stated_only_causes_are_fitted(search: Search, study: Study) -> None:
    """The numbers of the motor are free in one search, and the model's in the other."""
    friction = study.table.columns("coulomb_friction")
    assert len(search.problem(CAUSES[:1], None)[0].columns) == 3 + len(friction)
    assert search.as_stated().problem(CAUSES[:1], None)[0].columns == friction


def test_nothing_is_asked_of_a_model_without_unknown_numbers(search: Search) -> None:
    """Its gate answers for the fits as they are."""
    gate, tried, fit = gate_and_round(search.as_stated())
    assert not gate.is_decisive_as_stated(tried, fit)
