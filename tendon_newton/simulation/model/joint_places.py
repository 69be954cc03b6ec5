"""Where the joints of each world stand among Newton's joint coordinates."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.simulation.model.mechanism_arrays import body_joints, moving_joints


def joint_places(model: Any) -> tuple[Any, Any]:
    """Return the places of positions and of velocities on the model's device, each shape (W, J)."""
    return starts_of(model, moving_joints(model))


def body_places(model: Any) -> tuple[Any, Any]:
    """Return where each free body's positions and velocities begin, each shape (W,)."""
    return starts_of(model, body_joints(model))


def starts_of(model: Any, joints: Any) -> tuple[Any, Any]:
    """Return where positions and velocities of some joints begin, on the model's device."""
    positions, velocities = (
        wp.array(starts.numpy()[joints], dtype=wp.int32, device=model.device)
        for starts in (model.joint_q_start, model.joint_qd_start)
    )
    return positions, velocities


def write_joints(target: Any, places: Any, values: Any) -> None:
    """Write numbers of all joints, (W,) vectors of J, to one of Newton's arrays."""
    out = target.numpy()
    out[places.numpy().ravel()] = values.numpy().ravel()
    target.assign(out)
