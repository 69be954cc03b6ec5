"""Whole arms carried into other programs: one line each in the table."""

from tendon_newton.exports.arms.arm_target import ArmTarget
from tendon_newton.exports.arms.mujoco_arm import MUJOCO_ARM
from tendon_newton.exports.arms.urdf_arm import URDF_ARM
from tendon_newton.exports.arms.usd_arm import USD_ARM

ARM_EXPORTS: dict[str, ArmTarget] = {"mujoco": MUJOCO_ARM, "usd": USD_ARM, "urdf": URDF_ARM}
