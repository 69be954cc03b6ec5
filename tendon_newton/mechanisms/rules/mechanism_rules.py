"""Rules that need the finished mechanism: moment arms, pulleys, spool, closing force."""

from collections.abc import Collection, Iterator

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.joint_frames import frames_of
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, excursion, moment_arms
from tendon_newton.mechanisms.geometry.routing import Pulley, Route, RoutedSpan, seen_ends
from tendon_newton.mechanisms.geometry.statics import (
    closed_position,
    closing_path,
    closing_tension,
    equilibrium,
)
from tendon_newton.mechanisms.rules.rule_findings import STAGE, AssetFinding, about
from tendon_newton.mechanisms.usd.usd_route import turned_span

# Beyond this many turns [1] the string climbs over itself and the spool radius grows; fewer than
# the least are some tens of an encoder's counts
TURN_LIMIT, LEAST_TURNS = 2.0, 0.01
# A servo that closes less than this share of the range [1] does not drive the bench
REACH_LIMIT = 0.1
# Shares of the range [1] that gravity closes by itself: worth a note, and no return at all
SLACK_NOTE, SLACK_LIMIT = 0.15, 0.5
# Moment arms and the slope of the excursion agree to this share [1] in float64
ARM_TOLERANCE = 1.0e-6

# Cosine of the angle [1] below which axes of one string differ; a thumb's are 40 degrees apart
ALIKE = 0.7
# Share of its distance [1] by which a link's centre lies beside the axis that it turns about, below
# which it is twisted; and of a joint's range beyond which it goes to both sides
TWIST, SPREAD = 0.1, 0.25

# Postures from open to closed at which paths are looked at [1]: every 4 degrees of a finger
RANGE_STEPS = 25


def mechanism_findings(
    mechanism: Mechanism, servos: Collection[str] = ()
) -> Iterator[AssetFinding]:
    """Apply every rule to a mechanism; without names of servos every name is one."""
    yield from _check_tip(mechanism)
    axes: dict[str, AssetFinding] = {}
    for index, tendon in enumerate(mechanism.tendons):
        yield from _check_servo(tendon, servos)
        positions = range_positions(mechanism, RANGE_STEPS)
        wrong = list(routed_findings(tendon, mechanism.joint_names, positions))
        yield from wrong
        if any(finding.severity == "error" for finding in wrong):
            continue
        yield from _check_arms(mechanism, tendon)
        if tendon.direct:
            continue
        axes |= {finding.prim: finding for finding in _check_axes(mechanism, tendon)}
        yield from _check_spool(mechanism, tendon)
        if not np.any(moment_arms(tendon, closed_position(mechanism)) > 0.0):
            continue  # an opening tendon: its arms' signs were named, and it closes nothing
        try:
            yield from _check_slack(mechanism, tendon)
            yield from _check_closing(mechanism, index)
        except InvalidParameter as error:
            yield about(tendon.prim, "equilibrium").error(
                "a mechanism comes to rest at every tension; " + str(error).rstrip("."),
                "Give every joint a spring or stop that holds it",
            )
    yield from axes.values()


def range_positions(mechanism: Mechanism, count: int) -> Array:
    """Return joint positions from open to closed, all joints in step [rad], shape (count, J)."""
    lower = np.array([limits[0] for limits in mechanism.joint_limits])
    opened = np.where(np.isfinite(lower), lower, -np.pi / 2.0)
    return np.linspace(opened, closed_position(mechanism), count)


def arm_errors(mechanism: Mechanism, tendon: Tendon) -> Array:
    """Return moment arm minus the slope of the excursion [m/rad] in 9 postures, shape (9, J)."""
    h = 1.0e-6
    positions = range_positions(mechanism, 9)
    steps = h * np.eye(len(mechanism.joints))
    slopes = [
        (excursion(tendon, positions + step) - excursion(tendon, positions - step)) / (2.0 * h)
        for step in steps
    ]
    return moment_arms(tendon, positions) - np.stack(slopes, axis=-1)


def _check_arms(mechanism: Mechanism, tendon: Tendon) -> Iterator[AssetFinding]:
    worst = float(np.max(np.abs(arm_errors(mechanism, tendon))))
    arms = moment_arms(tendon, range_positions(mechanism, RANGE_STEPS))
    if worst > ARM_TOLERANCE * float(np.max(np.abs(arms))):
        yield about(tendon.prim, "moment_arm").error(
            f"moment arms must be the slope of the excursion; they differ by up to {worst:.3g} m",
            "Mend the tendon's path",
        )


def _check_tip(mechanism: Mechanism) -> Iterator[AssetFinding]:
    pulled = not mechanism.tendons[0].direct and "prismatic" not in mechanism.joint_kinds
    if pulled and mechanism.tip is None:
        yield about(STAGE, "tip").found(
            "note",
            "a finger has a tip; there is no site named tip, so that recordings cannot be "
            "compared with tip_x and tip_z",
            "Add a Sphere named tip with MjcSiteAPI to the last link",
        )


