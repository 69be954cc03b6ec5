"""Carry an identified model into another simulator.

Writes the target's files, replay.json, and a README.md that says how to load them, how far they
stray from our own simulation of the same commands, and what they leave out.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from tendon_newton.cli.duration import TimeLeft
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import InvalidParameter, listed

if TYPE_CHECKING:
    from tendon_newton.arms.arm import ArmMotion
    from tendon_newton.arms.arm_file import IdentifiedArm


@dataclass(frozen=True, kw_only=True)
class ExportConfig:
    """What to carry where."""

    model: Annotated[Path, tyro.conf.Positional]
    """Model file, a diagnosis (its folder or its diagnosis.json), or a known servo; of an arm, that
    of `diagnose --arm` or its arm.json."""
    to: str
    """Target: mujoco, newton or usd, and urdf for arms; docs/export.md says what each can hold."""
    out: Path  # Folder for the files; made if it is not there.
    bench: str | None = None
    """Bench to export, or the arm's asset; by default that of the recordings or of the diagnosis,
    else the finger."""
    dataset: Path | None = None
    """Dataset whose recordings are replayed, or the folder of joints of an arm; by default some
    steps and a sine."""
    seconds: float = 20.0  # Time of the dataset's commands that is replayed [s]; inf takes all.
    trust: bool = False
    """Trust the network's file from now on: it is a program that runs with your rights."""


def main(config: ExportConfig) -> None:
    """Write the files and say how far they stray."""
    from tendon_newton.arms.arm_file import arm_file, read_arm
    from tendon_newton.diagnosis.diagnosed_bench import recorded_numbers
    from tendon_newton.exports import EXPORTS, find_export
    from tendon_newton.exports.arms import ARM_EXPORTS
    from tendon_newton.exports.arms.arm_export import arm_motions, servo_as_arm, target_of
    from tendon_newton.exports.export_page import measure, told_lines, write_page
    from tendon_newton.exports.source import read_source

    quiet_warp()
    if config.to not in ARM_EXPORTS:
        find_export(config.to)  # a misspelt word is told before files are read
    if (file := arm_file(config.model)) is not None:
        target_of(config.to)
        arm = read_arm(file, config.bench)
        export_joints(config, arm, arm_motions(arm.arm, config.dataset, config.seconds))
        return
    source = read_source(config.model, config.bench, config.dataset, config.seconds)
    if config.to in ARM_EXPORTS and (servo := servo_as_arm(source)) is not None:
        export_joints(config, *servo)
        return
    if config.to in ARM_EXPORTS and config.to not in EXPORTS:
        raise InvalidParameter(
            f"--to {config.to} takes arms, and shafts without a string; "
            f"{source.mechanism.name!r} goes to {listed(EXPORTS)}"
        )
    target, out = find_export(config.to), make_folder(config.out)
    exported = target.write(out, source.mechanism, source.model)
    print(f"  {source.mechanism.name}, as {config.to} has it", flush=True)
    if numbers := recorded_numbers(config.model, source.mechanism.name):
        print(f"  with the asset's {', '.join(numbers)}: recordings had values of their own")
    seconds = sum(run.duration for run in (*source.runs, *source.sines.values()))
    if exported.replays:
        ways = " and by ".join(exported.replays)
        print(f"  replaying {seconds:.0f} s of commands by {ways} ...", flush=True)
    told = TimeLeft(seconds * len(exported.replays))
    fidelity = measure(target, exported, source, trust=config.trust, progress=told)
    write_page(out, f"{source.mechanism.name}, for {config.to}", exported, fidelity)
    print("\n".join(told_lines(fidelity, exported)))
    print(f"\nwrote {', '.join(path.name for path in exported.files)}, README.md to {out}")


def export_joints(config: ExportConfig, arm: IdentifiedArm, motions: tuple[ArmMotion, ...]) -> None:
    """Write the files of an arm, or of a servo alone, and say how far they stray."""
    from tendon_newton.exports.arms import ARM_EXPORTS
    from tendon_newton.exports.arms.arm_export import export_arm, seconds_of

    out, ways = make_folder(config.out), ARM_EXPORTS[config.to].ways
    seconds = seconds_of(motions)
    print(f"  replaying {seconds:.0f} s by {' and by '.join(ways)} ...", flush=True)
    told = TimeLeft(seconds * len(ways))
    exported, lines = export_arm(out, arm, config.to, motions, told)
    print("\n".join(lines))
    print(f"\nwrote {', '.join(path.name for path in exported.files)}, README.md to {out}")
