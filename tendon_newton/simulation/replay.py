"""A dataset's recordings through one model: every bench in turn, results in the order asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.mechanisms.kinematics import tip_position
from tendon_newton.mechanisms.mechanism import Mechanism, load_mechanism
from tendon_newton.model_file import Model
from tendon_newton.recording import Recording
from tendon_newton.simulation.parameter_table import spool_radius_of
from tendon_newton.simulation.rollout import TIME_STEP, Rollout, Trajectory


def bench_of(bench: str, model: Model) -> Mechanism:
    """Load a bench with the numbers in which a model says that it differs."""
    mechanism = load_mechanism(bench)
    overrides = model.bench_overrides.get(bench)
    return mechanism if overrides is None else mechanism.with_overrides(overrides)


def replay(
    recordings: Sequence[Recording], model: Model, *, time_step: float = TIME_STEP
) -> list[Trajectory]:
    """Simulate recordings in closed loop from their commands and first rows.

    Raises:
        UnknownName: A bench, the actuator or an effect is not known.
        InvalidModelFile: A number of the model is missing or out of range.
    """
    out: dict[int, Trajectory] = {}
    for bench in dict.fromkeys(r.bench for r in recordings):
        members = [i for i, r in enumerate(recordings) if r.bench == bench]
        rollout = Rollout(
            bench_of(bench, model),
            [recordings[i] for i in members],
            actuator=model.actuator.name,
            effects=[effect.name for effect in model.effects],
            spool_radius=spool_radius_of(model),
            time_step=time_step,
        )
        out.update(zip(members, rollout.run(rollout.base_vectors(model)[None])[0], strict=True))
    return [out[index] for index in range(len(recordings))]


def simulated_recording(recording: Recording, trajectory: Trajectory) -> Recording:
    """Return a recording as the simulation would have logged it."""
    mechanism = load_mechanism(recording.bench).with_overrides(recording.bench_overrides)
    tip = None
    if recording.tip is not None and mechanism.tip is not None:
        points = np.array([tip_position(mechanism, q) for q in trajectory.joint_position])
        tip = points[:, [0, 2]]
    return Recording(
        name=recording.name,
        bench=recording.bench,
        time=recording.time,
        command=recording.command,
        motor_position=trajectory.motor_position,
        motor_velocity=trajectory.motor_velocity,
        force=trajectory.force,
        tip=tip,
        enabled=recording.enabled,
        start=recording.start,
        bench_overrides=recording.bench_overrides,
        actuator_overrides=recording.actuator_overrides,
    )
