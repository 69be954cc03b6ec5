"""Obstacles in an MJCF file: what stays, what moves, and which shapes meet.

Contacts are pairs that are named one by one, so that the file has those of our own solver and no
others: each link's capsules with each obstacle, links that may meet, what moves with what stays.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.meetings import bones_of
from tendon_newton.mechanisms.geometry.obstacles import Obstacle
from tendon_newton.mechanisms.obstacle_shapes import USUAL_FORCE, quaternion

# Share of a contact's acceleration that MuJoCo's constraint decides [1], at any depth
IMPEDANCE = 0.9
# How much harder friction is than the push [1]: what sticks creeps by less than 1 mm/s at 1 N
IMPRATIO = 100.0
# Time in which friction brings a creep to rest [s]; MuJoCo asks for two steps at least
FRICTION_TIME = 2.0e-3
# Colours of what stays and of what moves
RGBA = {False: [0.85, 0.87, 0.90, 1.0], True: [0.80, 0.30, 0.24, 1.0]}


def add_obstacles(spec: Any, mechanism: Mechanism, bones: Sequence[Any], mujoco: Any) -> None:
    """Add a mechanism's obstacles and their contacts to MuJoCo's editable model.

    `bones` are the geoms of the capsules that its links carry; each has a name.
    """
    if not mechanism.obstacles:
        return
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = IMPRATIO
    things = [
        (obstacle, _add_geom(spec, obstacle, place, mujoco))
        for place, obstacle in enumerate(mechanism.obstacles)
        if obstacle.shape != "capsule"
    ]
    compiled = spec.compile()
    lightness = {  # by how much a force moves each body, as MuJoCo weighs contacts [1/kg]
        compiled.body(body).name: float(compiled.body_invweight0[body, 0])
        for body in range(compiled.nbody)
    }
    for obstacle, geom in things:
        for bone in bones:
            _add_pair(spec, obstacle, obstacle.friction, (geom, bone), lightness)
    own = dict(zip((b.shape for b in bones_of(mechanism.template)), bones, strict=True))
    for meeting in mechanism.meetings:
        link = mechanism.obstacles[meeting.obstacle]
        for shape in meeting.met_by:
            pair = (own[meeting.shape], own[shape])
            _add_pair(spec, link, link.friction, pair, lightness)
    for body, geom in things:
        for fixed, other in things:
            if body.mass is not None and fixed.mass is None:
                friction = min(body.friction, fixed.friction)
                _add_pair(spec, body, friction, (geom, other), lightness)


def _add_geom(spec: Any, obstacle: Obstacle, place: int, mujoco: Any) -> Any:
    """Add the shape of an obstacle, on a body of its own if it moves."""
    kinds = mujoco.mjtGeom
    kind = {"sphere": kinds.mjGEOM_SPHERE, "box": kinds.mjGEOM_BOX, "plane": kinds.mjGEOM_PLANE}[
        obstacle.shape
    ]
    where = {"pos": obstacle.position, "quat": _turned(obstacle.rotation)}
    body = spec.worldbody
    name = f"obstacle_{place}"
    if obstacle.mass is not None:
        name = "ball" if obstacle.shape == "sphere" else "block"
        body = body.add_body(name=name, **where)
        body.add_freejoint(name=name)
        where = {}
    size = [0.0, 0.0, 0.01] if obstacle.shape == "plane" else obstacle.size
    return body.add_geom(
        name=name,
        type=kind,
        size=size,
        contype=0,
        conaffinity=0,
        mass=obstacle.mass or 0.0,  # of a solid, as an obstacle's inertia is
        rgba=RGBA[obstacle.mass is not None],
        **where,
    )


def _turned(rotation: Array) -> Array:
    """Return the quaternion (w, x, y, z) of a rotation matrix."""
    x, y, z, w = quaternion(rotation)
    return np.array([w, x, y, z], dtype=np.float64)


def _add_pair(
    spec: Any,
    material: Obstacle,
    friction: float,
    geoms: tuple[Any, Any],
    lightness: dict[str, float],
) -> None:
    r"""Let two geoms meet, as stiff as the obstacle says.

    MuJoCo's contact at rest is a spring of :math:`k d / ((1 - d) w)` with the impedance :math:`d`,
    the reference's stiffness :math:`k / d` and the sum :math:`w` of both bodies' lightness.
    The damper is as strong as ours at `USUAL_FORCE`.
    """
    weight = (1.0 - IMPEDANCE) * sum(lightness[geom.parent.name] for geom in geoms)
    stiffness = weight * material.stiffness
    damping = weight * material.dissipation * USUAL_FORCE
    spec.add_pair(
        geomname1=geoms[0].name,
        geomname2=geoms[1].name,
        condim=3,
        friction=[friction, friction, 0.0, 0.0, 0.0],
        solref=[-stiffness, -damping],
        solreffriction=[FRICTION_TIME, 1.0],
        solimp=[IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0],
    )
