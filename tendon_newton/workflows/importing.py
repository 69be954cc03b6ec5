"""The gate for logs on their way in: where they start, and what their bench says against them.

Every importer's logs pass here, and none is refused for what its columns hold: findings of
`tendon_newton.data.checks` are written by `write_import` in `tendon_newton.data.importers.writing`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tendon_newton.data.bench_overrides import BENCH_OVERRIDE_RANGES, OF_BENCH
from tendon_newton.data.checks.bench_checks import BenchFacts
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.first_rows import first_row, start_of
from tendon_newton.data.checks.lint import mended
from tendon_newton.data.checks.set_checks import other_gain
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.importers.split import read_conditions, split_logs
from tendon_newton.data.importers.writing import ImportReport, write_import
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import SERVO, Recording
from tendon_newton.errors import unknown_name
from tendon_newton.mechanisms.asset_library import asset_files, unknown_asset

if TYPE_CHECKING:
    from tendon_newton.mechanisms.geometry.mechanism import Mechanism

LITTLE = 1e-3  # [rad] an error at which no servo is at its limit
MOVING = ("armature", "kd")  # Numbers that make no force at rest
LEAST_JUMP = 0.01  # [rad] of a first command; the slowest encoder's noise is a tenth of it


def admit(imported: Imported) -> Imported:
    """Decide where each log starts, and add what its bench says against it.

    Raises:
        UnknownName: No asset has the name of a log's bench.
    """
    from tendon_newton.simulation.model.stated_size import check_size

    # a servo whose load is not known may be of any size
    for bench in {log.recording.bench for log in imported.logs} - {SERVO}:
        check_size(imported.model.actuator, bench_of(bench))
    passed = [admit_log(log, imported) for log in imported.logs]
    gains = stated_gains([log.recording for log in imported.logs], imported.model)
    return replace(
        imported,
        logs=tuple(log for log, _ in passed),
        findings=(*imported.findings, *gains, *(told for _, told in passed if told is not None)),
    )


def stated_gains(recordings: Sequence[Recording], model: Model) -> tuple[Finding, ...]:
    """Say where a servo's stated numbers are far from what the forces of recordings grow by."""
    from tendon_newton.actuators import find_actuator  # loads Warp

    kind = find_actuator(model.actuator.name)
    needed = {one.name: one.unit for one in kind.parameters if not one.optional}
    groups: dict[float, list[Recording]] = {}
    for recording in recordings:
        values = {**model.actuator.values, **recording.actuator_overrides}
        if recording.bench == SERVO or not all(name in values for name in needed):
            continue
        radius = values.get("spool_radius") or bench_of(recording.bench).tendons[0].spool_radius
        ends = (kind.static_force(values, k * LITTLE, float(radius)) for k in (1.0, 2.0))
        if np.isfinite(gain := float(np.diff([*ends])[0]) / LITTLE) and gain > 0.0:
            groups.setdefault(gain, []).append(recording)
    numbers = [f"{name} [{unit}]" for name, unit in needed.items() if name not in MOVING]
    return tuple(one for gain, own in groups.items() for one in other_gain(own, gain, numbers))


def write_parts(
    imported: Imported, out: Path, test: Sequence[str] = (), train: Sequence[str] = ()
) -> dict[Path, ImportReport]:
    """Write what becomes a dataset each into folders of their names, or one dataset.

    Args:
        imported: Logs that were admitted.
        out: Folder of the dataset, or of the datasets' folders.
        test: Conditions of the test split, such as ``episode=3``.
        train: Those of the train split.

    Raises:
        InvalidParameter: A condition is none, or selects nothing.
        InvalidOutput: Something else lies in the folder.
    """
    held, seen = read_conditions(test, "--test"), read_conditions(train, "--train")
    parts = {out / name: part for name, part in imported.parts().items()} or {out: imported}
    return {
        place: write_import(part, split_logs(part.logs, held, seen), place, known_bench)
        for place, part in parts.items()
    }


def mend(imported: Imported) -> Imported:
    """Return logs after all mends that no reader would do otherwise, and what was mended."""
    passed = [mended(log.recording) for log in imported.logs]
    return replace(
        imported,
        logs=tuple(
            replace(log, recording=recording)
            for log, (recording, _) in zip(imported.logs, passed, strict=True)
        ),
        findings=(*imported.findings, *(finding for _, found in passed for finding in found)),
    )


