"""The order of the integrator, measured."""

import numpy as np
import pytest

from tests.physics.runs import ideal_model, run_of, simulate

STEPS = (2.0e-3, 1.0e-3, 5.0e-4, 2.5e-4)
REFERENCE = 1.25e-5
VISCOUS = {"viscous_friction": {"coefficient": 0.2}}
SMOOTH = {
    # no friction reverses and no stop is met while the finger closes
    "ideal": ({}, 0.02),
    "viscous": (VISCOUS, 0.03),
    "dry": ({"coulomb_friction": {"force": 0.5}, **VISCOUS}, 0.03),
    "load": ({"load_dependent_friction": {"coefficient": 0.2}, **VISCOUS}, 0.03),
    "lag": ({"actuator_lag": {"time_constant": 0.01}}, 0.03),
    "compliant": ({"tendon_compliance": {"stiffness": 4000.0}, **VISCOUS}, 0.03),
}


@pytest.mark.parametrize("case", SMOOTH)
def test_error_falls_with_the_square_of_the_step(case: str) -> None:
    """Between events the scheme is of second order.

    With friction that slides and with internal states.
    """
    effects, duration = SMOOTH[case]
    errors = [closing_error(effects, duration, step) for step in STEPS]
    order = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert 1.8 < order < 2.6, (
        f"errors {errors}"
    )  # the coarsest step is not quite in the asymptotic range


def closing_error(effects: dict[str, dict[str, float]], duration: float, step: float) -> float:
    """Return how far a closing finger is from a fine simulation at the end of one row [rad]."""
    run = run_of([2.5, 2.5], rate=1.0 / duration, start="first_row", angle=0.8, speed=2.0)
    model = ideal_model(**effects)
    coarse, fine = (
        simulate([run], model, time_step=h)[0].joint_position[-1] for h in (step, REFERENCE)
    )
    return float(np.abs(coarse - fine).max())
