"""A shaft that is where it was measured: what it takes to hold it there is asked."""

from tendon_newton.actuators.actuator_type import Actuator, Parameter


class MeasuredPath(Actuator):
    r"""A motor that takes its shaft along a measured path, whatever that takes.

    .. math:: \theta(t) = \theta_{measured}(t), \qquad
        \frac{dz}{d\theta} = \frac{1}{x_0} (1 - z \operatorname{sign} \dot\theta), \qquad
        q_{read} = q + s\,\tau

    The force at the shaft and the angle q of the joint follow from the path, from the load tau on
    the joint, and from its masses, springs and frictions. The side z on which the shaft's friction
    acts turns over within the travel x_0, at once where that is 0.
    The joint's encoder may sit behind its load, on a coupling that gives by the twist s.

    Source: Dahl, A solid friction model (1968), with an exponent of 1, for z; Hooke (1678) for s.
    """

    parameters = (
        Parameter(
            "travel",
            "rad",
            null=0.0,
            nominal=0.002,
            lower=1.0e-4,
            upper=0.05,
            absolute=True,
            optional=True,
        ).since("from a tenth of a count of an encoder of 4096 a turn to the play of a gear"),
        Parameter(
            "twist", "rad/(N m)", null=0.0, nominal=0.5, lower=0.0, upper=5.0, optional=True
        ).since("couplings and torque sensors of benches of 0.1 N m"),
    )
    kinematic = True
    leads = True
