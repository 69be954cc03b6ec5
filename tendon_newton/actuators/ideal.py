"""The nominal actuator: a force source in proportion to the position error."""

from tendon_newton.actuators.actuator_type import Actuator, Jet, Parameter, ParameterVector, Tendon


class Ideal(Actuator):
    r"""A servo without inertia, friction or delay.

    .. math:: F = P\,(\theta_d - \theta)

    Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), eq. 2:
    P = 4.2 N/rad for an XC330 on a 12.5 mm spool.
    """

    stiffness = "gain"
    parameters = (
        Parameter("gain", "N/rad", null=0.0, nominal=4.2, lower=0.1, upper=100.0).since(
            "measured at 4.2 N/rad by the paper's authors"
        ),
    )

    @staticmethod
    def force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """F = P (theta_d - theta)."""
        return error * p[0]
