"""What the checks of recordings know of a bench."""

from functools import cache

import numpy as np

from tendon_newton.data.checks.bench_checks import BenchFacts
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism


@cache
def facts_of(bench: str) -> BenchFacts:
    """Return what the asset of a bench says, by its name or file.

    Raises:
        UnknownName: No asset has that name.
    """
    mechanism = load_mechanism(bench)
    ends = np.array([joint.limits for joint in mechanism.joints])
    pulls = pulls_within_limits(mechanism)
    reach = max(  # from one end of all joints to the other [rad]
        float(np.abs(tendon.moment_arm) @ np.ptp(ends, axis=1)) / tendon.spool_radius
        for tendon in mechanism.tendons
    )
    tendon, alone = mechanism.tendons[0], len(mechanism.joints) == 1
    cart = alone and tendon.direct and bool(np.isfinite(ends).all())
    return BenchFacts(
        name=mechanism.name,
        force_limit=max(tendon.force_limit for tendon in mechanism.tendons),
        pulls=pulls,
        reach=reach if pulls else None,
        rail=mechanism.joints[0].limits if cart else None,
        per_angle=tendon.spool_radius / float(tendon.moment_arm[0]) if cart else 0.0,
        numbers={
            "mass": tuple(joint.mass for joint in mechanism.joints),
            "stiffness": tuple(joint.stiffness for joint in mechanism.joints),
            "moment_arm": tuple(tendon.moment_arm.tolist()) if len(mechanism.tendons) == 1 else (),
        },
    )


def pulls_within_limits(mechanism: Mechanism) -> bool:
    """Tell whether strings pull joints that have ends."""
    ends = np.isfinite([joint.limits for joint in mechanism.joints]).all()
    return bool(ends) and not any(tendon.direct for tendon in mechanism.tendons)
