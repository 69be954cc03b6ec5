"""The catalogue of physical effects: one file each, one line each in the table."""

import re
from functools import cache

from tendon_newton.data.servo_names import effect_of, name_of, servo_of
from tendon_newton.effects.acceleration_limit import AccelerationLimit
from tendon_newton.effects.actuator_lag import ActuatorLag
from tendon_newton.effects.asymmetric_friction import AsymmetricFriction
from tendon_newton.effects.backlash import Backlash
from tendon_newton.effects.base import Effect, Stage
from tendon_newton.effects.command_delay import CommandDelay
from tendon_newton.effects.command_rate_limit import CommandRateLimit
from tendon_newton.effects.coulomb_friction import CoulombFriction
from tendon_newton.effects.deadband import Deadband
from tendon_newton.effects.force_saturation import ForceSaturation
from tendon_newton.effects.gain_drift import GainDrift
from tendon_newton.effects.gain_error import GainError
from tendon_newton.effects.gear_load_friction import GearLoadFriction
from tendon_newton.effects.gravity_misalignment import GravityMisalignment
from tendon_newton.effects.holding_friction import HoldingFriction
from tendon_newton.effects.hysteresis import Hysteresis
from tendon_newton.effects.inertia_error import InertiaError
from tendon_newton.effects.joint_damping_error import JointDampingError
from tendon_newton.effects.joint_dry_friction import JointDryFriction
from tendon_newton.effects.joint_stiffness_error import JointStiffnessError
from tendon_newton.effects.load_cell_bias import LoadCellBias
from tendon_newton.effects.load_cell_delay import LoadCellDelay
from tendon_newton.effects.load_cell_drift import LoadCellDrift
from tendon_newton.effects.load_cell_gain import LoadCellGain
from tendon_newton.effects.load_cell_lag import LoadCellLag
from tendon_newton.effects.load_dependent_friction import LoadDependentFriction
from tendon_newton.effects.load_stribeck_friction import LoadStribeckFriction
from tendon_newton.effects.obstruction import Obstruction
from tendon_newton.effects.overload_cut import OverloadCut
from tendon_newton.effects.position_offset import PositionOffset
from tendon_newton.effects.routing_friction import RoutingFriction
from tendon_newton.effects.sample_period_error import SamplePeriodError
from tendon_newton.effects.speed_limit import SpeedLimit
from tendon_newton.effects.spool_radius_error import SpoolRadiusError
from tendon_newton.effects.spring_stiffening import SpringStiffening
from tendon_newton.effects.starting_duty import StartingDuty
from tendon_newton.effects.stribeck_friction import StribeckFriction
from tendon_newton.effects.tendon_compliance import TendonCompliance
from tendon_newton.effects.tendon_slack import TendonSlack
from tendon_newton.effects.torque_fade import TorqueFade
from tendon_newton.effects.viscoelastic_spring import ViscoelasticSpring
from tendon_newton.effects.viscous_friction import ViscousFriction
from tendon_newton.effects.voltage_sag import VoltageSag
from tendon_newton.errors import look_up

