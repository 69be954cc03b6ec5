"""Gear friction that grows with what the gear gives."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real
from tendon_newton.effects.loaded_gear import load_side


class LoadDependentFriction(Effect):
    r"""Friction in proportion to the tension: the output's load alone presses on the gear.

    .. math:: F = F_m - \mu |F| s \ \Rightarrow\ F = \frac{F_m}{1 + \mu\,s\,\operatorname{sign} F_m}

    Source: a gear's loss counted at its output; Duclusaud et al., Extended Friction Models for the
    Physics Simulation of Servo Actuators (2025), model M5 with the external torque's coefficient
    alone. Their load friction in general counts the motor's torque too: gear_load_friction.
    Validity: gears that can be driven backwards; see holding_friction for those that cannot.
    Signature: the loop between winding in and out opens like a fan with the force.
    Confused with: gear_load_friction, wherever the motor's gain is not known; routing_friction (the
    load cell sits between them); coulomb_friction over a narrow range of forces.
    """

    side = "actuator"
    confused = ("coulomb_friction", "gear_load_friction", "routing_friction")
    dry = ("coefficient",)
    parameters = (
        Parameter("coefficient", "1", null=0.0, nominal=0.1, lower=0.0, upper=0.8).since(
            "hobby servos lose 10-40 % of their torque in the gear"
        ),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m / (1 + mu s sign F_m)."""
        opposing = values[0] * load_side(force[0], tendon)
        return force * (real(1.0) / (real(1.0) + opposing))
