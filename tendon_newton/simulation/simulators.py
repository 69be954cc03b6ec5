"""Two engines behind one interface: recordings and a model in, one trajectory per recording out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.errors import look_up
from tendon_newton.simulation.hosts.replay import bench_of, replay, simulated_recording
from tendon_newton.simulation.hosts.rollout import TIME_STEP, Trajectory
from tendon_newton.simulation.mujoco.mujoco_rollout import MUJOCO_STEP, MujocoRollout


@dataclass(frozen=True, kw_only=True)
class TendonSimulator:
    """Our own solver: every effect, friction that sticks, gradients."""

    time_step: float = TIME_STEP  # Longest step [s]
    network: str = "torchscript"  # How a force network runs: torchscript or fused
    trust: bool = False  # Whether to trust its file from now on

    def simulate(self, recordings: Sequence[Recording], model: Model) -> list[Trajectory]:
        """Return what a model makes of each recording."""
        return replay(
            recordings, model, time_step=self.time_step, network=self.network, trust=self.trust
        )


@dataclass(frozen=True, kw_only=True)
class MujocoSimulator:
    """Newton's SolverMuJoCo with the same tendons and most of the effects."""

    time_step: float = MUJOCO_STEP  # Step [s]
    network: str = "torchscript"  # How a force network runs: torchscript or fused
    trust: bool = False  # Whether to trust its file from now on

    def simulate(self, recordings: Sequence[Recording], model: Model) -> list[Trajectory]:
        """Return what a model makes of each recording."""
        out: dict[int, Trajectory] = {}
        for bench in dict.fromkeys(r.bench for r in recordings):
            members = [i for i, r in enumerate(recordings) if r.bench == bench]
            rollout = MujocoRollout(
                bench_of(bench, model),
                [recordings[i] for i in members],
                model,
                time_step=self.time_step,
                network=self.network,
                trust=self.trust,
            )
            out.update(zip(members, rollout.run(), strict=True))
        return [out[index] for index in range(len(recordings))]


SIMULATORS: dict[str, type[TendonSimulator] | type[MujocoSimulator]] = {
    "tendon": TendonSimulator,
    "mujoco": MujocoSimulator,
}


def find_simulator(name: str) -> type[TendonSimulator] | type[MujocoSimulator]:
    """Return a simulator by its name; an unknown one is refused."""
    return look_up("simulator", name, SIMULATORS)


def simulate(
    recordings: Sequence[Recording], model: Model, *, solver: str = "tendon", **options: Any
) -> tuple[Recording, ...]:
    """Return recordings as a model would have made them, from their commands and first rows.

    Args:
        recordings: Recordings of any benches.
        model: Actuator and effects with their numbers.
        solver: A key of ``SIMULATORS``.
        **options: Fields of that simulator, such as ``time_step`` [s].

    Raises:
        UnknownName: The solver, a bench, the actuator or an effect is not known.
        InvalidModelFile: A number of the model is missing or out of range.
    """
    trajectories = find_simulator(solver)(**options).simulate(recordings, model)
    return tuple(map(simulated_recording, recordings, trajectories))
