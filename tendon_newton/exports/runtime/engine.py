"""MuJoCo as the runtime's files see it here; a written program imports its own."""

from typing import Any

from tendon_newton.mechanisms.authoring.mujoco_file import newton_s_mujoco

mujoco: Any = newton_s_mujoco()
