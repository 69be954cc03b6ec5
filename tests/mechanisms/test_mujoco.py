"""Newton's MuJoCo solver steps every asset, with the tendons it reads from the same prims."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from newton.solvers import SolverMuJoCo

from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.geometry.parts import excursion, moment_arms
from tendon_newton.mechanisms.geometry.statics import closing_tension, equilibrium
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tests.physics.replay import replayed

DURATION = 1.0  # s, many time constants of every bench
STEP = 5.0e-4  # s: at 1 ms a light finger bounces on MuJoCo's end stops, at 2 ms it diverges


@pytest.mark.parametrize("name", asset_names())
def test_mujoco_settles_where_statics_says(name: str) -> None:
    """Half the closing force, applied through the moment arms, leads to the equilibrium."""
    mechanism = replace(load_mechanism(name), obstacles=())  # statics know of no contact
    model = build_model(mechanism, 1, device="cpu")
    if not np.any(model.joint_damping.numpy() > 0.0):
        # a pendulum without damping never settles; so it does within 0.15 s
        model.joint_damping.fill_(0.15 * closing_tension(mechanism))
    solver = SolverMuJoCo(model, disable_contacts=True)
    first = mechanism.tendons[0]
    tension = np.zeros(len(mechanism.tendons))
    tension[0] = 0.5 * closing_tension(mechanism)
    states, control = [model.state(), model.state()], model.control()
    steps = [
        replayed(partial(solver.step, *ends, control, None, STEP))
        for ends in (states, states[::-1])
    ]
    for number in range(round(DURATION / STEP)):
        if number == 0 or first.route is not None:
            effort = tension[0] * moment_arms(first, states[number % 2].joint_q.numpy())
            control.joint_f.assign(effort.astype(np.float32))
        steps[number % 2]()
    rest = equilibrium(mechanism, tension)
    reached = excursion(first, states[0].joint_q.numpy())
    # 1 %: what remains of the motion, and MuJoCo's own treatment of soft stops.
    assert reached == pytest.approx(excursion(first, rest), rel=0.01)
    # MuJoCo's tendon is the same, one step earlier: l = sum(arm q), or what a path grows shorter.
    length = float(solver.mjw_data.ten_length.numpy()[0, 0])
    wound = length if first.route is None else first.route.rest_length - length
    assert wound == pytest.approx(reached, rel=1e-3)
