"""The catalogue of physical effects: one file each, one line each in the table."""

from __future__ import annotations

from tendon_newton.effects.base import Effect, Stage
from tendon_newton.effects.command_delay import CommandDelay
from tendon_newton.effects.coulomb_friction import CoulombFriction
from tendon_newton.effects.gain_error import GainError
from tendon_newton.effects.joint_stiffness_error import JointStiffnessError
from tendon_newton.effects.load_dependent_friction import LoadDependentFriction
from tendon_newton.effects.position_offset import PositionOffset
from tendon_newton.effects.viscous_friction import ViscousFriction
from tendon_newton.errors import unknown_name

EFFECTS: dict[str, type[Effect]] = {
    # In the order in which they act within a stage.
    "command_delay": CommandDelay,
    "position_offset": PositionOffset,
    "gain_error": GainError,
    "viscous_friction": ViscousFriction,
    "coulomb_friction": CoulombFriction,
    "load_dependent_friction": LoadDependentFriction,
    "joint_stiffness_error": JointStiffnessError,
}


def find_effect(name: str) -> type[Effect]:
    """Return an effect of the catalogue.

    Raises:
        UnknownName: No such effect; the message lists the known ones.
    """
    if name not in EFFECTS:
        raise unknown_name("effect", name, EFFECTS)
    return EFFECTS[name]


__all__ = ["EFFECTS", "Effect", "Stage", "find_effect"]
