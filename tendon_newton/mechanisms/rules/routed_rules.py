"""Rules for routed tendons that need the finished mechanism: arms and pulleys over the range."""

from collections.abc import Iterator

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import frames_of
from tendon_newton.mechanisms.geometry.parts import Tendon, moment_arms
from tendon_newton.mechanisms.geometry.routing import Pulley, Route, RoutedSpan, seen_ends
from tendon_newton.mechanisms.rules.rule_findings import AssetFinding, about
from tendon_newton.mechanisms.usd.usd_route import turned_span

# A moment arm smaller than this [m] over the whole range is none: the string crosses the axis
NO_ARM = 1.0e-6


def routed_findings(
    tendon: Tendon, joint_names: tuple[str, ...], positions: Array
) -> Iterator[AssetFinding]:
    """Apply the rules to one routed tendon.

    Positions [rad], shape (N, J), span the joints' range.
    """
    if tendon.route is None:
        return
    wrong = list(_check_pulleys(tendon, tendon.route, positions))
    yield from wrong
    if not wrong:
        yield from _check_signs(tendon, joint_names, moment_arms(tendon, positions))


def _check_signs(
    tendon: Tendon, joint_names: tuple[str, ...], arms: Array
) -> Iterator[AssetFinding]:
    """Name every joint that the string both closes and opens."""
    for j, name in enumerate(joint_names):
        low, high = float(arms[:, j].min()), float(arms[:, j].max())
        if low < -NO_ARM and high > NO_ARM:
            yield about(tendon.prim, "moment_arm_sign").warning(
                f"a tendon closes a joint or opens it over the whole range; about {name} "
                f"its moment arm goes from {1e3 * low:.3g} to {1e3 * high:.3g} mm",
                "Move its sites to one side of the axis, or shorten the range",
            )
    if np.all(arms < NO_ARM) and np.any(arms < -NO_ARM):
        yield about(tendon.prim, "moment_arm_sign").found(
            "note",
            "a tendon closes a joint where its moment arm is positive; this one opens all "
            "that it moves",
            "Nothing, if that is meant",
        )


def _check_pulleys(tendon: Tendon, route: Route, positions: Array) -> Iterator[AssetFinding]:
    for span in route.spans:
        if span.pulley is not None:
            yield from _check_pulley(tendon, route, span, span.pulley, positions)


def _check_pulley(
    tendon: Tendon, route: Route, span: RoutedSpan, pulley: Pulley, positions: Array
) -> Iterator[AssetFinding]:
    """Check that a string stays outside its pulley and on its side of it."""
    nearest, turned = np.inf, False
    for q in positions:
        ends = seen_ends(span, frames_of(route.joints, q))
        nearest = min(nearest, *(float(np.hypot(*end[:2])) for end in ends))
        again = turned_span(span, route.joints, q).pulley
        turned = turned or (again is not None and again.turn != pulley.turn)
    if nearest <= pulley.radius:
        yield about(tendon.prim, "pulley").error(
            f"the sites beside a pulley stay outside it; one comes within "
            f"{1e3 * nearest:.3g} mm of the axis of {pulley.prim}, whose radius is "
            f"{1e3 * pulley.radius:.3g} mm",
            "Move the site away from it, or make the pulley smaller",
        )
    elif turned:
        yield about(tendon.prim, "pulley").warning(
            f"a string stays on one side of a pulley; around {pulley.prim} it changes "
            "sides within the range",
            "Move the side site to where the string is at every angle",
        )
