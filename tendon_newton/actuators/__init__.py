"""Actuator models: one file each, one line each in the table."""

from tendon_newton.actuators.actuator_type import Actuator
from tendon_newton.actuators.ideal import Ideal
from tendon_newton.actuators.ideal_position import IdealPosition
from tendon_newton.actuators.learned import Learned
from tendon_newton.actuators.measured_path import MeasuredPath
from tendon_newton.actuators.pd_torque import PdTorque
from tendon_newton.actuators.pwm_servo import PwmServo
from tendon_newton.errors import NameTable

ACTUATORS = NameTable[type[Actuator]](
    "actuator",
    {
        "ideal": Ideal,
        "pwm_servo": PwmServo,
        "pd_torque": PdTorque,
        "ideal_position": IdealPosition,
        "measured_path": MeasuredPath,
        "learned": Learned,
    },
)


def find_actuator(kind: str) -> type[Actuator]:
    """Return an actuator model; an unknown name is refused."""
    return ACTUATORS[kind]


__all__ = ["ACTUATORS", "Actuator", "find_actuator"]