def _check_servo(tendon: Tendon, servos: Collection[str]) -> Iterator[AssetFinding]:
    if servos and tendon.servo and tendon.servo.replace("-", "_") not in servos:
        yield about(tendon.prim, "tendon_drive").warning(
            f"tendon:servo names a servo that is known: {', '.join(sorted(servos))}; it is "
            f"{tendon.servo!r}",
            "Write one of these, or leave tendon:servo out for a servo of another kind",
        )


def _check_axes(mechanism: Mechanism, tendon: Tendon) -> Iterator[AssetFinding]:
    """Find closing joints that a string would twist, or bend out of the plane of its others.

    A joint that goes to both sides may spread fingers or turn a wrist.
    """
    positions = range_positions(mechanism, RANGE_STEPS)
    axes = np.array(frames_of(mechanism.joints, positions[0]).axis)
    moved = np.abs(moment_arms(tendon, positions)).max(axis=0) > NO_ARM
    turned = [
        j
        for j, joint in enumerate(mechanism.joints)
        if moved[j] and joint.kind == "revolute" and -joint.limits[0] < SPREAD * joint.limits[1]
    ]
    if not turned:
        return
    alike = np.abs(axes[turned] @ axes[turned].T) > ALIKE
    usual = axes[turned][np.argmax(alike.sum(axis=1) + np.abs(axes[turned][:, 1]) / 2.0)]
    for joint, axis in ((mechanism.joints[j], axes[j]) for j in turned):
        arm = joint.child_rotation.T @ (joint.center_of_mass - joint.child_position)
        twists = np.linalg.norm(np.cross(joint.axis, arm)) < TWIST * np.linalg.norm(arm)
        if twists or abs(axis @ usual) < ALIKE:
            what = "along its own link" if twists else f"across ({_three(usual)}), the others'"
            yield about(joint.prim, "joint_axis").warning(
                f"a string bends a finger in one plane; the axis of {joint.name}, "
                f"({_three(axis)}), lies {what}",
                'Write physics:axis = "Y" for a finger along x, unless it is meant to twist or '
                "spread",
            )


def _three(axis: Array) -> str:
    return ", ".join(f"{x + 0.0:.2g}" for x in axis.round(2))


def _check_slack(mechanism: Mechanism, tendon: Tendon) -> Iterator[AssetFinding]:
    """Find how far gravity and springs close the mechanism by themselves."""
    opened, closed = excursion(tendon, range_positions(mechanism, 2))
    still = equilibrium(mechanism, np.zeros(len(mechanism.tendons)))
    share = float((excursion(tendon, still) - opened) / (closed - opened))
    if share > SLACK_NOTE:
        yield about(tendon.prim, "slack").found(
            "warning" if share > SLACK_LIMIT else "note",
            f"a slack tendon leaves the mechanism open; here it rests {100.0 * share:.0f} % closed "
            f"at {np.array2string(still, precision=3)}, and the string hangs in what lies before",
            "Stiffen the springs, or turn mjc:springref towards the open end",
        )


def _check_spool(mechanism: Mechanism, tendon: Tendon) -> Iterator[AssetFinding]:
    ends = excursion(tendon, range_positions(mechanism, 2))
    turns = float(np.ptp(ends)) / (2.0 * np.pi * tendon.spool_radius)
    if not LEAST_TURNS < turns <= TURN_LIMIT:
        yield about(tendon.prim, "spool").warning(
            f"a range winds {LEAST_TURNS:g} to {TURN_LIMIT:g} turns of a spool, for which it keeps "
            f"its radius; here {turns:.2g}",
            "Check tendon:spoolRadius [m] and the moment arms [m]",
        )


def _check_closing(mechanism: Mechanism, index: int) -> Iterator[AssetFinding]:
    """Compare the force that closes the mechanism at rest with what the servo can pull."""
    tendon = mechanism.tendons[index]
    needed = closing_tension(mechanism, index)
    if needed <= tendon.force_limit:
        return
    path = closing_path(mechanism, tendon=index)
    wound = float(np.interp(tendon.force_limit, path.tension, path.excursion))
    share = (wound - path.excursion[0]) / (path.excursion[-1] - path.excursion[0])
    drives = share >= REACH_LIMIT
    yield about(tendon.prim, "closing_force").found(
        "note" if drives else "error",
        f"closing takes {needed:.3g} N at rest; the servo's {tendon.force_limit:g} N reach "
        f"{100.0 * share:.0f} % of the range",
        "Nothing, if that is meant" if drives else "Weaken the springs or lengthen the moment arms",
    )


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
    wrong = [
        finding
        for span in tendon.route.spans
        if span.pulley is not None
        for finding in _check_pulley(tendon, tendon.route, span, span.pulley, positions)
    ]
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
