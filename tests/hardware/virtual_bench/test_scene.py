"""A hand in front of MuJoCo: its file, its rest, its statics, and what a unit differs in."""

import importlib
from dataclasses import replace
from math import dist
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.virtual_bench.physics.constants import (
    TIME_STEP,
    HandBallConstants,
    HandConstants,
)
from tendon_hardware.virtual_bench.physics.scene import SCENES, Scene
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.errors import MissingDependency
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.mechanisms.loading import load_mechanism

LEVEL = (0.0,) * 4  # Stiffness of strings [N/m], which a scene does not ask for


def pulled(scene: Scene, pulls: tuple[float, ...], seconds: float) -> None:
    """Let a scene move under constant pulls [N]."""
    for _ in range(round(seconds / TIME_STEP)):
        scene.advance(pulls, LEVEL, TIME_STEP)


def place_of(scene: Scene) -> tuple[float, ...]:
    """Return where the ball's middle is [m]."""
    pose = scene.ball()
    assert pose is not None
    return pose[:3]


@pytest.mark.parametrize("bench", ["hand", "hand_ball"])
def test_a_scene_is_what_its_asset_exports(bench: str, tmp_path: Path) -> None:
    """`tendon-newton asset export BENCH --out FILE` writes the file anew."""
    fresh = tmp_path / "scene.xml"
    write_mujoco(fresh, load_mechanism(bench))
    assert (SCENES / f"{bench}.xml").read_text("utf-8") == fresh.read_text("utf-8")


def test_the_strings_are_those_of_the_asset() -> None:
    """MuJoCo's routes and ours give the same line to 1e-6 m, in postures of all joints."""
    mechanism, scene = load_mechanism("hand"), Scene("hand", HandConstants())
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(0.0, 1.1, 12)
        scene.place(q.tolist())
        there = [float(excursion(tendon, q)) for tendon in mechanism.tendons]
        assert scene.excursions == pytest.approx(there, abs=1e-6)


@pytest.mark.parametrize("pull", [1.0, 3.0, 6.0])
def test_a_pull_closes_a_finger_as_statics_say(pull: float) -> None:
    """Joint angles at rest, finger by finger; 2 mrad: MuJoCo's stops are soft near their ends."""
    mechanism, scene = load_mechanism("hand"), Scene("hand", HandConstants())
    pulls = (pull, 0.5 * pull, 0.0, pull)
    pulled(scene, pulls, 2.0)
    expected = equilibrium(mechanism, np.array(pulls))
    assert scene.joints() == pytest.approx(expected, abs=2e-3)


def test_a_ball_rests_in_its_cup() -> None:
    """Within 0.2 mm of where the asset has it; over a second it creeps by less than 10 um."""
    scene = Scene("hand_ball", HandBallConstants())
    start = place_of(scene)
    pulled(scene, LEVEL, 1.0)
    rested = place_of(scene)
    assert dist(start, rested) < 2e-4
    pulled(scene, LEVEL, 1.0)
    assert dist(rested, place_of(scene)) < 1e-5


def test_fingers_hold_a_ball() -> None:
    """All four press with 2 N of tendon: the ball stays in its cup, and all comes to rest."""
    scene = Scene("hand_ball", HandBallConstants())
    start = place_of(scene)
    pulled(scene, (2.5,) * 4, 2.0)
    assert dist(start, place_of(scene)) < 5e-3
    before = scene.joints()
    pulled(scene, (2.5,) * 4, 0.5)
    assert scene.joints() == pytest.approx(before, abs=1e-3)


def test_energy_does_not_grow() -> None:
    """Fingers let go from a grip: what stops and contacts keep for a while is never more than all.

    At the end only the weight's energy is left, to 1 % of the grip's.
    """
    scene, rest = Scene("hand_ball", HandBallConstants()), Scene("hand_ball", HandBallConstants())
    pulled(rest, LEVEL, 1.0)
    pulled(scene, (2.5,) * 4, 1.0)
    held, least = scene.energy() - rest.energy(), []
    for _ in range(150):
        pulled(scene, LEVEL, 0.01)
        least.append(scene.energy() - rest.energy())
    assert max(least) <= held
    assert least[-1] == pytest.approx(0.0, abs=0.01 * held)


def test_half_the_substep_ends_in_the_same_grip() -> None:
    """A slow pull to 2 N at 0.25 and at 0.125 ms: joints within 5 mrad, the ball within 0.2 mm."""
    ends = []
    for step in (TIME_STEP, 0.5 * TIME_STEP):
        scene = Scene("hand_ball", HandBallConstants())
        count = round(1.0 / step)
        for k in range(count):
            scene.advance((2.0 * k / count,) * 4, LEVEL, step)
        ends.append((scene.joints(), place_of(scene)))
    (coarse, there), (fine, here) = ends
    assert coarse == pytest.approx(fine, abs=5e-3)
    assert dist(there, here) < 2e-4


def test_a_ball_is_put_back_at_rest() -> None:
    """Where the asset has it, and it stays."""
    scene = Scene("hand_ball", HandBallConstants())
    start = place_of(scene)
    pulled(scene, (9.0, 0.0, 0.0, 0.0), 1.0)
    pulled(scene, LEVEL, 1.0)
    scene.put_back()
    assert place_of(scene) == start
    pulled(scene, LEVEL, 0.5)
    assert dist(start, place_of(scene)) < 2e-4


def test_a_unit_has_springs_masses_and_friction_of_its_own() -> None:
    """A stiffer finger closes less, a heavier ball lies deeper, and units differ."""
    stiff = replace(HandConstants(), stiffness=(1.3, 1.0, 1.0, 1.0))
    scene = Scene("hand", stiff)
    pulled(scene, (2.0,) * 4, 1.0)
    assert scene.excursions[0] < 0.85 * scene.excursions[1]
    heights = []
    for mass in (1.0, 2.0, 3.0):
        scene = Scene("hand_ball", replace(HandBallConstants(), ball_mass=mass, cup_friction=0.0))
        pulled(scene, LEVEL, 0.5)
        heights.append(place_of(scene)[2])
    first, second = np.diff(heights)
    assert first > 0.0  # m, along gravity
    assert second == pytest.approx(first, rel=0.1)  # springs of the same stiffness
    units = [draw_unit("hand_ball", seed).mechanism for seed in range(3)]
    assert len({str(unit) for unit in units}) == 3


def test_without_mujoco_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """The package belongs to the simulator's extra."""

    def missing(name: str) -> None:
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(
        MissingDependency, match=r"needs the package 'mujoco'.*tendon-newton\[sim\]"
    ):
        Scene("hand", HandConstants())