EFFECTS: dict[str, type[Effect]] = {
    # In the order in which they act within a stage.
    "command_delay": CommandDelay,
    "sample_period_error": SamplePeriodError,
    "spool_radius_error": SpoolRadiusError,
    "position_offset": PositionOffset,
    "tendon_slack": TendonSlack,
    "backlash": Backlash,
    "command_rate_limit": CommandRateLimit,
    "acceleration_limit": AccelerationLimit,
    "deadband": Deadband,
    "gain_error": GainError,
    "gain_drift": GainDrift,
    "starting_duty": StartingDuty,
    "overload_cut": OverloadCut,
    "force_saturation": ForceSaturation,
    "voltage_sag": VoltageSag,
    "torque_fade": TorqueFade,
    "actuator_lag": ActuatorLag,
    "viscous_friction": ViscousFriction,
    "coulomb_friction": CoulombFriction,
    "asymmetric_friction": AsymmetricFriction,
    "stribeck_friction": StribeckFriction,
    "hysteresis": Hysteresis,
    "load_dependent_friction": LoadDependentFriction,
    "gear_load_friction": GearLoadFriction,
    "load_stribeck_friction": LoadStribeckFriction,
    "holding_friction": HoldingFriction,
    "tendon_compliance": TendonCompliance,
    "speed_limit": SpeedLimit,
    "routing_friction": RoutingFriction,
    "obstruction": Obstruction,
    "joint_stiffness_error": JointStiffnessError,
    "spring_stiffening": SpringStiffening,
    "viscoelastic_spring": ViscoelasticSpring,
    "joint_damping_error": JointDampingError,
    "joint_dry_friction": JointDryFriction,
    "inertia_error": InertiaError,
    "gravity_misalignment": GravityMisalignment,
    "load_cell_delay": LoadCellDelay,
    "load_cell_lag": LoadCellLag,
    "load_cell_gain": LoadCellGain,
    "load_cell_bias": LoadCellBias,
    "load_cell_drift": LoadCellDrift,
}


FRICTION_FAMILIES: tuple[tuple[str, ...], ...] = (
    ("coulomb_friction", "asymmetric_friction", "stribeck_friction", "hysteresis"),
    ("load_dependent_friction", "gear_load_friction", "load_stribeck_friction", "holding_friction"),
)
"""Forms of one friction: dry friction of a gear, and what its load presses out of its teeth."""


def find_effect(name: str) -> type[Effect]:
    """Return an effect of the catalogue; an unknown name is refused."""
    return look_up("effect", name, EFFECTS)


def law_of(cause: str) -> type[Effect]:
    """Return the effect that a cause is, be it of one servo or of all."""
    return find_effect(effect_of(cause))


def special_cases(cause: str) -> tuple[str, ...]:
    """Return the special cases of a cause's law, of the same servo."""
    servo = servo_of(cause)
    return tuple(name_of(special, servo) for special in law_of(cause).includes)


@cache
def confused_with(effect: str) -> frozenset[str]:
    """Return the effects that are easily taken for one, as its docstring or theirs says."""
    own = frozenset(mentioned(effect))
    return own | {other for other in EFFECTS if effect in mentioned(other)}


def mentioned(effect: str) -> list[str]:
    """Return the effects that stand in the part `Confused with` of an effect's docstring."""
    _, _, part = (find_effect(effect).__doc__ or "").partition("Confused with:")
    return [other for other in EFFECTS if other != effect and re.search(rf"\b{other}\b", part)]


def are_one_friction(one: str, other: str) -> bool:
    """Tell whether two causes are forms of one friction: dry, or in proportion to a gear's load."""
    pair = {effect_of(one), effect_of(other)}
    return any(pair <= set(family) for family in FRICTION_FAMILIES) and overlap(one, other)


def overlap(one: str, other: str) -> bool:
    """Tell whether two causes have a servo in common."""
    servos = {servo_of(one), servo_of(other)}
    return len(servos) == 1 or None in servos


def are_one_law(one: str, other: str) -> bool:
    """Tell whether two causes are one effect, of a servo and of all: only one of them may act."""
    return one != other and effect_of(one) == effect_of(other) and overlap(one, other)


def are_confused(one: str, other: str) -> bool:
    """Tell whether two causes, of the same servo or of all, are easily taken for each other."""
    return effect_of(other) in confused_with(effect_of(one)) and servo_of(one) == servo_of(other)


def are_related(one: str, other: str) -> bool:
    """Tell whether one of two causes is a special case of the other, or both are one effect."""
    includes = effect_of(other) in law_of(one).includes or effect_of(one) in law_of(other).includes
    return are_one_law(one, other) or (includes and overlap(one, other))


__all__ = [
    "EFFECTS",
    "Effect",
    "Stage",
    "are_confused",
    "are_one_friction",
    "are_one_law",
    "are_related",
    "find_effect",
    "law_of",
    "overlap",
    "special_cases",
]
