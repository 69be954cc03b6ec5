"""A body that several equal fingers move: its laws of motion, and what one finger alone does."""

import numpy as np
import pytest
import torch

from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.geometry.obstacles import STIFFNESS, Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.physics.contact.bodies import GRAVITY, MASS, RATE, STEP, ground
from tests.physics.runs import ideal_model

FINGERS = 4
APART = 0.018  # From one finger's plane to the next [m]
RADIUS = 0.05  # Of a ball that all fingers reach [m]
BELOW = (0.04, 0.0, -0.075)  # Place of its middle [m]
FLOOR = BELOW[2] - RADIUS  # Height of what it lies on [m]
LIGHT = 0.1  # Mass of a light ball as a share of the other's [1]
FRICTION = 0.8
FINGER = """
    def Xform "finger_{k}" (
        prepend references = @{asset}@
        delete apiSchemas = ["PhysicsArticulationRootAPI"]
    )
    {{
        double3 xformOp:translate = (0, {y}, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]

        over "scene" (
            active = {scene}
        )
        {{
        }}
        over "distal_phalanx"
        {{
            over "tip" (
                active = {scene}
            )
            {{
            }}
        }}
    }}
"""
ROW = """#usda 1.0
(
    defaultPrim = "row"
    upAxis = "Z"
    metersPerUnit = 1
    kilogramsPerUnit = 1
)

def Xform "row" (
    prepend apiSchemas = ["PhysicsArticulationRootAPI"]
)
{{{fingers}}}
"""


@pytest.fixture(scope="module")
def row(tmp_path_factory: pytest.TempPathFactory) -> ControlLoop:
    """Return fingers over a ball on a floor; the second world's ball is light."""
    asset, places = asset_path("finger").resolve(), APART * (np.arange(FINGERS) - 1.5)
    fingers = [
        FINGER.format(k=k, asset=asset, y=y, scene=str(k == 0).lower())
        for k, y in enumerate(places)
    ]
    path = tmp_path_factory.mktemp("row") / "row.usda"
    path.write_text(ROW.format(fingers="".join(fingers)))
    ball = Sphere(position=np.array(BELOW), radius=RADIUS, mass=MASS, friction=FRICTION)
    mechanism = load_mechanism(path).with_obstacles(ball, ground(FLOOR))
    loop = ControlLoop(mechanism, ideal_model(), 2, rate=RATE, max_step=STEP, device="cpu")
    assert loop.solver.chain_count == FINGERS
    loop.bench_numbers("body_mass")[1] *= LIGHT
    loop.bench_numbers("body_inertia")[1] *= LIGHT
    return loop


def begin(loop: ControlLoop, place: tuple[float, float, float], *speeds: float) -> None:
    """Put both balls somewhere, at some speeds [m/s, rad/s], below open fingers."""
    pose = torch.tensor([*place, 0.0, 0.0, 0.0, 1.0]).repeat(2, 1)
    velocity = torch.tensor(speeds or (0.0,) * 6).repeat(2, 1)
    loop.reset(torch.zeros(2, FINGERS), body_pose=pose, body_velocity=velocity)


def test_a_shared_ball_falls_as_if_it_were_nobodys(row: ControlLoop) -> None:
    """A parabola, and a constant spin, whatever a ball weighs."""
    begin(row, (0.5, 0.0, 0.4), 0.3, -0.2, 1.0, 3.0, -2.0, 1.0)
    for _ in range(40):
        row.step(torch.zeros(2, FINGERS))
    time = 40 / RATE
    fall = [0.3 * time, -0.2 * time, time - 0.5 * GRAVITY * time**2]
    for ball in range(2):
        way = row.body_pose[ball, :3].numpy() - [0.5, 0.0, 0.4]
        assert way == pytest.approx(np.array(fall), abs=1e-6)  # float32 of Newton's state
        assert row.body_velocity[ball, 3:].tolist() == pytest.approx([3.0, -2.0, 1.0], rel=1e-5)


def test_a_shared_ball_slides_until_it_rolls(row: ControlLoop) -> None:
    """With 5/7 of its speed; it is the first finger that meets the floor, and all others follow."""
    begin(row, (0.5, 0.0, BELOW[2] - MASS * GRAVITY / STIFFNESS), 0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(100):
        row.step(torch.zeros(2, FINGERS))
    for ball in range(2):
        speed, spin = row.body_velocity[ball, 0], row.body_velocity[ball, 4]
        assert float(speed) == pytest.approx(0.5 * 5.0 / 7.0, rel=0.02)
        assert float(spin) * RADIUS == pytest.approx(float(speed), rel=0.02)


def test_all_fingers_press_a_ball_to_rest(row: ControlLoop) -> None:
    """Also one of 5 g, which fingers throw that do not know of each other soon enough."""
    begin(row, BELOW)
    for step in range(400):
        row.step(torch.full((2, FINGERS), min(4.0, 0.02 * step)))
    assert not row.reading.diverged.any()
    assert float(row.body_velocity.abs().max()) < 1e-6
    pressed = row.contact_forces()[:, :, 0].norm(dim=-1).reshape(2, FINGERS, -1).sum(dim=-1)
    assert float(pressed.min()) > 1.0  # N
    for ball, mass in enumerate((MASS, LIGHT * MASS)):
        push = -row.contact_forces()[ball, :, 0].sum(dim=0)[2]
        floor = STIFFNESS * (RADIUS - (row.body_pose[ball, 2] - FLOOR))
        assert float(push + floor) == pytest.approx(mass * GRAVITY, abs=5e-3)
