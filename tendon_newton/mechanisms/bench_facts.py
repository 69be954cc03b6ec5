"""What the checks of recordings know of a bench."""

from functools import cache, partial

import numpy as np

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.checks.bench_checks import BenchFacts, MotorWay
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, excursion
from tendon_newton.mechanisms.geometry.statics import closing_path
from tendon_newton.mechanisms.loading import load_mechanism

AS_DRAWN = BenchOverrides()


@cache
def facts_of(bench: str, overrides: BenchOverrides = AS_DRAWN) -> BenchFacts:
    """Return what the asset of a bench says, by its name or file, and recordings in its place.

    Raises:
        UnknownName: No asset has that name.
    """
    mechanism = load_mechanism(bench)
    used = override_mechanism(mechanism, overrides)
    return BenchFacts(
        name=mechanism.name,
        force_limit=max(tendon.force_limit for tendon in mechanism.tendons),
        pulls=pulls_within_limits(mechanism),
        holds=partial(held_excursions, bench, overrides),
        ways=tuple(way_of(used, tendon) for tendon in used.tendons),
        numbers={
            "mass": tuple(joint.mass for joint in mechanism.joints),
            "stiffness": tuple(joint.stiffness for joint in mechanism.joints),
            "moment_arm": tuple(mechanism.tendons[0].moment_arm.tolist())
            if len(mechanism.tendons) == 1
            else (),
        },
    )


@cache
def held_excursions(bench: str, overrides: BenchOverrides) -> tuple[Array, Array] | None:
    """Return excursions [m] and the tension that holds each [N]; None where no one string does."""
    mechanism = override_mechanism(load_mechanism(bench), overrides)
    if len(mechanism.tendons) != 1 or not pulls_within_limits(mechanism):
        return None
    try:
        path = closing_path(mechanism)
    except InvalidParameter:
        return None
    order = np.argsort(path.excursion)
    return path.excursion[order], path.tension[order]


def way_of(mechanism: Mechanism, tendon: Tendon) -> MotorWay:
    """Return how far the joints' ranges let a motor go."""
    low, high = np.array([joint.limits for joint in mechanism.joints]).T
    moved, forward = tendon.moment_arm != 0.0, tendon.moment_arm > 0.0
    opened, closed = (
        float(excursion(tendon, np.where(moved, np.where(forward == up, high, low), 0.0)))
        for up in (False, True)
    )
    return MotorWay(
        ends=(opened, closed) if np.isfinite(closed - opened) else (-np.inf, np.inf),
        radius=tendon.spool_radius,
        direct=tendon.direct,
        arm=float(tendon.moment_arm[0]),
        unit="m" if mechanism.joints[0].kind == "prismatic" else "rad",
    )


def pulls_within_limits(mechanism: Mechanism) -> bool:
    """Tell whether strings pull joints that have ends."""
    ends = np.isfinite([joint.limits for joint in mechanism.joints]).all()
    return bool(ends) and not any(tendon.direct for tendon in mechanism.tendons)
