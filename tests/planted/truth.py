"""What is hidden in a dataset, and how far it moves the held-out signals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.recording import Recording
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import ROW_RATE
from tests.planted.physics.plant import Motion
from tests.planted.sets.draws import NEAR, OUTSIDE
from tests.planted.sets.planted import Planted

Array = NDArray[np.float64]

WEAK = 1.0  # [1] a change of the held-out force below so many noise floors is not to be expected
THETA = 20.0  # [1] floors of the angle that count as one of the force: 0.1 N is about 0.02 rad


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is hidden in a dataset; never part of its folder."""

    # The planted causes, of the catalogue or outside it; none if nothing is hidden
    effects: tuple[str, ...]
    # Parameters of each, as totals where the model already knows part of it
    parameters: Mapping[str, Mapping[str, float]]
    strength: float  # RMS change of the held-out force, in noise floors [1]
    strength_theta: float  # RMS change of the held-out motor angle, in noise floors [1]
    # Held-out RMS errors of the starting model: force [N], motor angle [rad]
    nominal: tuple[float, float]
    true: tuple[float, float]  # The same of the plant itself
    bristle: float  # Travel over which the plant's friction builds up to 63 % [m]

    @property
    def outside(self) -> tuple[str, ...]:
        """The causes that no effect of the catalogue describes."""
        return tuple(name for name in self.effects if name in OUTSIDE)

    @property
    def family(self) -> str:
        """What kind of case it is: clean, outside, single, pair or many."""
        if self.outside:
            return "outside"
        return ("clean", "single", "pair", "many")[min(len(self.effects), 3)]

    def to_json(self) -> dict[str, Any]:
        """Tell it as an exam's truth does, less its name and circumstances."""
        told = [{"name": name, "parameters": dict(self.parameters[name])} for name in self.effects]
        outside = [
            {**cause, "near": list(NEAR.get(cause["name"], ()))}
            for cause in told
            if cause["name"] in OUTSIDE
        ]
        return {
            "family": self.family,
            "effects": [cause for cause in told if cause["name"] not in OUTSIDE],
            "outside": outside,
            "weak": bool(self.effects) and max(self.strength, self.strength_theta / THETA) < WEAK,
            "strength": {
                "ratio": self.strength,
                "ratio_force": self.strength,
                "ratio_theta": self.strength_theta,
            },
            "oracle": {
                name: {"force_rmse": force, "theta_rmse": theta}
                for name, (force, theta) in (("nominal", self.nominal), ("true", self.true))
            },
        }


def totals(planted: Mapping[str, Planted], causes: Causes) -> Mapping[str, Mapping[str, float]]:
    """Name the parameters; of a friction that the model knows in part, the new total."""
    values = {name: dict(cause.parameters) for name, cause in planted.items()}
    if "viscous_friction" in values:
        values["viscous_friction"]["coefficient"] = causes.viscous
    if "coulomb_friction" in values:
        values["coulomb_friction"]["force"] = causes.coulomb
    if "force_saturation" in values:
        values["force_saturation"]["knee"] = causes.knee
    return values


def changes(with_cause: Sequence[Motion], without: Sequence[Motion]) -> tuple[float, float]:
    """RMS change of the cell's force [N] and the motor angle [rad] over all rows."""
    pairs = list(zip(with_cause, without, strict=True))
    return rms([a.cell - b.cell for a, b in pairs]), rms([a.angle - b.angle for a, b in pairs])


def errors(recordings: Sequence[Recording], motions: Sequence[Motion]) -> tuple[float, float]:
    """RMS of measured less predicted force [N] and motor angle [rad] over the rows there are."""
    force, theta = [], []
    for recording, motion in zip(recordings, motions, strict=True):
        rows = np.round(recording.time * ROW_RATE).astype(int)
        force.append(recording.force[:, 0] - motion.cell[rows])
        theta.append(recording.motor_position[:, 0] - motion.angle[rows])
    return rms(force), rms(theta)


def rms(parts: Sequence[Array]) -> float:
    """Root mean square over all parts."""
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
