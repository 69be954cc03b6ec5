"""Diagnoses of published logs of real servos."""

from dataclasses import replace
from pathlib import Path

import pytest

from lab.studies.so101_pairs import TOLD, split
from tendon_lab.foreign_logs.bam import read_xl330
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.model_file import NamedValues
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.identification.study import Study

MOTOR = {"torque_constant": 0.3998, "resistance": 3.596, "armature": 0.001296}

FADING = (
    NamedValues(name="load_dependent_friction", values={"coefficient": 0.3563}),
    NamedValues(name="viscous_friction", values={"coefficient": 0.008167}),
    NamedValues(name="torque_fade", values={"fade": 3.859, "time_constant": 0.7478}),
)
"""Fitted to the gains 100 and 800: the rotor's inertia acts before the gear, whose friction then
sees less of it."""


def data(shared: Path, name: str) -> Path:
    """Return the folder of a data set, or skip."""
    folder = shared / "data" / name
    if not folder.is_dir():
        pytest.skip("these logs are not part of the repository, and are not here")
    return folder


@pytest.mark.parametrize(
    ("joint", "motions", "least", "names"),
    [
        pytest.param(
            "Rotation",
            ("chirp_sweep", "slow_precision"),
            0.75,
            {"actuator_lag", "command_delay", "deadband"},
            marks=pytest.mark.slow,
        ),
        (
            "Wrist_Roll",
            ("chirp_sweep", "single_joint_wrist_roll"),
            0.70,
            {"actuator_lag", "deadband"},
        ),
    ],
)
def test_a_position_servo_is_explained_on_motions_that_no_fit_has_seen(
    shared, tmp_path, joint, motions, least, names
) -> None:
    """Three quarters of the RMS error of "it is where it was told to be" go.

    Each cause is named, or in the class of one that is.
    """
    imported = read_so101(data(shared, "so101"))
    logs = [log for log in imported.logs if log.conditions["joint"] == joint]
    dataset = split(tmp_path, logs, motions)
    diagnosis, _ = diagnose(dataset, imported.model)
    classes = [{effect.name, *effect.indistinguishable_from} for effect in diagnosis.effects]
    assert set().union(*classes) >= names
    assert len(classes) == len(names)
    told = Study(dataset.test, TOLD, ())
    (before,) = evaluate_models(told, [{}])
    assert diagnosis.extended.theta_rmse < (1.0 - least) * before.pooled().theta_rmse


def test_a_fading_torque_predicts_a_gain_that_no_fit_has_seen(shared: Path) -> None:
    """Fitted to the gains 100 and 800 alone, it leaves 29.8 mrad at gain 200 (0.5: rounding).

    The supply is the mean of its readings; with their ripple 32.6 mrad are left.
    """
    imported = read_xl330(data(shared, "xl330"))
    held = [log.recording for log in imported.logs if log.conditions["kp"] == 200]
    actuator = imported.model.actuator
    motor = replace(actuator, values={**actuator.values, **MOTOR})
    model = replace(imported.model, actuator=motor, effects=FADING)
    study = Study(held, model, tuple(effect.name for effect in FADING))
    (error,) = evaluate_models(study, [{}])
    assert 1e3 * error.pooled().theta_mae == pytest.approx(29.8, abs=0.5)
