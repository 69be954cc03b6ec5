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


def scale_joints(name: str) -> Callable[[Mechanism, Numbers], Mechanism]:
    """Return what scales one number of every joint."""

    def scaled(mechanism: Mechanism, numbers: Numbers) -> Mechanism:
        scale = numbers["scale"]
        return with_joints(mechanism, lambda j: replace(j, **{name: scale * getattr(j, name)}))

    return scaled


def add_dry_friction(mechanism: Mechanism, numbers: Numbers) -> Mechanism:
    """Add a share of what each spring gives at the end of its range."""
    return with_joints(
        mechanism,
        lambda j: (
            replace(
                j, friction=j.friction + numbers["fraction"] * j.stiffness * (j.limits[1] - j.rest)
            )
            if isfinite(j.limits[1])
            else j
        ),
    )


def tilt(mechanism: Mechanism, numbers: Numbers) -> Mechanism:
    """Tip the bench about +y: gravity turns the other way."""
    x, y, z = mechanism.gravity
    c, s = cos(numbers["angle"]), sin(numbers["angle"])
    return replace(mechanism, gravity=np.array([c * x - s * z, y, s * x + c * z]))


def scale_spool(mechanism: Mechanism, numbers: Numbers) -> Mechanism:
    """Scale the radius of every spool."""
    return with_tendons(
        mechanism, lambda t: replace(t, spool_radius=numbers["scale"] * t.spool_radius)
    )


def shift_excursion(mechanism: Mechanism, numbers: Numbers) -> Mechanism:
    """Wind in, at q = 0, what the shifted zero of the encoder shows."""
    return with_tendons(
        mechanism,
        lambda t: replace(
            t, excursion_offset=t.excursion_offset + numbers["angle"] * t.spool_radius
        ),
    )


def limit_force(mechanism: Mechanism, numbers: Numbers) -> Mechanism:
    """Lower what the servos can pull; a knee below that has no place in a mechanism."""
    return with_tendons(
        mechanism, lambda t: replace(t, force_limit=min(t.force_limit, numbers["limit"]))
    )


# Effects that are nothing but other numbers of the mechanism, in the order in which they apply
HOMES: dict[str, Callable[[Mechanism, Numbers], Mechanism]] = {
    "joint_dry_friction": add_dry_friction,  # a share of the spring before it is scaled
    "joint_stiffness_error": scale_joints("stiffness"),
    "joint_damping_error": scale_joints("damping"),
    "gravity_misalignment": tilt,
    "spool_radius_error": scale_spool,
    "position_offset": shift_excursion,  # on the spool that is really there
    "force_saturation": limit_force,
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


def with_joints(mechanism: Mechanism, change: Callable[[Joint], Joint]) -> Mechanism:
    """Return a mechanism with every joint changed."""
    return replace(mechanism, joints=tuple(change(joint) for joint in mechanism.joints))


def with_tendons(mechanism: Mechanism, change: Callable[[Tendon], Tendon]) -> Mechanism:
    """Return a mechanism with every tendon changed."""
    return replace(mechanism, tendons=tuple(change(tendon) for tendon in mechanism.tendons))
