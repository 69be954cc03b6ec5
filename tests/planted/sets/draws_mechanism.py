"""Causes beyond the load cell, in tendon and mechanism, drawn by seed."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tests.planted.sets.planted import Draw, Planted, either, factor, planted, scale, single


def tendon_slack(rng: np.random.Generator, size: float) -> Planted:
    """A tendon 1 to 3 mm too long."""
    return single("length", "slack", size * float(rng.uniform(1e-3, 3e-3)))


def backlash(rng: np.random.Generator, size: float) -> Planted:
    """A play of 0.15 to 0.4 rad."""
    return single("width", "backlash", size * float(rng.uniform(0.15, 0.4)))


def tendon_compliance(rng: np.random.Generator, size: float) -> Planted:
    """A tendon of 3 to 11 N/mm."""
    stiffness = float(np.exp(rng.uniform(*np.log([3e3, 11e3])))) / size
    return planted({"stiffness": stiffness}, compliance=1.0 / stiffness)


def routing_friction(rng: np.random.Generator, size: float) -> Planted:
    """Guides that keep 8 to 22 % of the tension."""
    return single("exponent", "routing", size * float(rng.uniform(0.08, 0.25)))


def spool_radius_error(rng: np.random.Generator, size: float) -> Planted:
    """A spool 7 to 20 % too thin or too thick."""
    return single("scale", "radius_scale", scale(rng, 0.07, 0.20, size))


def joint_stiffness_error(rng: np.random.Generator, size: float) -> Planted:
    """Return springs 12 to 30 % too soft or too hard."""
    return single("scale", "stiffness_scale", scale(rng, 0.12, 0.30, size))


def joint_damping_error(rng: np.random.Generator, size: float) -> Planted:
    """Joint damping of a tenth to a third, or of 2.5 to 6 times what it should be."""
    low, high = (0.1, 0.3) if rng.random() < 0.5 else (2.5, 6.0)
    return single("scale", "damping_scale", factor(rng, low, high, size))


def inertia_error(rng: np.random.Generator, size: float) -> Planted:
    """Masses that resist 2.5 to 5 times as much."""
    return single("scale", "inertia_scale", factor(rng, 2.5, 5.0, size))


def joint_dry_friction(rng: np.random.Generator, size: float) -> Planted:
    """Joints that stick with 2 to 7 % of their springs' greatest torque."""
    return single("fraction", "joint_friction", size * float(rng.uniform(0.02, 0.07)))


def spring_stiffening(rng: np.random.Generator, size: float) -> Planted:
    """Springs 0.3 to 1.2 times stiffer at the end of the range."""
    return single("beta", "stiffening", size * float(rng.uniform(0.3, 1.2)))


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


def gravity_misalignment(rng: np.random.Generator, size: float) -> Planted:
    """A bench tilted by 0.25 to 0.6 rad, either way."""
    return single("angle", "tilt", size * either(rng, 0.25, 0.6))


TRANSMISSION: Mapping[str, Draw] = MappingProxyType(
    {
        "tendon_slack": tendon_slack,
        "backlash": backlash,
        "tendon_compliance": tendon_compliance,
        "routing_friction": routing_friction,
        "spool_radius_error": spool_radius_error,
    }
)
MECHANISM: Mapping[str, Draw] = MappingProxyType(
    {
        "joint_stiffness_error": joint_stiffness_error,
        "joint_damping_error": joint_damping_error,
        "inertia_error": inertia_error,
        "joint_dry_friction": joint_dry_friction,
        "spring_stiffening": spring_stiffening,
        "viscoelastic_spring": viscoelastic_spring,
        "obstruction": obstruction,
        "gravity_misalignment": gravity_misalignment,
    }
)
