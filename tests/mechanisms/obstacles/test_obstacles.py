"""Obstacles as an asset gives them, and as Newton's model holds them."""

from pathlib import Path
from typing import Any

import newton
import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.errors import InvalidAsset, InvalidParameter, UnknownName
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.authoring.mujoco_file import names_of, scene_spec
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import Box, LinkObstacle, Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.model.chain_copies import copies_of
from tests.physics.contact.bodies import ball, block, floor
from tests.physics.contact.pinches import pinch, write_pinch

MARKED = """#usda 1.0
(
    defaultPrim = "finger"
    upAxis = "Z"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    subLayers = [@{finger}@]
)

over "finger"
{{
    over "base"
    {{
        def Sphere "ball"
        {{
            bool tendon:obstacle = true
            double tendon:contactStiffness = 8000
            double tendon:contactFriction = 0.3
            double radius = 0.012
            double3 xformOp:translate = (0.016, 0, -0.02)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
        def Cube "step"
        {{
            bool tendon:obstacle = true
            double size = 1
            float3 xformOp:scale = (0.02, 0.03, 0.01)
            double3 xformOp:translate = (0.05, 0, -0.05)
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
        }}
        {more}
    }}
    over "distal_phalanx"
    {{
        {wrong}
    }}
}}
"""
"""A layer over the finger with obstacles in it."""


def layer(folder: Path, *, more: str = "", wrong: str = "") -> Path:
    """Write a layer over the finger, and return its file."""
    path = folder / "held.usda"
    finger = asset_path("finger").resolve()
    path.write_text(MARKED.format(finger=finger, more=more, wrong=wrong))
    return path


def test_a_marked_shape_of_the_base_is_an_obstacle(tmp_path: Path) -> None:
    """With the place, the size and the material that its prim gives."""
    sphere, box = load_mechanism(layer(tmp_path)).obstacles
    assert isinstance(sphere, Sphere)
    # float32
    assert sphere.radius == pytest.approx(0.012, rel=1e-6)
    assert sphere.position == pytest.approx([0.016, 0.0, -0.02], abs=1e-8)
    assert (sphere.stiffness, sphere.friction) == (8000.0, 0.3)
    assert isinstance(box, Box)
    assert box.half_size == pytest.approx([0.01, 0.015, 0.005], abs=1e-8)
    assert load_mechanism("finger").obstacles == ()


def test_a_marked_shape_with_a_mass_moves(tmp_path: Path) -> None:
    """UsdPhysics' mass makes a body of it, with a free joint of its own and the inertia of a solid.

    The shape that the asset draws stays behind unseen.
    """
    marble = (
        'def Sphere "marble" (\nprepend apiSchemas = ["PhysicsMassAPI"]\n)\n{\n'
        "bool tendon:obstacle = true\nfloat physics:mass = 0.05\ndouble radius = 0.015\n}"
    )
    mechanism = load_mechanism(layer(tmp_path, more=marble))
    assert [obstacle.mass for obstacle in mechanism.obstacles] == [None, None, pytest.approx(0.05)]
    model: Any = build_model(mechanism, 2, device="cpu")
    (drawn,) = (n for n, label in enumerate(mechanism.template.shape_label) if "marble" in label)
    assert not mechanism.template.shape_flags[drawn] & newton.ShapeFlags.VISIBLE
    assert model.joint_type.numpy()[-1] == newton.JointType.FREE
    assert model.body_mass.numpy()[-1] == pytest.approx(0.05)
    inertia = 0.4 * 0.05 * 0.015**2  # kg m2
    assert model.body_inertia.numpy()[-1] == pytest.approx(inertia * np.eye(3), rel=1e-5)


@pytest.mark.parametrize(
    ("more", "wrong", "words"),
    [
        ("", 'def Sphere "pad"\n{\nbool tendon:obstacle = true\n}', "nothing moves, or to a link"),
        ("", 'over "bone"\n{\nbool tendon:obstacle = true\n}', "no link of another finger"),
        ('def Cone "cone"\n{\nbool tendon:obstacle = true\n}', "", "a cube or a plane; this is"),
        (
            'def Sphere "bad"\n{\nbool tendon:obstacle = true\n'
            "double tendon:contactFriction = -1\n}",
            "",
            "negative",
        ),
    ],
)
def test_what_cannot_be_an_obstacle_is_named(more, wrong, words, tmp_path) -> None:
    """The prim, and what one is."""
    with pytest.raises(InvalidAsset, match=words):
        load_mechanism(layer(tmp_path, more=more, wrong=wrong))


def contact_pairs(mechanism: Mechanism) -> set[tuple[str, str]]:
    """Return the labels of what Newton lets collide in one world."""
    model = build_model(mechanism, 1, device="cpu")
    pairs = model.shape_contact_pairs
    names = [label.rsplit("/", maxsplit=2)[-2:] for label in model.shape_label]
    return {(names[a][0], names[b][1]) for a, b in pairs.numpy()}


def test_newton_lets_links_collide_with_obstacles_and_nothing_else() -> None:
    """Neither links with each other or their base, nor obstacles among themselves."""
    mechanism = load_mechanism("finger")
    assert contact_pairs(mechanism) == set()
    links, things = ("middle_phalanx", "distal_phalanx"), ("obstacle_0", "obstacle_1", "obstacle_2")
    found = contact_pairs(mechanism.with_obstacles(ball(), block()).with_obstacles(floor()))
    assert found == {(link, thing) for link in links for thing in things}


