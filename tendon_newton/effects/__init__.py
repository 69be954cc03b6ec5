"""The catalogue of physical effects: one file each, one line each in the table."""

from importlib import import_module

from tendon_newton.data.servo_names import effect_of, name_of, servo_of
from tendon_newton.effects.base import Effect, Stage
from tendon_newton.errors import NameTable

IN_ORDER = (  # in which they act within a stage
    "command_delay",
    "sample_period_error",
    "spool_radius_error",
    "position_offset",
    "tendon_slack",
    "backlash",
    "command_rate_limit",
    "acceleration_limit",
    "deadband",
    "gain_error",
    "gain_drift",
    "starting_duty",
    "overload_cut",
    "force_saturation",
    "voltage_sag",
    "torque_fade",
    "actuator_lag",
    "viscous_friction",
    "coulomb_friction",
    "asymmetric_friction",
    "stribeck_friction",
    "hysteresis",
    "load_dependent_friction",
    "gear_load_friction",
    "load_stribeck_friction",
    "holding_friction",
    "presliding",
    "tendon_compliance",
    "speed_limit",
    "routing_friction",
    "obstruction",
    "joint_stiffness_error",
    "spring_stiffening",
    "viscoelastic_spring",
    "joint_damping_error",
    "joint_dry_friction",
    "inertia_error",
    "gravity_misalignment",
    "load_cell_delay",
    "load_cell_lag",
    "load_cell_gain",
    "load_cell_bias",
    "load_cell_drift",
    "joint_encoder_delay",
    "joint_encoder_gain",
    "tip_sensor_delay",
    "tip_sensor_gain",
    "current_sensor_delay",
    "current_sensor_gain",
    "voltage_sensor_sag",
)


def class_of(effect: str) -> type[Effect]:
    """Return the class of an effect, which stands in the file of its name."""
    module = import_module(f"{__name__}.{effect}")
    return getattr(module, effect.title().replace("_", ""))


EFFECTS = NameTable("effect", {effect: class_of(effect) for effect in IN_ORDER})


FRICTION_FAMILIES: tuple[tuple[str, ...], ...] = (
    ("coulomb_friction", "asymmetric_friction", "stribeck_friction", "hysteresis"),
    ("load_dependent_friction", "gear_load_friction", "load_stribeck_friction", "holding_friction"),
)
"""Forms of one friction: dry friction of a gear, and what its load presses out of its teeth."""


def find_effect(name: str) -> type[Effect]:
    """Return an effect of the catalogue; an unknown name is refused."""
    return EFFECTS[name]


def law_of(cause: str) -> type[Effect]:
    """Return the effect that a cause is, be it of one servo or of all."""
    return find_effect(effect_of(cause))


def special_cases(cause: str) -> tuple[str, ...]:
    """Return the special cases of a cause's law, of the same servo."""
    servo = servo_of(cause)
    return tuple(name_of(special, servo) for special in law_of(cause).includes)


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
    named = effect_of(other) in law_of(one).confused or effect_of(one) in law_of(other).confused
    return named and servo_of(one) == servo_of(other)


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
