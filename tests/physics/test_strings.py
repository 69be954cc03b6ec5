"""What a string cannot do."""

import numpy as np

from tendon_newton.simulation.hosts.rollout import TIME_STEP
from tests.physics.runs import ideal_model, run_of, simulate


def test_a_string_that_is_let_out_a_little_does_not_push() -> None:
    """A goal of 0.03 rad below the stop would be 0.126 N of push: none ever comes."""
    command = np.repeat([0.5, -0.03, 0.2, -0.03], 20)
    (run,) = simulate([run_of(command, bench="spring_weak")], ideal_model(), time_step=TIME_STEP)
    assert run.force.min() == 0.0
    assert np.all(run.force[[39, 79], 0] == 0.0)
