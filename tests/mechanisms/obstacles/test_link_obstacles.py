"""Links that are obstacles to each other, as an asset and a program name them."""

from pathlib import Path

import pytest

from tendon_newton.errors import InvalidAsset, InvalidParameter, UnknownName
from tendon_newton.mechanisms.authoring.mujoco_file import names_of, scene_spec
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import LinkObstacle, Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.model.chain_copies import copies_of
from tests.physics.contact.pinches import pinch, write_pinch

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
    assert pairs is not None
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
def test_wrong_names_of_links_are_refused(
    obstacles: list[LinkObstacle], kind: type[Exception], words: str, tmp_path: Path
) -> None:
    """What came, and what there is."""
    with pytest.raises(kind, match=words):
        load_mechanism(write_pinch(tmp_path)).with_obstacles(*obstacles)


def test_a_single_finger_has_no_link_to_meet() -> None:
    """Links of one finger carry each other, and do not meet."""
    with pytest.raises(InvalidParameter, match="no link of another finger"):
        load_mechanism("finger").with_obstacles(LinkObstacle(link="distal_phalanx"))


def test_a_mark_that_leads_nowhere_is_refused(tmp_path: Path) -> None:
    """The asset's file is named, and the name that is unknown."""
    target = MET_BY % "/pinch/right/thumb"
    with pytest.raises(InvalidAsset, match=r"pinch\.usda.*No link with a capsule.*thumb"):
        load_mechanism(write_pinch(tmp_path, left=MARK % target))


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
