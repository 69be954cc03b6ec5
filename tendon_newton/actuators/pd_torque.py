"""A joint drive that gives torque by position and speed: motors of quadrupeds and cobots."""

from collections.abc import Mapping

from tendon_newton.actuators.actuator_type import (
    Actuator,
    Jet,
    Parameter,
    ParameterVector,
    Tendon,
    real,
)


class PdTorque(Actuator):
    r"""Torque in proportion to the position error, less what speed damps.

    .. math:: \tau = \operatorname{clip}(k_p (\theta_d - \theta) - k_d \dot\theta, \pm \tau_{max}),
        \qquad F = \tau / r

    The current loop is taken for perfect: back-EMF and supply do not show. The rotor of inertia J
    stands between that torque and the load, as in pwm_servo; a drive's log states the torque of the
    motor, in front of its rotor.

    Source: Katz, A low cost modular actuator for dynamic robots (2018); the joint commands (q, kp,
    kd, tau) of Unitree's and MIT's motor drivers.
    """

    rotor = True
    doubtful = ("kd", "armature")
    parameters = (
        Parameter("kp", "N m/rad", null=0.0, nominal=20.0, lower=0.0, upper=2.0e4).since(
            "20 to 100 N m/rad for legs of 12 to 30 kg; thousands for arms and carts"
        ),
        Parameter("kd", "N m s/rad", null=0.0, nominal=0.5, lower=0.0, upper=2.0e3).since(
            "0.5 to 2 N m s/rad are usual beside it"
        ),
        Parameter("max_torque", "N m", null=0.0, nominal=20.0, lower=0.01, upper=1000.0).since(
            "24 N m of a Go1's hip; a few hundred in humanoids"
        ),
        Parameter("armature", "kg m2", null=0.0, nominal=0.005, lower=0.0, upper=1.0).since(
            "rotor inertia of some 1e-4 kg m2 times the square of a gear ratio of 6 to 10"
        ),
    )

    @classmethod
    def static_force(cls, values: Mapping[str, float | str], error: float, radius: float) -> float:
        """F = k_p e / r at rest."""
        torque = min(float(values["kp"]) * error, float(values["max_torque"]))
        return torque / radius

    @staticmethod
    def force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """F = clip(k_p (theta_d - theta) - k_d theta_dot) / r."""
        torque = error * p[0] - tendon.angle_rate * p[1]
        if torque[0] > p[2]:
            torque = Jet(p[2], real(0.0), real(0.0))
        if torque[0] < -p[2]:
            torque = Jet(-p[2], real(0.0), real(0.0))
        return torque * (tendon.enabled / tendon.spool_radius)

    @staticmethod
    def armature(p: ParameterVector) -> real:
        """Inertia of the rotor at the spool [kg m2]."""
        return p[3]
