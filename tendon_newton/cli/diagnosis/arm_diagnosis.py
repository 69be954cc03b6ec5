"""What `diagnose` says of an arm: how it stands, and its servos' errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tendon_newton.arms.known_arm import KnownArm
    from tendon_newton.workflows.diagnosing_arm import ArmAnswer


def arm_lines(known: KnownArm) -> list[str]:
    """Say how an arm stands."""
    place = known.placement
    joints = known.arm.mechanism.joint_names
    turned = [joint for joint, sign in zip(joints, place.arm.sign, strict=True) if sign < 0.0]
    silent = [joint for joint, told in zip(joints, place.sign_told, strict=True) if not told]
    lines = [f"servos that count the other way: {', '.join(turned) or 'none'}"]
    if silent:
        lines.append(f"  weight does not tell of {', '.join(silent)}: taken as the file counts")
    zeros = zip(joints, place.arm.zero, place.zero_sd, strict=True)
    told = [(joint, zero, sd) for joint, zero, sd in zeros if joint not in silent]
    lines.append(f"zeros [mrad]: {in_mrad(told) or 'not told'}")
    tilts = list(zip("xy", place.tilt, place.tilt_sd, strict=True))
    lines.append(f"base tilted [mrad] about {in_mrad(tilts)}")
    if known.arm.floor is not None:
        lines.append(f"the tip rests on something {1e3 * known.arm.floor:.0f} mm above the base")
    return lines


def in_mrad(angles: Sequence[tuple[str, float, float]]) -> str:
    """Write angles with twice their standard deviations [rad] after what they are of."""
    return ", ".join(f"{of} {1e3 * angle:.0f} +- {2e3 * sd:.0f}" for of, angle, sd in angles)


def error_lines(answer: ArmAnswer) -> list[str]:
    """Return the table of errors on test recordings [mrad]."""
    lines = [
        "",
        "held-out RMS [mrad]: the start and the diagnosis, loaded by what the arm did; then",
        "plain servos and the diagnosis, all servos together under their commands alone",
    ]
    for joint, one in answer.servos.items():
        errors = (one.diagnosis.baseline.theta_rmse, one.diagnosis.extended.theta_rmse,
                  answer.plain[joint], answer.together[joint])  # fmt: skip
        lines.append(f"  {joint:18s}" + " ".join(f"{1e3 * error:8.1f}" for error in errors))
    return lines
