"""The part of `diagnose` that takes a folder with a dataset of each joint of an arm."""

from __future__ import annotations

import shlex
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tendon_newton.arms.known_arm import KnownArm
    from tendon_newton.cli.diagnose import DiagnoseConfig
    from tendon_newton.workflows.diagnosing_arm import ArmAnswer


def joint_folders(folder: Path) -> tuple[Path, ...]:
    """Return the datasets inside a folder that is none itself."""
    from tendon_newton.data.dataset import FILE_NAME

    if (folder / FILE_NAME).exists():
        return ()
    return tuple(sorted(path.parent for path in folder.glob(f"*/{FILE_NAME}")))


def diagnose_joints(
    config: DiagnoseConfig, folders: tuple[Path, ...], budget: float | None, start: float
) -> None:
    """Diagnose each joint's servo, and print what was found."""
    from tendon_newton.cli.diagnose import DiagnosisProgress, model_file, read_dataset, summary
    from tendon_newton.data.model_file import load_model
    from tendon_newton.mechanisms.loading import load_mechanism
    from tendon_newton.workflows.diagnosing_arm import ARM_FILE, diagnose_arm_into

    each = {folder.name: replace(config, dataset=folder) for folder in folders}
    progress = DiagnosisProgress(sys.stderr if config.json else sys.stdout, start)
    if budget is not None:
        budget = max(0.0, budget - (time.monotonic() - start))
    answer = diagnose_arm_into(
        config.out,
        {joint: read_dataset(own) for joint, own in each.items()},
        {joint: load_model(model_file(own)) for joint, own in each.items()},
        None if config.arm is None else load_mechanism(config.arm),
        shlex.join(["tendon-newton", *sys.argv[1:]]),
        progress=progress,
        budget=budget,
    )
    if config.json:
        for path in (*(config.out / joint / "diagnosis.json" for joint in answer.servos),
                     *config.out.glob(ARM_FILE)):  # fmt: skip
            print(path)
        return
    for joint, one in answer.servos.items():
        print(
            f"\n{joint}{summary(one.diagnosis)}\n\n  report  {config.out / joint / 'report.html'}"
        )
    if answer.known is not None:
        print("\n".join(["", *arm_lines(answer.known, tuple(answer.servos)), *error_lines(answer)]))


def arm_lines(known: KnownArm, joints: tuple[str, ...]) -> list[str]:
    """Say how an arm stands."""
    place = known.placement
    turned = [joint for joint, sign in zip(joints, place.arm.sign, strict=True) if sign < 0.0]
    silent = [joint for joint, told in zip(joints, place.flipped, strict=True) if told <= 0.0]
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
