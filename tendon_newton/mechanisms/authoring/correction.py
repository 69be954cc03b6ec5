"""What a model knows better about a mechanism than its asset, put into the mechanism's numbers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import cos, isfinite, sin

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon

Numbers = Mapping[str, float]


Change = Callable[[Mechanism, Numbers], Mechanism]


def at_joints(change: Callable[[Joint, Numbers], Joint]) -> Change:
    """Return what changes every joint of a mechanism."""
    return lambda mechanism, numbers: replace(
        mechanism, joints=tuple(change(joint, numbers) for joint in mechanism.joints)
    )


def at_tendons(change: Callable[[Tendon, Numbers], Tendon]) -> Change:
    """Return what changes every tendon of a mechanism."""
    return lambda mechanism, numbers: replace(
        mechanism, tendons=tuple(change(tendon, numbers) for tendon in mechanism.tendons)
    )


def add_dry_friction(joint: Joint, numbers: Numbers) -> Joint:
    """Add a share of what the spring gives at the end of its range."""
    if not isfinite(joint.limits[1]):
        return joint
    most = joint.stiffness * (joint.limits[1] - joint.rest)
    return replace(joint, friction=joint.friction + numbers["fraction"] * most)


def tilt(mechanism: Mechanism, numbers: Numbers) -> Mechanism:
    """Tip the bench about +y: gravity turns the other way."""
    x, y, z = mechanism.gravity
    c, s = cos(numbers["angle"]), sin(numbers["angle"])
    return replace(mechanism, gravity=np.array([c * x - s * z, y, s * x + c * z]))


def shift_excursion(tendon: Tendon, numbers: Numbers) -> Tendon:
    """Wind in, at q = 0, what the shifted zero of the encoder shows."""
    shift = numbers["angle"] * tendon.spool_radius
    return replace(tendon, excursion_offset=tendon.excursion_offset + shift)


# Effects that are nothing but other numbers of the mechanism, in the order in which they apply
HOMES: dict[str, Change] = {
    "joint_dry_friction": at_joints(add_dry_friction),  # a share of the spring before it is scaled
    "joint_stiffness_error": at_joints(lambda j, n: replace(j, stiffness=n["scale"] * j.stiffness)),
    "joint_damping_error": at_joints(lambda j, n: replace(j, damping=n["scale"] * j.damping)),
    "gravity_misalignment": tilt,
    "spool_radius_error": at_tendons(
        lambda t, n: replace(t, spool_radius=n["scale"] * t.spool_radius)
    ),
    "position_offset": at_tendons(shift_excursion),  # on the spool that is really there
    "force_saturation": at_tendons(
        lambda t, n: replace(t, force_limit=min(t.force_limit, n["limit"]))
    ),
}


@dataclass(frozen=True, kw_only=True)
class Correction:
    """A mechanism before and after a model's numbers were put into it."""

    asset: Mechanism  # The mechanism of the asset
    corrected: Mechanism
    applied: tuple[str, ...]  # Effects that are in the corrected numbers
    # Effects that no number of a mechanism stands for: servo, sensors, memory of springs
    left: tuple[str, ...]


def correct(asset: Mechanism, model: Model) -> Correction:
    """Put a model's bench numbers and effects into a mechanism, as far as they have a place there.

    The model's ``bench_overrides`` for this mechanism and its effects count.
    """
    model = model.on_bench(asset.name)
    own = model.bench_overrides.get(asset.name)
    corrected = asset if own is None else override_mechanism(asset, own)
    effects = {effect.cause: effect.values for effect in model.effects}
    applied = tuple(name for name in HOMES if name in effects)
    for name in applied:
        numbers = {key: float(value) for key, value in effects[name].items()}
        corrected = HOMES[name](corrected, numbers)
    return Correction(
        asset=asset,
        corrected=corrected,
        applied=applied,
        left=tuple(name for name in effects if name not in HOMES),
    )
