"""The nominal actuator: a force source in proportion to the position error."""

from collections.abc import Mapping

from tendon_newton.actuators.actuator_type import Actuator, Jet, Parameter, ParameterVector, Tendon

VOLTAGE = 7.4  # [V] of a hobby servo; another scales its two constants and no force
FASTEST, RUN_UP = 6.0, 0.03
"""Speed [rad/s] of such a servo without a load, and time [s] in which it gets there."""


class Ideal(Actuator):
    r"""A servo without inertia, friction or delay.

    .. math:: F = P\,(\theta_d - \theta)

    Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), eq. 2:
    P = 4.2 N/rad for an XC330 on a 12.5 mm spool.
    """

    stiffness = "gain"
    gives_way = True
    parameters = (
        Parameter("gain", "N/rad", null=0.0, nominal=4.2, lower=0.1, upper=100.0).since(
            "measured at 4.2 N/rad by the paper's authors"
        ),
    )

    @classmethod
    def richer(
        cls, values: Mapping[str, float | str], force_limit: float, radius: float
    ) -> tuple[str, dict[str, float]] | None:
        """Return a motor of the same gain and stall torque, with back EMF and a rotor."""
        torque = force_limit * radius
        constant = VOLTAGE / FASTEST
        return "pwm_servo", {
            "duty_per_rad": float(values["gain"]) / force_limit,
            "max_duty": 1.0,
            "supply_voltage": VOLTAGE,
            "torque_constant": constant,
            "resistance": constant * VOLTAGE / torque,
            "armature": RUN_UP * torque / FASTEST,
        }

    @staticmethod
    def force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """F = P (theta_d - theta)."""
        return error * p[0]
