"""The kernel that reads how hard links press against obstacles."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import DeviceArray, DeviceGrid, Placeholder, real
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.contact.contacts import WITHIN, grip_at
from tendon_newton.simulation.kernels.control_kernels import resume

Drive = Placeholder
Mechanism = Placeholder
Servo = Placeholder
contact_pose: Any = None
CONTACT_TABLE: Any = None
CONTACTS = 0


@device_template
def contact_kernel(
    mechanism: Mechanism,
    servo: Servo,
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    q_in: DeviceArray[wp.float32],
    v_in: DeviceArray[wp.float32],
    force: wp.array3d[wp.vec3f],
) -> None:
    """Add up what obstacles do to each capsule [N], in the axes of the base."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    drive = Drive()
    drive.memory = servo.memory[i]
    q = resume(servo.q[i], q_in, position_index, i)
    v = resume(servo.v[i], v_in, velocity_index, i)
    pose = contact_pose(mechanism, i, q)
    count = int(CONTACTS)
    for contact in range(count):
        own = grip_at(mechanism, i, drive, pose, contact, v, real(WITHIN))
        capsule = CONTACT_TABLE[contact, 0]
        obstacle = CONTACT_TABLE[contact, 1]
        pushed = wp.vec3f(
            wp.float32(own.force[0]), wp.float32(own.force[1]), wp.float32(own.force[2])
        )
        force[i, capsule, obstacle] = force[i, capsule, obstacle] + pushed
