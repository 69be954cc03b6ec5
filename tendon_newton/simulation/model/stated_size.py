"""What a bench is like by its asset, and whether a servo of such numbers could be on it."""

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import NamedValues
from tendon_newton.data.parameters import BenchScale, with_unit
from tendon_newton.errors import InvalidModelFile
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import excursion

NOMINAL_FORCE = 21.0  # Most that the servo of the nominal benches gives [N]
NOMINAL_TRAVEL = (0.01, 0.08)
"""Travel of their tendons [m]: from 20 mm of a finger to 80 mm of a spring."""
NOMINAL_SPOOL = 0.0125  # Radius of their spools [m]
SPARE = 3.0  # Times by which a number may lie beyond what a fit would look at [1]
DIGITS = 6  # Significant digits of a scale: an asset's numbers are of single precision


def scale_by(force: float, travel: float, radius: float, *, is_shaft: bool) -> BenchScale:
    """Return the scale of a bench.

    Args:
        force: Most that its servo gives [N], or [N m] of a shaft.
        travel: Of its tendon [m].
        radius: Of its spool [m].
        is_shaft: Whether a shaft is turned: an angle is an angle on any.
    """
    if is_shaft:
        return BenchScale(force=rounded(force / NOMINAL_FORCE), is_shaft=True)
    low, high = NOMINAL_TRAVEL
    return BenchScale(
        force=rounded(force / NOMINAL_FORCE),
        travel=rounded(travel / min(max(travel, low), high)),
        turn=rounded(NOMINAL_SPOOL / radius),
    )


def rounded(ratio: float) -> float:
    """Return a ratio without what single precision adds to it."""
    return float(f"{ratio:.{DIGITS}g}")


def range_of_tendon(mechanism: Mechanism) -> float:
    """Return the travel of a mechanism's tendon between its joints' ends [m]; may be infinite."""
    ends = np.array(mechanism.joint_limits)
    if not np.isfinite(ends).all():
        return np.inf
    tendon = mechanism.tendons[0]
    return float(abs(excursion(tendon, ends[:, 1]) - excursion(tendon, ends[:, 0])))


def turns_a_shaft(mechanism: Mechanism) -> bool:
    """Tell whether a shaft stands in for the string."""
    return mechanism.tendons[0].direct and mechanism.joints[0].kind == "revolute"


def check_size(actuator: NamedValues, mechanism: Mechanism) -> None:
    """Refuse an actuator's number that no servo of such a bench has.

    Raises:
        InvalidModelFile: It lies far beyond what a fit would look at there, and on nominal benches.
    """
    tendon, travel = mechanism.tendons[0], range_of_tendon(mechanism)
    drawn = scale_by(
        tendon.force_limit,
        travel if np.isfinite(travel) else NOMINAL_TRAVEL[0],
        tendon.spool_radius,
        is_shaft=turns_a_shaft(mechanism),
    )
    for nominal in find_actuator(actuator.name).parameters:
        value, own = actuator.values.get(nominal.name), nominal.on(drawn)
        low = min(nominal.lower, own.lower) / SPARE
        high = max(nominal.upper, own.upper) * SPARE
        if isinstance(value, float) and not low <= value <= high:
            raise InvalidModelFile(
                f"{nominal.name} of actuator {actuator.name!r} must be between {low:.3g} and "
                f"{with_unit(f'{high:.3g}', own.unit)} on {mechanism.name} ({nominal.source}); "
                f"it is {value:g}"
            )
