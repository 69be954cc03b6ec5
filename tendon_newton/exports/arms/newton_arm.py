"""An arm as Newton reads it, replayed by the MuJoCo model that its SolverMuJoCo makes of it."""

from collections.abc import Sequence
from typing import Any

import newton
import numpy as np
from newton.solvers import SolverMuJoCo

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.data.recording import Array
from tendon_newton.exports.arms.replaying import angles_of
from tendon_newton.exports.arms.servo_springs import ServoSpring
from tendon_newton.mechanisms.authoring.mujoco_file import TIME_STEP
from tendon_newton.mechanisms.usd.usd_asset import adopt_orphans


def driven_builder() -> Any:
    """Return an empty builder that takes what files say to MuJoCo."""
    builder = newton.ModelBuilder()
    SolverMuJoCo.register_custom_attributes(builder)
    return builder


def replay_builder(builder: Any, springs: Sequence[ServoSpring], motion: ArmMotion) -> Array:
    """Replay a motion of an arm that a builder has read, by position drives on its joints.

    Returns:
        What the encoders report [rad], shape (T, J).
    """
    adopt_orphans(builder, "arm")
    model = builder.finalize(device="cpu")
    solver: Any = SolverMuJoCo(model, disable_contacts=True, use_mujoco_cpu=True)
    theirs = solver.mj_model
    theirs.opt.timestep = TIME_STEP
    called = {label.rsplit("/")[-1]: label.replace("/", "_") for label in builder.joint_label}
    names = [called[spring.joint.name] for spring in springs]
    offsets = np.array([spring.offset for spring in springs])
    return angles_of(theirs, motion, names, np.ones(len(springs)), -offsets)
