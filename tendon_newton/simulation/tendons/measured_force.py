"""A mechanism driven by the force that its load cell read, where no command was recorded.

The cell stands between spool and mechanism: what pulled is what it read, less its own errors. The
sensor's effects are undone here, and the servo's have no place. A bench without springs has no
string that a cell could sit on: its force is the motor's, whose friction comes after it.
"""

from tendon_newton.data.recording import BenchOverrides
from tendon_newton.device_code.placeholders import Jet, ParameterVector, real
from tendon_newton.device_code.slots import cell_clock_effects, cell_effects
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.effects import EFFECTS, Stage
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism

FRICTIONS = ("viscous_friction", "coulomb_friction")
"""Frictions of a drive that may lie behind the point where its force was taken.

Stribeck's law is left out: without a spring it takes the place of both, and of their sum.
"""
COMMANDED = ("tendon_slack", "backlash")  # Effects outside the servo that act through its command


@device_template
def true_tension(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return the tension [N] at which the cell reads what it read (`tendon.command`)."""
    zero = cell_effects(real(0.0), tendon.time, tendon.index, p)
    slope = cell_effects(real(1.0), tendon.time, tendon.index, p) - zero
    return Jet((tendon.command - zero) / slope, real(0.0), real(0.0))


@device_template
def no_armature(p: ParameterVector) -> real:
    """Behind the load cell no rotor is felt [kg m2]."""
    return real(0.0)


@device_template
def reading_instant(time: real, d: int, p: ParameterVector) -> real:
    """Return the instant [s] whose reading of cell d belongs to the force at a time."""
    return time + (time - cell_clock_effects(time, d, p))


def acts(effect: str, *, has_spring: bool) -> bool:
    """Tell whether an effect shows where a mechanism is driven by measured force.

    With a return spring a string may pull it.
    """
    declared = EFFECTS[effect]
    if declared.side == "actuator":
        return not has_spring and effect in FRICTIONS
    # Without a spring only force per mass is seen: the cell's gain stands for the mass as well.
    if effect == "inertia_error" and not has_spring:
        return False
    # A lag of the cell cannot be undone: noise would grow without bound.
    return effect not in COMMANDED and declared.hook(Stage.CELL_LAG) is None


def has_spring(mechanism: Mechanism, overrides: BenchOverrides) -> bool:
    """Tell whether a mechanism has a return spring under one recording's numbers."""
    joints = override_mechanism(mechanism, overrides).joints
    return any(joint.stiffness > 0.0 for joint in joints)
