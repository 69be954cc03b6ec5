"""Two engines behind one signature: recordings and a model in, one trajectory per recording out."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.errors import look_up
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.mujoco.mujoco_rollout import replay_in_mujoco

Simulator = Callable[..., list[Trajectory]]
SIMULATORS: Mapping[str, Simulator] = {"tendon": replay, "mujoco": replay_in_mujoco}
"""Our own solver (every effect, friction that sticks, gradients), and Newton's SolverMuJoCo."""


def find_simulator(name: str) -> Simulator:
    """Return what simulates recordings by a model, as `replay` does; an unknown name is refused."""
    return look_up("simulator", name, SIMULATORS)


def simulate(
    recordings: Sequence[Recording], model: Model, *, solver: str = "tendon", **options: Any
) -> tuple[Recording, ...]:
    """Return recordings as a model would have made them, from their commands and first rows.

    Args:
        recordings: Recordings of any benches.
        model: Actuator and effects with their numbers.
        solver: A key of ``SIMULATORS``.
        **options: Those of `replay`, such as ``time_step`` [s].

    Raises:
        UnknownName: The solver, a bench, the actuator or an effect is not known.
        InvalidModelFile: A number of the model is missing or out of range.
    """
    trajectories = find_simulator(solver)(recordings, model, **options)
    return tuple(map(simulated_recording, recordings, trajectories))
