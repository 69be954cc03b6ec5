"""Which links of a mechanism may meet: those that are obstacles, and what presses against them."""

from collections.abc import Sequence
from dataclasses import dataclass

import newton

from tendon_newton.errors import InvalidParameter, unknown_name
from tendon_newton.mechanisms.geometry.joint_frames import ancestors
from tendon_newton.mechanisms.geometry.obstacles import LinkObstacle, Obstacle


@dataclass(frozen=True, kw_only=True)
class Bone:
    """A capsule that a link carries."""

    shape: int  # Number among the shapes of a world
    link: int  # Link that carries it
    prim: str  # Path of its prim in the asset
    link_prim: str  # Path of the link's

    def is_called(self, name: str) -> bool:
        """Tell whether its path, or that of its link, ends with a name."""
        end = f"/{name.strip('/')}"
        return self.prim.endswith(end) or self.link_prim.endswith(end)


@dataclass(frozen=True, kw_only=True)
class Meeting:
    """One capsule that is an obstacle to others."""

    obstacle: int  # Number among the obstacles
    shape: int  # Number among the shapes of a world
    # Shapes of the capsules that may press against it; a pair of obstacles stands with the first of
    # them
    met_by: tuple[int, ...]


def bones_of(template: newton.ModelBuilder) -> list[Bone]:
    """Return the capsules that the links of one world carry, in the order of its shapes."""
    return [
        Bone(
            shape=shape,
            link=template.shape_body[shape],
            prim=template.shape_label[shape],
            link_prim=template.body_label[template.shape_body[shape]],
        )
        for shape, kind in enumerate(template.shape_type)
        if kind == newton.GeoType.CAPSULE and template.shape_body[shape] >= 0
    ]


def find_meetings(
    template: newton.ModelBuilder, obstacles: Sequence[Obstacle]
) -> tuple[Meeting, ...]:
    """Return which capsules may meet, each pair of them once.

    The template is one world of the mechanism alone.

    Raises:
        InvalidParameter: A link is named that cannot meet another.
        UnknownName: No link has such a name.
    """
    bones, parents = bones_of(template), tuple(template.joint_parent)
    found: list[Meeting] = []
    for number, obstacle in enumerate(obstacles):
        if not isinstance(obstacle, LinkObstacle):
            continue
        own = _the_bone(bones, obstacle.link)
        earlier = {meeting.shape: meeting.met_by for meeting in found}
        if own.shape in earlier:
            raise InvalidParameter(f"the link {obstacle.link!r} is an obstacle twice; say so once")
        below = ancestors(parents, own.link)  # neither of two links that meet carries the other
        apart = (bone for bone in bones if own.link not in ancestors(parents, bone.link))
        others = [bone for bone in apart if bone.link not in below]
        if obstacle.met_by:
            others = _called(bones, others, obstacle)
        if not others:
            raise InvalidParameter(
                f"the link {obstacle.link!r} has no link of another finger that could meet it"
            )
        shapes = [bone.shape for bone in others if own.shape not in earlier.get(bone.shape, ())]
        found.append(Meeting(obstacle=number, shape=own.shape, met_by=tuple(shapes)))
    return tuple(found)


def _the_bone(bones: Sequence[Bone], name: str) -> Bone:
    """Return the one capsule of a name."""
    own = [bone for bone in bones if bone.is_called(name)]
    if not own:
        raise unknown_name("link with a capsule", name, _short_names(bones))
    if len(own) > 1:
        raise InvalidParameter(
            f"{name!r} must name one capsule; it names {', '.join(bone.prim for bone in own)}"
        )
    return own[0]


def _called(bones: Sequence[Bone], others: Sequence[Bone], obstacle: LinkObstacle) -> list[Bone]:
    """Return those of other capsules that an obstacle says may meet it."""
    for name in obstacle.met_by:
        if not any(bone.is_called(name) for bone in bones):
            raise unknown_name("link with a capsule", name, _short_names(bones))
        if not any(bone.is_called(name) for bone in others):
            raise InvalidParameter(
                f"links of different fingers meet; {name!r} and {obstacle.link!r} are of one"
            )
    return [bone for bone in others if any(bone.is_called(name) for name in obstacle.met_by)]


def _short_names(bones: Sequence[Bone]) -> list[str]:
    """Return the paths of links below the asset's root."""
    return [bone.link_prim.strip("/").split("/", maxsplit=1)[-1] for bone in bones]
