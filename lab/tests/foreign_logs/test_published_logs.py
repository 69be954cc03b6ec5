"""A diagnosis of published logs of a real arm."""

from pathlib import Path

import pytest

from lab.studies.so101_pairs import TOLD, split
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.identification.study import Study


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
