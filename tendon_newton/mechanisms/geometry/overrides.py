"""Bench numbers of one recording, put in place of the asset's own."""

from dataclasses import fields, replace
from typing import TypeVar

import numpy as np

from tendon_newton.data.bench_overrides import OF_BENCH, BenchOverrides
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.arms import with_arm, without_arm
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon
from tendon_newton.mechanisms.geometry.routing import Pulley, Route, RoutedSpan, RouteSite

Stop = TypeVar("Stop", RouteSite, Pulley)


def override_mechanism(mechanism: Mechanism, overrides: BenchOverrides) -> Mechanism:
    """Return a mechanism with overridden numbers.

    - ``mass`` scales the inertia with it; an arm stays as it is.
    - ``length`` stretches the whole link. Centre of mass, the joints that sit on it and the tip
      keep their share of the length. The inertia grows with the square of the length.
    - ``arm_mass`` is that of an even arm from the joint to the link's centre, on top of ``mass``.
    - ``range`` is the upper end; the lower end stays.
    - ``moment_arm`` is that of the only tendon.
    """
    _check_counts(mechanism, overrides)
    stretch = _stretch(mechanism, overrides)
    joints = tuple(
        _override_joint(mechanism, i, overrides, stretch) for i in range(len(mechanism.joints))
    )
    tip = mechanism.tip
    if tip is not None:
        anchor = mechanism.joints[tip.body].child_position
        tip = replace(tip, point=anchor + stretch[tip.body] * (tip.point - anchor))
    tendons = _override_tendons(mechanism, overrides, joints, stretch)
    return replace(mechanism, joints=joints, tip=tip, tendons=tendons)


def refusal_of(mechanism: Mechanism, key: str) -> str | None:
    """Return why a mechanism has no such number in the place of another; None where it has."""
    if key == "length":
        for joint in mechanism.joints:
            if joint.length is None:
                return (
                    f"Bench override 'length' does not apply to {mechanism.name!r}: the link "
                    f"behind joint {joint.name!r} has no length."
                )
    tendons = mechanism.tendons
    if key == "moment_arm" and (len(tendons) != 1 or tendons[0].route is not None):
        return (
            "Bench override 'moment_arm' needs a bench with one tendon whose arms are constant; "
            f"{mechanism.name!r} has {len(tendons)}"
            f"{', routed' if any(t.route is not None for t in tendons) else ''}."
        )
    return None


def _check_counts(mechanism: Mechanism, overrides: BenchOverrides) -> None:
    joint_count = len(mechanism.joints)
    for entry in fields(overrides):
        values = getattr(overrides, entry.name)
        if entry.name in OF_BENCH:
            continue
        if values is not None and len(values) != joint_count:
            raise InvalidParameter(
                f"Bench override {entry.name!r} needs one value per joint of {mechanism.name!r} "
                f"({', '.join(mechanism.joint_names)}); it has {len(values)}."
            )
        if values is not None and (refused := refusal_of(mechanism, entry.name)):
            raise InvalidParameter(refused)


def _stretch(mechanism: Mechanism, overrides: BenchOverrides) -> tuple[float, ...]:
    """Return by how much each link grows [1]."""
    if overrides.length is None:
        return (1.0,) * len(mechanism.joints)
    links = zip(mechanism.joints, overrides.length, strict=True)
    return tuple(length / joint.length for joint, length in links if joint.length is not None)


def _override_joint(
    mechanism: Mechanism, index: int, overrides: BenchOverrides, stretch: tuple[float, ...]
) -> Joint:
    joint = mechanism.joints[index]
    own = stretch[index]
    old, centre, inertia = without_arm(joint.body, np.array(joint.arm_mass))
    mass = old if overrides.mass is None else np.array(overrides.mass[index])
    arm = joint.arm_mass if overrides.arm_mass is None else overrides.arm_mass[index]
    load = mass, own * centre, inertia * (mass / old * own**2)
    mass, centre, inertia = with_arm(load, np.array(arm))
    parent_position = joint.parent_position
    if joint.parent >= 0:
        anchor = mechanism.joints[joint.parent].child_position
        parent_position = anchor + stretch[joint.parent] * (parent_position - anchor)
    lower, upper = joint.limits
    return replace(
        joint,
        mass=float(mass),
        inertia=inertia,
        center_of_mass=joint.child_position + centre,
        arm_mass=arm,
        length=None if joint.length is None else joint.length * own,
        parent_position=parent_position,
        limits=(lower, upper if overrides.range is None else overrides.range[index]),
        stiffness=joint.stiffness if overrides.stiffness is None else overrides.stiffness[index],
        damping=joint.damping if overrides.damping is None else overrides.damping[index],
    )


def _override_tendons(
    mechanism: Mechanism,
    overrides: BenchOverrides,
    joints: tuple[Joint, ...],
    stretch: tuple[float, ...],
) -> tuple[Tendon, ...]:
    tendons = tuple(_moved_tendon(mechanism, t, joints, stretch) for t in mechanism.tendons)
    if overrides.moment_arm is None:
        return tendons
    return (replace(tendons[0], moment_arm=np.array(overrides.moment_arm)),)


def _moved_tendon(
    mechanism: Mechanism, tendon: Tendon, joints: tuple[Joint, ...], stretch: tuple[float, ...]
) -> Tendon:
    """Return a tendon whose sites and pulleys keep their share of a stretched link."""
    if tendon.route is None:
        return tendon

    def moved(stop: Stop) -> Stop:
        if stop.body < 0:
            return stop
        anchor = mechanism.joints[stop.body].child_position
        return replace(stop, point=anchor + stretch[stop.body] * (stop.point - anchor))

    spans = tuple(
        RoutedSpan(
            start=moved(span.start),
            end=moved(span.end),
            pulley=None if span.pulley is None else moved(span.pulley),
        )
        for span in tendon.route.spans
    )
    route = Route(joints=joints, spans=spans)
    return replace(tendon, route=route, moment_arm=route.moment_arms(np.zeros(len(joints))))
