"""The gate for logs on their way in: where they start, and what their bench says against them.

Every importer's logs pass here. What needs no bench is checked with the recordings themselves
(`tendon_newton.data.checks`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.recording import Array, BenchOverrides, Recording
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.asset_library import asset_files, unknown_asset

if TYPE_CHECKING:
    from tendon_newton.mechanisms.geometry.mechanism import Mechanism

FIRST_ROWS = 3  # before a servo answers a command that begins with the log
AT_REST = 0.01  # [rad] from the friction-free rest; the slowest encoder's noise is a tenth of it
PUSH = 0.1  # [N] mean below zero that no load cell's offset explains after taring
STRONGER = 1.5  # [1] times the servo's limit, which no load cell misses by
OVERSHOOT = 0.05  # [1] of the range, which no end stop gives way by
REACH = 5.0  # [1] times the bench's range, which no spool misses by


@dataclass(frozen=True, kw_only=True)
class ImportedRest:
    """A bench's friction-free equilibria under its only tendon."""

    angle: Array  # Motor angle [rad], increasing, shape (N,)
    tension: Array  # Tension that holds it there [N], shape (N,)

    def angle_under(self, command: float, gain: float) -> float:
        """Return the motor angle [rad] at which a spring of some gain [N/rad] rests."""
        surplus = self.tension - gain * (command - self.angle)
        if surplus[0] > 0.0:
            return min(command, float(self.angle[0]))  # slack: nothing pulls the motor away
        return float(np.interp(0.0, surplus, self.angle))


def admit(imported: Imported) -> Imported:
    """Decide where each log starts, and add what its bench says against it.

    Raises:
        UnknownName: No asset has the name of a log's bench.
    """
    for bench in {log.recording.bench for log in imported.logs}:
        check_bench(bench)
    passed = [admit_log(log, imported) for log in imported.logs]
    found = [finding for log in imported.logs for finding in against(log.recording)]
    return replace(
        imported,
        logs=tuple(log for log, _ in passed),
        findings=(*imported.findings, *found, *(told for _, told in passed if told is not None)),
    )


def admit_log(log: ImportedLog, imported: Imported) -> tuple[ImportedLog, Finding | None]:
    """Return a log with its start, and why it has that one."""
    if not log.open_start:
        return log, None
    recording = log.recording
    why = moved_at_first(recording) or away_from_rest(recording, imported)
    start = "equilibrium" if why is None else "first_row"
    told = Examined(recording.name, "theta").note(
        why or "stands where a bench without friction rests under the first command",
        "a simulation starts from "
        + ("the equilibrium" if why is None else "the first row")
        + f' (start = "{start}"); the mapping may say otherwise',
    )
    return replace(log, recording=replace(recording, start=start), open_start=False), told


def moved_at_first(recording: Recording) -> str | None:
    """Say how far a shaft turns within the first rows; None where it rests."""
    moved = float(np.ptp(recording.motor_position[:FIRST_ROWS], axis=0).max())
    return f"turns by {1e3 * moved:.0f} mrad in the first rows" if moved > AT_REST else None


def away_from_rest(recording: Recording, imported: Imported) -> str | None:
    """Say how far the first row is from the friction-free rest; None where it is there."""
    values = {**imported.model.actuator.values, **recording.actuator_overrides}
    gain = values.get("gain")
    rest = rest_of(recording.bench, recording.bench_overrides, values.get("spool_radius"))
    if rest is None or recording.command is None or not isinstance(gain, float):
        return "rests in the first row, and where it would without friction is not known"
    expected = rest.angle_under(float(recording.command[0, 0]), gain)
    away = float(recording.motor_position[0, 0]) - expected
    if abs(away) <= AT_REST:
        return None
    return f"rests {1e3 * away:+.0f} mrad from where it would without friction"


