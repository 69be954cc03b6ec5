"""Our contacts for SolverMuJoCo, through Newton's own collision pipeline."""

from __future__ import annotations

from typing import Any

import newton
import numpy as np
from newton.solvers import SolverMuJoCo

# Newton's ``solref_mode`` in which stiffness and damping of a shape are [N/m] and [N s/m]
FORCE_SPACE = 0
# MuJoCo's `solimp` with which a contact is a spring and a damper also in motion; by its default it
# gives way as if the link were as heavy as a body, and lets light links pass
SOFTNESS = (0.01, 0.01, 1.0e-3, 0.5, 2.0)
SLIP_RATIO = 1.0e4  # MuJoCo's ``impratio`` [1]: how much less friction creeps than a contact gives


class MujocoContacts:
    """Contacts of a model's links with its obstacles; none where it has no obstacles.

    Newton's stiffness per shape is that of ours. Its damping is linear, as much as ours at a
    newton (`obstacle_shapes.USUAL_FORCE`). By MuJoCo's priorities one material of two counts: that
    of an obstacle before that of a link which is one, and that before another link's.
    """

    def __init__(self, model: Any) -> None:
        self._found: Any = None
        self._pipeline: Any = None
        if not hasattr(model.tendon, "obstacle_shape"):
            return
        own = model.mujoco
        modes, ranks, given = (
            array.numpy() for array in (own.solref_mode, own.geom_priority, own.geom_solimp)
        )
        shapes = [model.tendon.obstacle_shape.numpy(), model.tendon.bone_shape.numpy()]
        modes[np.concatenate(shapes)] = FORCE_SPACE
        count = len(shapes[0]) // model.world_count
        order = count - np.arange(len(shapes[0])) % count  # the first counts between two links
        ranks[shapes[0]] = np.where(np.isin(shapes[0], shapes[1]), order, count + 1)
        given[shapes[0]] = SOFTNESS
        own.solref_mode.assign(modes)
        own.geom_priority.assign(ranks)
        own.geom_solimp.assign(given)
        self._pipeline = newton.CollisionPipeline(model)
        self._found = self._pipeline.contacts()

    def find(self, state: newton.State) -> newton.Contacts | None:
        """Return the contacts of a state; the same object every time."""
        if self._pipeline is not None:
            self._pipeline.collide(state, self._found)
        return self._found


def solver_with_contacts(model: Any) -> SolverMuJoCo:
    """Return a solver for a model, which takes contacts where it has obstacles."""
    if not hasattr(model.tendon, "obstacle_shape"):
        return SolverMuJoCo(model, disable_contacts=True)
    return SolverMuJoCo(model, use_mujoco_contacts=False, cone="elliptic", impratio=SLIP_RATIO)
