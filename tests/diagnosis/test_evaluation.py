"""How much of an error is gone."""

import pytest

from tendon_newton.diagnosis.evaluation import explained_fraction
from tendon_newton.diagnosis.result import Errors
from tendon_newton.identification.noise_floor import NoiseFloor

NOISE = NoiseFloor(theta=4.4e-4, force=0.05)


def errors(theta: float, force: float) -> Errors:
    """Root mean squares of an angle [rad] and a force [N]."""
    return Errors(theta_rmse=theta, theta_mae=theta, force_rmse=force)


def test_a_signal_with_hardly_a_gap_does_not_decide() -> None:
    """A force's gap of twelve floors is closed; the angle goes from 1.3 to 1.7 floors."""
    share = explained_fraction(errors(5.7e-4, 0.6), errors(7.3e-4, 0.05), NOISE)
    assert share == pytest.approx(1.0, abs=1e-3)


def test_two_gaps_count_alike() -> None:
    """One of two large gaps is closed, the other stays."""
    share = explained_fraction(errors(1e-2, 1.0), errors(1e-2, 0.05), NOISE)
    assert share == pytest.approx(0.5, abs=1e-3)
