"""What a joint's own spring and damper do."""

from tendon_newton.device_code.placeholders import Jet, ParameterVector, real
from tendon_newton.device_code.slots import damping_effects, spring_effects
from tendon_newton.device_code.structs import Joint
from tendon_newton.device_code.templates import device_template


@device_template
def spring_torque(joint: Joint, p: ParameterVector) -> Jet:
    """Return the torque of a joint's return spring [N m]."""
    torque = Jet(-joint.stiffness * (joint.position - joint.rest), -joint.stiffness, real(0.0))
    return spring_effects(torque, joint, p)


@device_template
def damping_torque(joint: Joint, p: ParameterVector) -> Jet:
    """Return the torque of a joint's viscous damping [N m]."""
    torque = Jet(-joint.damping * joint.velocity, real(0.0), -joint.damping)
    return damping_effects(torque, joint, p)
