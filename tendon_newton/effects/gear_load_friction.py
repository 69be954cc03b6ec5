"""Gear friction that grows with what presses its teeth from both sides."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values
from tendon_newton.effects.loaded_gear import gear_loaded


class GearLoadFriction(Effect):
    r"""Friction in proportion to the torques of motor and load together, which press on the gear.

    .. math:: F = F_m - C s - K\,|F_m + F|\,s \ \Rightarrow\
        F = \frac{(1 - K s')\,F_m - C s}{1 + K s'}, \qquad s' = s \operatorname{sign}(F_m + F)

    C is all other friction. Without it a motor that winds in gives :math:`F_m (1 - K) / (1 + K)` to
    the tendon, and holds :math:`F_m (1 + K) / (1 - K)` while it is driven backwards.

    Source: Duclusaud et al., Extended Friction Models for the Physics Simulation of Servo Actuators
    (2025), model M3: K |tau_external - tau_motor|, where the load's torque opposes the motor's.
    Validity: gears that can be driven backwards. Their program takes gravity's torque for the
    load's, here it is the whole output's: the same at constant speed. Behind a string F_m + F
    counts as pulling, so that friction is linear there. That is wrong only where a motor is driven
    out by less than half of C, by 2 K C at most.
    Signature: that of load_dependent_friction with 2 K / (1 + K^2) for a motor that is weaker by
    (1 - K^2) / (1 + K^2).
    Confused with: load_dependent_friction, wherever the motor's gain is not known.
    """

    side = "actuator"
    confused = ("load_dependent_friction",)
    dry = ("coefficient",)
    parameters = (
        Parameter("coefficient", "1", null=0.0, nominal=0.1, lower=0.0, upper=0.8).since(
            "0 to 0.22 in the parameter files published with the source; at one it locks"
        ),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = ((1 - K s') F_m - C s) / (1 + K s')."""
        return gear_loaded(force, values[0], tendon)
