"""Obstacles as an asset gives them, and as Newton's model holds them."""

from pathlib import Path
from typing import Any

import newton
import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import Box, Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tests.physics.contact.contacts import ball, block, floor

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
def test_what_cannot_be_an_obstacle_is_named(
    more: str, wrong: str, words: str, tmp_path: Path
) -> None:
    """The prim, and what one is."""
    with pytest.raises(InvalidAsset, match=words):
        load_mechanism(layer(tmp_path, more=more, wrong=wrong))


def contact_pairs(mechanism: Mechanism) -> set[tuple[str, str]]:
    """Return the labels of what Newton lets collide in one world."""
    model = build_model(mechanism, 1, device="cpu")
    pairs = model.shape_contact_pairs
    assert pairs is not None
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
