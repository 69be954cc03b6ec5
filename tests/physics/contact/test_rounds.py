"""Fingers that are stepped in turn with one body, along one line: does any of their modes grow?"""

from dataclasses import dataclass

import numpy as np
import pytest

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.obstacles import DISSIPATION, STIFFNESS
from tendon_newton.simulation.dynamics.integrator import GAMMA
from tendon_newton.simulation.kernels.body_kernels import ROUNDS

STEP = 5.0e-4  # s
DRAWS = 150


@dataclass(frozen=True, kw_only=True)
class Grasp:
    """Fingers that press a body, as masses, springs and dampers along one line."""

    tip: Array  # Masses of the fingers at their tips [kg], shape (N,)
    # How hard they press [N], shape (N,): a contact's damper is that times `DISSIPATION`
    force: Array
    drive: Array  # Stiffness of what holds each finger [N/m], shape (N,)
    body: float  # Mass of what they hold [kg]
    floor: float  # Stiffness of what the body lies on [N/m]


def random_grasp(body: float, rng: np.random.Generator) -> Grasp:
    """Return up to four fingers of any mass and force."""
    count = int(rng.integers(1, 5))
    return Grasp(
        tip=10.0 ** rng.uniform(-3.0, 1.5, count),
        force=10.0 ** rng.uniform(-2.0, 1.3, count) * (rng.random() < 0.8),
        drive=10.0 ** rng.uniform(0.0, 4.0, count) * (rng.random(count) < 0.8),
        body=body,
        floor=STIFFNESS * float(rng.integers(0, 5)),
    )


def pair_step(grasp: Grasp, i: int, q: Array, v: Array, load: float) -> tuple[Array, Array, float]:
    """Step finger i and the body by ROS2 under a load of the others [N].

    Returns:
        Places, speeds, and the mean force [N] that this finger does to the body.
    """
    k, c, h = STIFFNESS, DISSIPATION * grasp.force[i], STEP
    floor = grasp.floor if i == 0 else 0.0  # the first finger's part, as in the kernels
    mass = np.diag([grasp.tip[i], grasp.body])
    stiffness = np.array([[-k - grasp.drive[i], k], [k, -k - floor]])
    damping = np.array([[-c, c], [c, -c]])
    matrix = mass - GAMMA * h * damping - (GAMMA * h) ** 2 * stiffness
    outside = np.array([0.0, load])
    first = stiffness @ q + damping @ v + outside
    k1 = np.linalg.solve(matrix, first + GAMMA * h * stiffness @ v)
    slope = v + GAMMA * h * k1
    later = v + h * k1
    rest = later - 2.0 * slope
    second = stiffness @ (q + h * slope) + damping @ later + outside
    k2 = np.linalg.solve(matrix, second - 2.0 * mass @ k1 + GAMMA * h * stiffness @ rest)
    end = v + h * (1.5 * k1 + 0.5 * k2)
    push = grasp.body * (end[1] - v[1]) / h - load
    return q + h * (1.5 * slope + 0.5 * (rest + GAMMA * h * k2)), end, push


def hand_step(grasp: Grasp, state: Array) -> Array:
    """Step all fingers in turn; the state has places, speeds and the last pushes."""
    count = len(grasp.tip)
    q, v = state[: count + 1], state[count + 1 : 2 * count + 2]
    pushes = state[2 * count + 2 :].copy()
    places, speeds = q.copy(), v.copy()
    for _ in range(ROUNDS):
        for i in range(count):
            own = [i, count]
            load = float(np.sum(pushes) - pushes[i])
            places[own], speeds[own], pushes[i] = pair_step(grasp, i, q[own], v[own], load)
    return np.concatenate([places, speeds, pushes])


@pytest.mark.parametrize("body", [0.01, 0.05, 0.2])
def test_no_mode_of_fingers_and_a_body_grows(body: float, rng: np.random.Generator) -> None:
    """At 0.5 ms, whatever fingers of 1 g to 30 kg weigh and press; the body alone only drifts."""
    for _ in range(DRAWS):
        grasp = random_grasp(body, rng)
        size = 3 * len(grasp.tip) + 2
        matrix = np.column_stack([hand_step(grasp, unit) for unit in np.eye(size)])
        # what drifts has a double root of one, which rounding splits by its square root
        assert np.max(np.abs(np.linalg.eigvals(matrix))) < 1.0 + 1e-6
