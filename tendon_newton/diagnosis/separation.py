"""Which run would tell two causes apart: the one on which their fitted models differ most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.effects import EFFECTS
from tendon_newton.excitations import EXCITATIONS, excite
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.study import Study
from tendon_newton.model_file import Model
from tendon_newton.recording import Recording

DURATION = 12.0
"""Length of a proposed run [s]."""
TENDON_BENCHES = ("finger", "spring_weak", "spring_strong")
"""Benches on which a run may be proposed for a servo with a tendon; a direct drive stays put."""
STEP = 5.0e-4
"""Simulation step [s]."""
SEED = 7


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """A run that separates two causes."""

    bench: str
    excitation: str
    theta: float
    """RMS by which the two models' motor angles differ [rad]."""
    force: float | None
    """The same of the tension [N]."""
    separation: float
    """Root of the summed squared differences, in noise floors."""

    def text(self, names: Sequence[str]) -> str:
        """Return the proposal as a sentence."""
        force = "" if self.force is None else f" and {self.force:.2g} N"
        return (
            f"record {DURATION:.0f} s of {self.excitation} on bench {self.bench!r}: "
            f"there {' and '.join(names)} differ by {1e3 * self.theta:.2g} mrad{force} RMS"
        )


def propose(
    recordings: Sequence[Recording],
    model: Model,
    first: Mapping[int, float],
    second: Mapping[int, float],
    noise: NoiseFloor,
) -> Proposal:
    """Choose bench and excitation by simulating both fitted models on all of them.

    Args:
        recordings: The runs at hand; their benches come first, and say whether there is a load
            cell.
        model: The starting model.
        first: One cause's fitted parameters, column -> value, in kernels with the whole catalogue.
        second: The other's.
        noise: What the sensors leave.
    """
    own = list(dict.fromkeys(r.bench for r in recordings))
    benches = (
        own
        if not set(own) <= set(TENDON_BENCHES)
        else [*own, *(b for b in TENDON_BENCHES if b not in own)]
    )
    has_force = any(r.force is not None for r in recordings)
    runs = [
        planned_run(bench, name, recordings, has_force) for bench in benches for name in EXCITATIONS
    ]
    study = Study(runs, model, tuple(EFFECTS), time_step=STEP)
    pairs = zip(runs, study.trajectories(first), study.trajectories(second), strict=True)
    proposals = []
    for run, a, b in pairs:
        theta = float(np.sqrt(np.mean((a.motor_position - b.motor_position) ** 2)))
        force = float(np.sqrt(np.mean((a.force - b.force) ** 2))) if has_force else None
        separation = np.hypot(theta / noise.theta, (force or 0.0) / (noise.force or 1.0))
        bench, excitation = run.bench, run.name
        proposals.append(
            Proposal(
                bench=bench,
                excitation=excitation,
                theta=theta,
                force=force,
                separation=float(separation),
            )
        )
    return max(proposals, key=lambda p: p.separation)


def planned_run(
    bench: str, excitation: str, recordings: Sequence[Recording], has_force: bool
) -> Recording:
    """Return a recording that has commands and, in place of measurements, zeros."""
    time, command = excite(excitation, DURATION, np.random.default_rng(SEED))
    like = next((r for r in recordings if r.bench == bench), recordings[0])
    blank = np.zeros((len(time), 1))
    return Recording(
        name=excitation,
        bench=bench,
        time=time,
        command=command[:, None],
        motor_position=blank,
        motor_velocity=blank,
        force=blank if has_force else None,
        bench_overrides=like.bench_overrides,
        actuator_overrides=like.actuator_overrides,
    )
