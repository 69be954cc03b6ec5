"""The nominal servo where only positions are known: it is where it was told to be, load aside."""

from tendon_newton.actuators.actuator_type import Actuator, Parameter


class IdealPosition(Actuator):
    r"""A servo whose shaft follows its command at once, and gives way to what loads it.

    .. math:: \theta = \theta_d + s\,\tau

    For a bench without a load cell. Where a recording has no ``joint_load`` the load tau is 0, and
    so is the compliance s where a model leaves it out. Effects act on the position: a delay of the
    command, a lag, a deadband, play, a bound on speed, an offset.

    Source: what a simulation without actuator models assumes of a position-controlled joint; the
    sag of a loop without an integral part is the load over its gain.
    """

    parameters = (
        Parameter(
            "compliance", "rad/(N m)", null=0.0, nominal=0.08, lower=0.0, upper=1.0, optional=True
        ).since("an STS3215 sags by 0.175 rad/(N m) at its gain 4, by 0.0155 at 32"),
    )
    kinematic = True