def test_a_longer_link_is_met_along_all_of_it() -> None:
    """A bench with longer links has longer capsules, in their places."""
    mechanism = load_mechanism("finger").with_obstacles(ball())
    overrides = [BenchOverrides(), BenchOverrides(length=(0.036, 0.050))]
    model: Any = build_model(mechanism, 2, overrides=overrides, device="cpu")
    bones = model.tendon.bone_shape.numpy()
    half = model.shape_scale.numpy()[bones, 1]
    middle = model.shape_transform.numpy()[bones, 0]
    assert half == pytest.approx([0.015, 0.0125, 0.018, 0.025], rel=1e-6)
    assert middle == pytest.approx(np.array([0.015, 0.0125, 0.018, 0.025]), rel=1e-6)


MARK = """over "distal_phalanx"
{
    over "bone"
    {
        bool tendon:obstacle = true
        double tendon:contactStiffness = 8000
        double tendon:contactFriction = 0.3
        %s
    }
}"""
"""A mark on the capsule of a finger's last link."""
MET_BY = "rel tendon:metBy = <%s>"


def pairs_of(mechanism: Mechanism, worlds: int = 1) -> set[tuple[str, ...]]:
    """Return the finger and link of what Newton lets collide."""
    model = build_model(mechanism, worlds, device="cpu")
    pairs = model.shape_contact_pairs
    assert len(pairs) % worlds == 0
    names = ["/".join(label.split("/")[2:4]) for label in model.shape_label]
    return {tuple(sorted((names[a], names[b]))) for a, b in pairs.numpy()}


def test_a_marked_capsule_of_a_link_is_an_obstacle(tmp_path: Path) -> None:
    """With the material that its prim gives, to all links of other fingers."""
    mechanism = load_mechanism(write_pinch(tmp_path, left=MARK % ""))
    (link,) = mechanism.obstacles
    assert isinstance(link, LinkObstacle)
    assert (link.stiffness, link.friction) == (8000.0, 0.3)
    assert pairs_of(mechanism, worlds=3) == {
        ("left/distal_phalanx", "right/distal_phalanx"),
        ("left/distal_phalanx", "right/middle_phalanx"),
    }


def test_a_mark_says_which_links_may_meet_it(tmp_path: Path) -> None:
    """A relationship leads to them, or to their capsules."""
    target = MET_BY % "/pinch/right/distal_phalanx"
    mechanism = load_mechanism(write_pinch(tmp_path, left=MARK % target))
    assert pairs_of(mechanism) == {("left/distal_phalanx", "right/distal_phalanx")}


def test_two_marked_links_meet_once(tmp_path: Path) -> None:
    """The first one's material counts between them."""
    both = (
        LinkObstacle(link="left/distal_phalanx", met_by=["right/distal_phalanx"]),
        LinkObstacle(link="right/distal_phalanx"),
    )
    mechanism = load_mechanism(write_pinch(tmp_path)).with_obstacles(*both)
    assert [len(meeting.met_by) for meeting in mechanism.meetings] == [1, 1]
    assert pairs_of(mechanism) == {
        ("left/distal_phalanx", "right/distal_phalanx"),
        ("left/middle_phalanx", "right/distal_phalanx"),
    }


def test_links_that_may_meet_are_simulated_whole(tmp_path: Path) -> None:
    """Fingers that cannot touch are chains of their own."""
    for mechanism, count in ((load_mechanism(write_pinch(tmp_path)), 2), (pinch(tmp_path), 1)):
        assert copies_of(build_model(mechanism, 2, device="cpu")).count == count


@pytest.mark.parametrize(
    ("obstacles", "kind", "words"),
    [
        ([LinkObstacle(link="left/distal")], UnknownName, "did you mean 'left/distal_phalanx'"),
        ([LinkObstacle(link="distal_phalanx")], InvalidParameter, "must name one capsule"),
        (
            [LinkObstacle(link="left/distal_phalanx", met_by=["thumb"])],
            UnknownName,
            "No link with a capsule named 'thumb'",
        ),
        (
            [LinkObstacle(link="left/distal_phalanx", met_by=["left/middle_phalanx"])],
            InvalidParameter,
            "links of different fingers meet",
        ),
        ([LinkObstacle(link="left/distal_phalanx")] * 2, InvalidParameter, "obstacle twice"),
    ],
)
def test_wrong_names_of_links_are_refused(obstacles, kind, words, tmp_path) -> None:
    """What came, and what there is."""
    with pytest.raises(kind, match=words):
        load_mechanism(write_pinch(tmp_path)).with_obstacles(*obstacles)


@pytest.mark.parametrize("name", ["stiffness", "dissipation", "friction"])
def test_numbers_without_a_meaning_are_refused(name: str) -> None:
    """As of any obstacle."""
    with pytest.raises(InvalidParameter, match=f"{name} of a capsule must not be negative"):
        LinkObstacle(link="left/distal_phalanx", **{name: -1.0})
    with pytest.raises(InvalidParameter, match=f"{name} of a capsule must be finite"):
        LinkObstacle(link="left/distal_phalanx", **{name: float("nan")})


def test_mjcf_names_the_links_that_meet(tmp_path: Path) -> None:
    """Beside the pairs of links with an obstacle of the base."""
    ball = Sphere(position=[0.02, 0.0, -0.02], radius=0.01)
    links = LinkObstacle(link="left/distal_phalanx", met_by=["right/distal_phalanx"], friction=0.3)
    mechanism = load_mechanism(write_pinch(tmp_path)).with_obstacles(ball, links)
    model = scene_spec(mechanism, names_of(mechanism)).compile()
    found = {
        tuple(sorted(model.geom(int(g)).name for g in pair))
        for pair in zip(model.pair_geom1, model.pair_geom2, strict=True)
    }
    assert len(found) == 5
    assert ("left_distal_phalanx_bone", "right_distal_phalanx_bone") in found
    assert model.pair_friction[-1, 0] == pytest.approx(0.3)
