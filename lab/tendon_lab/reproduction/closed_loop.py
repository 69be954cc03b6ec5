"""Test recordings in closed loop: what a model makes of a command alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_lab.reproduction.unit import kind_of
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Mask, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.simulation.hosts.replay import simulated_recording
from tendon_newton.simulation.simulators import TendonSimulator

SETTLED = 2.0
"""Start of what counts [s]: one period of the paper's sinusoid, in which a start is forgotten."""
OBSTACLES: dict[str, tuple[float, float]] = {
    # recording's obstacle -> position [rad], stiffness [N/m at the tendon]
    "tape_roll": (0.87, 3000.0),
    "hand": (0.0, 900.0),
}
"""What stands in the way in contact runs, given to every model alike: the virtual bench's own
obstacles. The question is what the servo does, not where the obstacle is."""


@dataclass(frozen=True, kw_only=True)
class Replayed:
    """A recording and what a model makes of its command."""

    recording: Recording
    simulated: Recording

    @property
    def late(self) -> Mask:
        """Rows that count, shape (T,)."""
        return self.recording.time >= self.recording.time[0] + SETTLED

    @property
    def tip_error(self) -> float:
        """Distance of the tips, RMS [m]."""
        assert self.recording.tip is not None
        assert self.simulated.tip is not None
        gap = np.linalg.norm(self.recording.tip - self.simulated.tip, axis=1)
        return rms(gap[self.late])


def replayed(recordings: Sequence[Recording], model: Model, *, time_step: float) -> list[Replayed]:
    """Simulate recordings from their commands and first rows; known obstacles are put in."""
    out: dict[int, Replayed] = {}
    simulator = TendonSimulator(time_step=time_step)
    for obstacle in dict.fromkeys(map(obstacle_of, recordings)):
        members = [i for i, r in enumerate(recordings) if obstacle_of(r) == obstacle]
        own = [recordings[i] for i in members]
        trajectories = simulator.simulate(own, blocked(model, obstacle))
        for place, recording, trajectory in zip(members, own, trajectories, strict=True):
            out[place] = Replayed(
                recording=recording, simulated=simulated_recording(recording, trajectory)
            )
    return [out[place] for place in range(len(recordings))]


def obstacle_of(recording: Recording) -> str | None:
    """Return what stands in the way of a recording, if it is known."""
    kind = kind_of(recording)
    return next((name for name in OBSTACLES if kind.endswith(f"_{name}")), None)


def blocked(model: Model, obstacle: str | None) -> Model:
    """Return a model with an obstacle in its way."""
    if obstacle is None:
        return model
    position, stiffness = OBSTACLES[obstacle]
    values = {"position": position, "stiffness": stiffness}
    others = tuple(e for e in model.effects if e.name != "obstruction")
    return replace(model, effects=(*others, NamedValues(name="obstruction", values=values)))
