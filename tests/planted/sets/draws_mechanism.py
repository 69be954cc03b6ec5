"""Causes beyond the load cell, in tendon and mechanism, drawn by seed."""

from collections.abc import Mapping

import numpy as np

from tests.planted.sets.planted import (
    Draw,
    Planted,
    either_way,
    evenly,
    factor,
    off,
    planted,
    single,
    times,
)


def tendon_compliance(rng: np.random.Generator, size: float) -> Planted:
    """A tendon of 3 to 11 N/mm."""
    stiffness = float(np.exp(rng.uniform(*np.log([3e3, 11e3])))) / size
    return planted({"stiffness": stiffness}, compliance=1.0 / stiffness)


def joint_damping_error(rng: np.random.Generator, size: float) -> Planted:
    """Joint damping of a tenth to a third, or of 2.5 to 6 times what it should be."""
    low, high = (0.1, 0.3) if rng.random() < 0.5 else (2.5, 6.0)
    return single("scale", "damping_scale", factor(rng, low, high, size))


def viscoelastic_spring(rng: np.random.Generator, size: float) -> Planted:
    """A relaxing third to two thirds beside each spring, within 0.2 to 1.2 s."""
    ratio, relaxation = size * float(rng.uniform(0.3, 0.65)), float(rng.uniform(0.2, 1.2))
    return planted(
        {"stiffness_ratio": ratio, "relaxation_time": relaxation},
        maxwell_ratio=ratio,
        relaxation=relaxation,
    )


def obstruction(rng: np.random.Generator, size: float) -> Planted:
    """A contact of 300 to 800 N/m, 0.6 to 1.2 rad into the path."""
    position, stiffness = float(rng.uniform(0.6, 1.2)), size * float(rng.uniform(300.0, 800.0))
    return planted(
        {"position": position, "stiffness": stiffness},
        obstruction=stiffness,
        obstruction_at=position,
    )


TRANSMISSION: Mapping[str, Draw] = {
    # A tendon 1 to 3 mm too long
    "tendon_slack": evenly("length", "slack", 1e-3, 3e-3),
    # A play of 0.15 to 0.4 rad
    "backlash": evenly("width", "backlash", 0.15, 0.4),
    "tendon_compliance": tendon_compliance,
    # Guides that keep 8 to 22 % of the tension
    "routing_friction": evenly("exponent", "routing", 0.08, 0.25),
    # A spool 7 to 20 % too thin or too thick
    "spool_radius_error": off("scale", "radius_scale", 0.07, 0.20),
}
MECHANISM: Mapping[str, Draw] = {
    # Return springs 12 to 30 % too soft or too hard
    "joint_stiffness_error": off("scale", "stiffness_scale", 0.12, 0.30),
    "joint_damping_error": joint_damping_error,
    # Masses that resist 2.5 to 5 times as much
    "inertia_error": times("scale", "inertia_scale", 2.5, 5.0),
    # Joints that stick with 2 to 7 % of their springs' greatest torque
    "joint_dry_friction": evenly("fraction", "joint_friction", 0.02, 0.07),
    # Springs 0.3 to 1.2 times stiffer at the end of the range
    "spring_stiffening": evenly("beta", "stiffening", 0.3, 1.2),
    "viscoelastic_spring": viscoelastic_spring,
    "obstruction": obstruction,
    # A bench tilted by 0.25 to 0.6 rad, either way
    "gravity_misalignment": either_way("angle", "tilt", 0.25, 0.6),
}
