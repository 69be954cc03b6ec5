"""How far two runs of the same commands lie apart, and what an effect that is left out costs."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tendon_newton.data.excitations import RATE
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.simulation.hosts.replay import bench_of, rollout_of
from tendon_newton.simulation.hosts.rollout import Trajectory, rollout_groups

STANDARD_SPAN = (0.1, 0.8)  # Share of a bench's range between which the standard commands move
# How long a sine lasts [s], by its first and last frequency [Hz]
SINES = {(0.5, 0.5): 2.0, (2.0, 2.0): 1.0, (8.0, 8.0): 0.5, (0.5, 8.0): 3.0}
# Share of the same span between which the one moves whose frequency grows: it lets a string go
# loose and closes into end stops, where simulators differ most
BEYOND = (-0.3, 1.4)
SWING = (-0.5, 0.5)  # Range of the standard commands on a bench without end stops [rad]


@dataclass(frozen=True, kw_only=True)
class Departure:
    """Root mean squares over all rows of all runs."""

    angle: float  # Angle of the motor [rad]
    # Force at the load cell [N]; of a shaft, a torque [N m]; None where no cell is
    force: float | None
    tip: float | None  # Place of the tip [m]; None where the bench has none
    force_unit: str = "N"  # Unit of the force, ``N m`` on a shaft
    push: float = 0.0  # By how much a string's tension goes below zero [N], at most

    @property
    def text(self) -> str:
        """Say it in the units of a bench."""
        tip = "-" if self.tip is None else f"{1e3 * self.tip:.3f} mm"
        force = "-" if self.force is None else f"{self.force:.4f} {self.force_unit}"
        return f"{1e3 * self.angle:.2f} mrad | {force} | {tip}"


def departure(
    mechanism: Mechanism, one: Sequence[Trajectory], other: Sequence[Trajectory]
) -> Departure:
    """Return how far runs of the same commands lie apart."""
    pairs = list(zip(one, other, strict=True))
    tip = None
    if mechanism.tip is not None:
        tip = pooled([tips(mechanism, a) - tips(mechanism, b) for a, b in pairs])
    shafts = all(tendon.direct for tendon in mechanism.tendons)
    return Departure(
        angle=pooled([a.motor_position - b.motor_position for a, b in pairs]),
        force=pooled([a.force - b.force for a, b in pairs]),
        tip=tip,
        force_unit="N m" if shafts and mechanism.joints[0].kind == "revolute" else "N",
        push=max((pushed(mechanism, a, b) for a, b in pairs), default=0.0),
    )


def pushed(mechanism: Mechanism, one: Trajectory, other: Trajectory) -> float:
    """Return how far a run's strings go below zero, and below what a cell's error shows [N]."""
    strings = [d for d, tendon in enumerate(mechanism.tendons) if not tendon.direct]
    least = np.minimum(other.force[:, strings].min(axis=0), 0.0)
    return float(np.max(least - one.force[:, strings].min(axis=0), initial=0.0))


def pooled(differences: Sequence[Array]) -> float:
    """Return the root mean square over all runs."""
    return rms(np.concatenate([d.ravel() for d in differences]))


def tips(mechanism: Mechanism, trajectory: Trajectory) -> Array:
    """Return where the tip was in each row [m], shape (T, 3)."""
    return np.array([tip_position(mechanism, q) for q in trajectory.joint_position])


def standard_runs(mechanism: Mechanism, radius: float | None = None) -> list[Recording]:
    """Return commands that tell a servo and its tendon apart, for a bench without recordings.

    They are steps and their return, and a sine, inside the range of the bench. A spool's radius [m]
    may stand for the asset's.
    """
    time = np.arange(round(3.0 * RATE)) / RATE
    low, high = command_range(mechanism, radius)
    steps = np.floor(2.0 * time) % 2.0
    sine = 0.5 - 0.5 * np.cos(1.5 * np.pi * (time - 1.5))
    share = np.where(time < 1.5, steps, sine)  # 0, 1, 0, then from 0 at 1.5 s
    return [asked_of(mechanism, "standard", time, low + (high - low) * share)]


def sines(mechanism: Mechanism, radius: float | None = None) -> dict[str, Recording]:
    """Return a sine of each of some frequencies, by name; all else is as for `standard_runs`."""
    low, high = command_range(mechanism, radius)
    out = {}
    for (first, last), seconds in SINES.items():
        time = np.arange(round(seconds * RATE) + 1) / RATE
        turns = first * time + 0.5 * (last - first) * time**2 / seconds
        name, (least, most) = f"{first:g} Hz", (0.0, 1.0)
        if first != last:
            name, (least, most) = f"{first:g} to {last:g} Hz, beyond both ends", BEYOND
        share = least + (most - least) * (0.5 - 0.5 * np.cos(2.0 * np.pi * turns))
        out[name] = asked_of(mechanism, name, time, low + (high - low) * share)
    return out


def asked_of(mechanism: Mechanism, name: str, time: Array, command: Array) -> Recording:
    """Return commands (T,) [rad] of all servos of a bench, nothing of which was measured."""
    command = np.repeat(command[:, None], len(mechanism.tendons), axis=1)
    nothing = np.zeros_like(command)
    return Recording(
        name=name, bench=mechanism.name, time=time, command=command,
        motor_position=nothing, motor_velocity=nothing,
    )  # fmt: skip


def command_range(mechanism: Mechanism, radius: float | None = None) -> tuple[float, float]:
    """Return motor angles [rad] inside the range of a bench."""
    upper = np.array([joint.limits[1] for joint in mechanism.joints])
    if not np.isfinite(upper).all():
        return SWING
    tendon = mechanism.tendons[0]
    reach = float(np.abs(tendon.moment_arm) @ upper) / (radius or tendon.spool_radius)
    return STANDARD_SPAN[0] * reach, STANDARD_SPAN[1] * reach


def replayed(
    target: ExportTarget,
    exported: Exported,
    way: str,
    model: Model,
    recordings: Sequence[Recording],
) -> list[Trajectory]:
    """Run recordings in the target; one with numbers of its own is exported anew for that."""
    out = []
    for recording in recordings:
        if not has_numbers(recording):
            out.append(exported.replays[way](recording))
            continue
        bench = override_mechanism(bench_of(recording.bench, model), recording.bench_overrides)
        values = {**model.actuator.values, **recording.actuator_overrides}
        servo = replace(model, actuator=replace(model.actuator, values=values))
        with tempfile.TemporaryDirectory() as folder:
            own = target.write(Path(folder), bench, servo)
            out.append(own.replays[way](recording))
    return out


def has_numbers(recording: Recording) -> bool:
    """Tell whether a recording states numbers of its bench or its servo."""
    return bool(recording.bench_overrides.given or recording.actuator_overrides)


def with_and_without(
    model: Model, recordings: Sequence[Recording], effects: Sequence[str], *, trust: bool = False
) -> tuple[list[Trajectory], dict[str, list[Trajectory]]]:
    """Return our own simulation of recordings, and what it is without each of some effects.

    Each of these effects of the model is left out alone.
    """
    found: list[dict[int, Trajectory]] = [{} for _ in range(1 + len(effects))]
    for members in rollout_groups(recordings):
        group = [recordings[i] for i in members]
        bench = bench_of(group[0].bench, model)
        rollout = rollout_of(bench, group, model, trust=trust)
        base = rollout.base_vectors(model)
        null = rollout.table.null_vector()
        candidates = [base]
        for name in effects:
            columns = list(rollout.table.columns(name))
            candidates.append(base.copy())
            candidates[-1][:, columns] = null[columns]
        for known, runs in zip(found, rollout.run(np.stack(candidates)), strict=True):
            known.update(zip(members, runs, strict=True))
    full, *fewer = ([known[i] for i in range(len(recordings))] for known in found)
    return full, dict(zip(effects, fewer, strict=True))
