"""``asset show --window``: Newton's own viewer, with the mechanism closing and opening."""

from itertools import count
from typing import Any

import newton
import numpy as np

from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import closing_path
from tendon_newton.mechanisms.worlds import build_model

FRAME_RATE = 60.0  # Frames per second


def show_in_window(mechanism: Mechanism) -> None:
    """Open a window and let the mechanism close and open until it is shut."""
    from newton.viewer import ViewerGL

    play(mechanism, ViewerGL())


def play(mechanism: Mechanism, viewer: Any) -> None:
    """Show a mechanism on its way along the equilibria, there and back, until the viewer ends."""
    positions = closing_path(mechanism).joint_position
    there_and_back = np.concatenate([positions, positions[::-1]]).astype(np.float32)
    model = build_model(mechanism, 1, device="cpu")
    state: Any = model.state()
    joints = state.joint_q.numpy().copy()  # a free body's stand behind the mechanism's
    viewer.set_model(model)
    for number in count():
        if not viewer.is_running():
            break
        joints[: positions.shape[1]] = there_and_back[number % len(there_and_back)]
        state.joint_q.assign(joints)
        newton.eval_fk(model, state.joint_q, state.joint_qd, state)
        viewer.begin_frame(number / FRAME_RATE)
        viewer.log_state(state)
        viewer.end_frame()
    viewer.close()