def known_bench(recording: Recording) -> BenchFacts | None:
    """Return what is known of a recording's bench; None where nothing is of its load."""
    if recording.bench == SERVO:
        return None
    from tendon_newton.mechanisms.bench_facts import facts_of  # loads Newton, for some seconds

    return facts_of(recording.bench, recording.bench_overrides)


def admit_log(log: ImportedLog, imported: Imported) -> tuple[ImportedLog, Finding | None]:
    """Return a log with its start, and why it has that one."""
    if not log.open_start:
        return log, None
    recording = log.recording
    why = begins_in_motion(recording) or begins_with_jump(recording) or rests_briefly(recording)
    start = "equilibrium" if why is None else "first_row"
    if recording.command is None:
        told = what_leads(recording, imported.model)
        return replace(log, recording=replace(recording, start=start), open_start=False), told
    told = Examined(recording.name, "theta").note(
        why or "rests under its first command",
        "a simulation starts from "
        + ("that rest" if why is None else "the first row")
        + f' (start = "{start}"); the mapping may say otherwise',
    )
    return replace(log, recording=replace(recording, start=start), open_start=False), told


def what_leads(recording: Recording, model: Model) -> Finding | None:
    """Say what a log without a command is taken for; None where the model takes its angle."""
    from tendon_newton.actuators import find_actuator  # loads Warp

    if find_actuator(model.actuator.name).leads:
        return None
    return Examined(recording.name, "theta_d").note(
        "no command is mapped, so that the measured force drives the mechanism",
        'to ask what force a given angle takes, say kind = "measured_path" under [model] in the '
        "mapping",
    )


def begins_in_motion(recording: Recording) -> str | None:
    """Say for how long the unknown past of a moving shaft shows; None where it rests."""
    doubtful = first_row(recording).doubtful
    if doubtful == 0.0:
        return None
    return (
        "begins in motion: what was commanded before is not known, and the rows of its first "
        f"{doubtful:.2f} s count for nothing"
    )


def begins_with_jump(recording: Recording) -> str | None:
    """Say how far the first command is from that under which a shaft rested; None where near."""
    before = first_row(recording).before
    if before is None or recording.command is None:
        return None
    jump = max(recording.command[0] - before, key=abs)
    if abs(jump) <= LEAST_JUMP:
        return None
    return f"begins at rest with a jump of the command, by {1e3 * jump:+.0f} mrad"


def rests_briefly(recording: Recording) -> str | None:
    """Say that the first rows do not show where friction holds; None where they do."""
    if start_of(replace(recording, start="equilibrium")) is not None:
        return None
    return "rests in the first row, and where friction lets it rest is not known"


def refuse_model(model: Model) -> None:
    """Refuse a model whose numbers no simulation would take.

    Raises:
        InvalidModelFile: A number is missing, unknown or outside its range.
        UnknownName: No actuator has that name, or a number to fit is none of its.
    """
    from tendon_newton.actuators import find_actuator
    from tendon_newton.simulation.model.parameter_table import SHARED_KEYS, check_values

    actuator = model.actuator
    own = {key: value for key, value in actuator.values.items() if key not in SHARED_KEYS}
    declared = find_actuator(actuator.name).parameters
    if actuator.values:
        check_values(replace(actuator, values=own), declared, f"actuator {actuator.name!r}")
    known = [parameter.name for parameter in declared]
    known += ["spool_radius", *(key for key in BENCH_OVERRIDE_RANGES if key not in OF_BENCH)]
    for name in model.fit:
        if name not in known:
            raise unknown_name("number to fit", name, known)


def spool_radius(bench: str) -> float:
    """Return the radius [m] of a bench's spool, as its asset states it."""
    return bench_of(bench).tendons[0].spool_radius


@cache
def bench_of(name: str) -> Mechanism:
    """Return a bench as its asset has it."""
    from tendon_newton.mechanisms.loading import load_mechanism  # loads Newton, for some seconds

    check_bench(name)
    return load_mechanism(name)


def check_bench(name: str) -> None:
    """Refuse a bench that nothing could simulate."""
    if name not in asset_files():
        raise unknown_asset("bench", name)
