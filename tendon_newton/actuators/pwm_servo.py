"""A DC motor behind the position loop of a servo's firmware."""

from collections.abc import Mapping

from tendon_newton.actuators.actuator_type import (
    Actuator,
    Jet,
    Parameter,
    ParameterVector,
    Tendon,
    real,
)
from tendon_newton.device_code.templates import device_template


@device_template
def motor_force(duty: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return the force [N] of a motor at a duty, which the firmware limits."""
    limited = duty
    if duty[0] > p[1]:
        limited = Jet(p[1], real(0.0), real(0.0))
    if duty[0] < -p[1]:
        limited = Jet(-p[1], real(0.0), real(0.0))
    supply = p[2]
    if tendon.voltage > real(0.0):
        supply = tendon.voltage
    current = (limited * supply - tendon.angle_rate * p[3]) * (tendon.enabled / p[4])
    return current * (p[3] / tendon.spool_radius)


class PwmServo(Actuator):
    r"""Position error to duty cycle, duty cycle to current, current to torque.

    .. math::
        u = \operatorname{clip}(k_u (\theta_d - \theta) + u_0, \pm u_{max}), \qquad
        \tau = \frac{k_t (u V - k_t \dot\theta)}{R}, \qquad F = \tau / r

    A loop may always add a duty u_0 that keeps the tendon taut.
    The winding's inductance is neglected. The rotor of inertia J takes a part of the motor's force:
    the load cell behind the rotor reads :math:`F - (J / r^2)\,\ddot s` less the gear's friction,
    with s the length of string on the spool.

    Source: any text on DC motors; the loop as in the Dynamixel e-manual (PWM = P-gain / 128 counts
    per count of error).
    """

    rotor = True
    modulated = True
    doubtful = ("torque_constant", "resistance", "armature")
    parameters = (
        Parameter("duty_per_rad", "1/rad", null=0.0, nominal=1.0, lower=0.01, upper=100.0).since(
            "Dynamixel X position P-gain registers 50 to 5,000"
        ),
        Parameter("max_duty", "1", null=0.0, nominal=1.0, lower=0.01, upper=1.0).since("full duty"),
        Parameter("supply_voltage", "V", null=0.0, nominal=5.0, lower=3.0, upper=30.0).since(
            "hobby servos run on 3.5 to 24 V"
        ),
        Parameter(
            "torque_constant",
            "N m/A",
            null=0.0,
            nominal=0.4,
            lower=0.01,
            upper=10.0,
            tolerance=0.15,
        ).since("stall torque over stall current of hobby servos, at the output shaft"),
        Parameter(
            "resistance", "ohm", null=0.0, nominal=3.0, lower=0.1, upper=100.0, tolerance=0.15
        ).since("supply over stall current of hobby servos"),
        Parameter("armature", "kg m2", null=0.0, nominal=0.002, lower=0.0, upper=0.1).since(
            "rotor inertia times the square of a gear ratio of 100 to 400"
        ),
        Parameter(
            "duty_offset", "1", null=0.0, nominal=0.0, lower=-0.5, upper=0.5, optional=True
        ).since("0.02 on the paper's bench; a loop that adds more than half drives, not holds"),
    )

    @classmethod
    def static_force(cls, values: Mapping[str, float | str], error: float, radius: float) -> float:
        """F = k_t u V / (R r) at rest."""
        known = {name: float(value) for name, value in values.items() if name != "file"}
        asked = known["duty_per_rad"] * error + known.get("duty_offset", 0.0)
        duty = min(asked, known["max_duty"])
        current = duty * known["supply_voltage"] / known["resistance"]
        return known["torque_constant"] * current / radius

    @staticmethod
    def force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """F = k_t (u V - k_t theta_dot) / (R r)."""
        return motor_force(error * p[0] + Jet(p[6], real(0.0), real(0.0)), tendon, p)

    @staticmethod
    def duty(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """Return u = k_u (theta_d - theta) + u_0."""
        return error * p[0] + Jet(p[6], real(0.0), real(0.0))

    @staticmethod
    def driven(duty: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """F = k_t (u V - k_t theta_dot) / (R r)."""
        return motor_force(duty, tendon, p)

    @staticmethod
    def current(force: real, tendon: Tendon, p: ParameterVector) -> real:
        """I = F r / k_t."""
        return force * tendon.spool_radius / p[3]

    @classmethod
    def draw(cls, values: Mapping[str, float | str], radius: float) -> float:
        """I / F = r / k_t."""
        return radius / float(values["torque_constant"])

    @staticmethod
    def armature(p: ParameterVector) -> real:
        """Inertia of rotor and gear at the spool [kg m2]."""
        return p[5]
