"""A dataset's recordings through one model: every bench in turn, results in the order asked for."""

from collections.abc import Sequence
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidModelFile, InvalidRecording
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.force_source import ForceSource
from tendon_newton.simulation.hosts.rollout import (
    TIME_STEP,
    Candidates,
    Rollout,
    Stepping,
    Trajectory,
    rollout_groups,
)
from tendon_newton.simulation.model.bench_numbers import without_estimates
from tendon_newton.simulation.model.stated_size import check_size


def bench_of(bench: str, model: Model) -> Mechanism:
    """Load a bench with the numbers in which a model says that it differs.

    Raises:
        InvalidModelFile: A number of the actuator is none of a servo on such a bench.
    """
    mechanism = load_mechanism(bench)
    check_size(model.actuator, mechanism)
    overrides = model.bench_overrides.get(bench)
    return mechanism if overrides is None else override_mechanism(mechanism, overrides)


def rollout_of(
    mechanism: Mechanism,
    recordings: Sequence[Recording],
    model: Model,
    *,
    candidates: Candidates | None = None,
    network: str = "torchscript",
    trust: bool = False,
    stepping: Stepping | None = None,
    device: Any = None,
) -> Rollout:
    """Return the rollout of a model, with its force network where it has one.

    A force network runs as ``torchscript`` or ``fused``. Other arguments are those of `Rollout`.
    """
    held = find_actuator(model.actuator.name).held and recordings[0].command is not None
    force = network_source(model, network, device, trust=trust) if held else None
    return Rollout(
        mechanism, recordings, model, candidates=candidates, force=force, stepping=stepping,
        device=device,
    )  # fmt: skip


def network_source(model: Model, form: str, device: Any, *, trust: bool) -> ForceSource:
    """Return the forces of a model's network."""
    # here, so that equations run without torch
    from tendon_newton.actuators.networks.query import open_query
    from tendon_newton.simulation.hosts.network_source import NetworkSource

    return NetworkSource(open_query(model, form, device, trust=trust))


class Replay:
    """Recordings that one model simulates in closed loop from their commands and first rows.

    It is prepared once, and may run under other loads each time. Arguments are those of `replay`.
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        model: Model,
        *,
        time_step: float = TIME_STEP,
        network: str = "torchscript",
        trust: bool = False,
    ) -> None:
        recordings = [without_estimates(recording, model) for recording in recordings]
        self._rollouts: dict[tuple[int, ...], tuple[Rollout, Array]] = {}
        for members in rollout_groups(recordings):
            rollout = rollout_of(
                bench_of(recordings[members[0]].bench, model),
                [recordings[i] for i in members],
                model,
                network=network,
                trust=trust,
                stepping=Stepping(time_step=time_step),
            )
            self._rollouts[members] = rollout, rollout.base_vectors(model)[None]

    def run(self, loads: Sequence[Array] | None = None) -> list[Trajectory]:
        """Simulate all recordings, under loads on their joints [N m], shape (T,) each, if given."""
        out: dict[int, Trajectory] = {}
        for members, (rollout, vectors) in self._rollouts.items():
            if loads is not None:
                rollout.load([loads[index] for index in members])
            out.update(zip(members, rollout.run(vectors)[0], strict=True))
        return [out[index] for index in range(len(out))]


def replay(
    recordings: Sequence[Recording],
    model: Model,
    *,
    time_step: float = TIME_STEP,
    network: str = "torchscript",
    trust: bool = False,
) -> list[Trajectory]:
    """Simulate recordings in closed loop from their commands and first rows.

    A force network runs as ``torchscript`` or ``fused``; its file may be trusted from now on.

    Raises:
        UnknownName: A bench, the actuator or an effect is not known.
        InvalidModelFile: A number of the model is missing or out of range.
    """
    return Replay(recordings, model, time_step=time_step, network=network, trust=trust).run()


def simulate(
    recordings: Sequence[Recording], model: Model, **options: Any
) -> tuple[Recording, ...]:
    """Return recordings as a model would have made them, from their commands and first rows.

    Args:
        recordings: Recordings of any benches.
        model: Actuator and effects with their numbers.
        **options: Those of `replay`, such as ``time_step`` [s].

    Raises:
        UnknownName: A bench, the actuator or an effect is not known.
        InvalidModelFile: A number of the model is missing or out of range.
    """
    return tuple(map(simulated_recording, recordings, replay(recordings, model, **options)))


def simulated_recording(recording: Recording, trajectory: Trajectory) -> Recording:
    """Return a recording as the simulation would have logged it.

    Raises:
        InvalidModelFile: No bench could be recorded so.
    """
    mechanism = override_mechanism(load_mechanism(recording.bench), recording.bench_overrides)
    tip = None if recording.tip is None else tip_position(mechanism, trajectory.joint_position)
    try:
        return Recording(
            name=recording.name,
            bench=recording.bench,
            time=recording.time,
            command=recording.command,
            motor_position=trajectory.motor_position,
            motor_velocity=trajectory.motor_velocity,
            force=trajectory.force,
            joint_position=None
            if recording.joint_position is None
            else trajectory.joint_position[:, : recording.joint_position.shape[1]],
            joint_load=recording.joint_load,
            tip=None if tip is None else tip[:, [0, 2]],
            enabled=recording.enabled,
            start=recording.start,
            bench_overrides=recording.bench_overrides,
            actuator_overrides=recording.actuator_overrides,
        )
    except InvalidRecording as error:
        raise InvalidModelFile(
            f"the model moves its bench as no bench moves, in a simulation of {error}: look at its "
            "moment arms, spool radius and other numbers of the bench"
        ) from error