@cache
def rest_of(
    bench: str, overrides: BenchOverrides, radius: float | str | None
) -> ImportedRest | None:
    """Return where a bench rests; None where that is not known."""
    from tendon_newton.mechanisms.geometry.overrides import override_mechanism
    from tendon_newton.mechanisms.geometry.statics import closing_path

    mechanism = override_mechanism(bench_of(bench), overrides)
    if len(mechanism.tendons) != 1 or not pulls_within_limits(mechanism):
        return None
    try:
        path = closing_path(mechanism)
    except InvalidParameter:
        return None
    radius = radius if isinstance(radius, float) else mechanism.tendons[0].spool_radius
    order = np.argsort(path.excursion)
    return ImportedRest(angle=path.excursion[order] / radius, tension=path.tension[order])


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


def pulls_within_limits(mechanism: Mechanism) -> bool:
    """Tell whether strings pull joints that have ends."""
    ends = np.isfinite([joint.limits for joint in mechanism.joints]).all()
    return bool(ends) and not any(tendon.direct for tendon in mechanism.tendons)


def against(recording: Recording) -> Iterator[Finding]:
    """Say what a recording holds that its bench cannot do."""
    if recording.force is None:
        return
    mechanism = bench_of(recording.bench)
    yield from too_strong(recording, recording.force, mechanism)
    yield from beyond_rail(recording, mechanism)
    if pulls_within_limits(mechanism):
        yield from pushed(recording, recording.force)
        yield from beyond_reach(recording, mechanism)


def too_strong(recording: Recording, force: Array, mechanism: Mechanism) -> Iterator[Finding]:
    """A force that is far beyond what the asset lets its servo give."""
    limit = max(tendon.force_limit for tendon in mechanism.tendons)
    most = float(np.abs(force).max())
    if most > STRONGER * limit:
        yield Examined(recording.name, "force").defect(
            f"reaches {most:.4g}, and the servo of {mechanism.name} gives at most "
            f"{limit:.4g} by its asset",
            "a simulation stops at the asset's limit: raise tendon:forceLimit there "
            "(--force-limit of asset new), or the force is in another unit",
        )


def beyond_rail(recording: Recording, mechanism: Mechanism) -> Iterator[Finding]:
    """A cart that stands where its rail has ended."""
    (joint, *others), (tendon, *_) = mechanism.joints, mechanism.tendons
    if not tendon.direct or others or not np.isfinite(joint.limits).all():
        return
    place = recording.motor_position[:, 0] * tendon.spool_radius / float(tendon.moment_arm[0])
    low, high = joint.limits
    beyond = float(max(low - place.min(), place.max() - high))
    if beyond > OVERSHOOT * (high - low):
        yield Examined(recording.name, "theta").defect(
            f"lies up to {beyond:.3g} m beyond the range of {mechanism.name}, "
            f"{low:.3g} to {high:.3g} m",
            "its zero is another one (offset in the mapping), or the range is (--range "
            "of asset new)",
        )


def pushed(recording: Recording, force: Array) -> Iterator[Finding]:
    """A tension below zero: a string cannot push."""
    mean = float(force.mean())
    if mean < -PUSH:
        share = float((force < 0.0).mean())
        yield Examined(recording.name, "force").defect(
            f"{mean:.2f} N on average, below zero in {100.0 * share:.0f} % of the rows",
            "a string cannot push: its sign is the other one (sign = -1 in the "
            "mapping), or its zero is off",
        )


def beyond_reach(recording: Recording, mechanism: Mechanism) -> Iterator[Finding]:
    """A motor that turns much farther than its bench reaches."""
    ends = np.array([joint.limits for joint in mechanism.joints])
    reach = max(  # from one end of all joints to the other [rad]
        float(np.abs(tendon.moment_arm) @ np.ptp(ends, axis=1)) / tendon.spool_radius
        for tendon in mechanism.tendons
    )
    span = float(np.ptp(recording.motor_position, axis=0).max())
    if span > REACH * reach:
        yield Examined(recording.name, "theta").defect(
            f"spans {span:.3g} rad, and the whole range of {mechanism.name} is {reach:.3g} rad",
            'theta is in degrees (unit = "deg" in the mapping), or the bench is another one',
        )
