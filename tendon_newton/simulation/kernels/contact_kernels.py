"""The kernel that reads how hard links press against obstacles."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import CONTACT_TABLE, CONTACTS, real
from tendon_newton.device_code.structs import Drive, Mechanism, NewtonJoints, Servo
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.contact.contacts import WITHIN, grip_at, pose_at
from tendon_newton.simulation.kernels.control_kernels import resumed


@device_template
def contact_kernel(
    mechanism: Mechanism, servo: Servo, given: NewtonJoints, force: wp.array3d[wp.vec3f]
) -> None:
    """Add up what obstacles do to each capsule [N], in the axes of the base."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    drive = Drive()
    drive.world = i
    drive.memory = servo.memory[i]
    here = resumed(drive, servo, given, i)
    pose = pose_at(mechanism, i, here.q)
    count = int(CONTACTS)
    for contact in range(count):
        own = grip_at(mechanism, here, pose, contact, real(WITHIN))
        capsule = CONTACT_TABLE[contact, 0]
        obstacle = CONTACT_TABLE[contact, 1]
        pushed = wp.vec3f(
            wp.float32(own.force[0]), wp.float32(own.force[1]), wp.float32(own.force[2])
        )
        if capsule >= 0:
            force[i, capsule, obstacle] = force[i, capsule, obstacle] + pushed
