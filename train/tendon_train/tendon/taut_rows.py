"""Where both ends of a finger's string were while a load cell said how hard it was pulled."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidDataset
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of

TAUT = 0.3  # Tension from which a row counts [N]: some times what a load cell of 5 kg drifts by
PIECE = 5.0
"""Length of the pieces that a recording is cut into [s]: creep of the joints and wander of the cell
are forgotten within them."""
PROBE = (0.3, 0.4)
"""Posture at which a finger's own kinematics are compared with a planar one's [rad]."""


@dataclass(frozen=True, kw_only=True)
class TautRows:
    """Rows of a piece of a recording in which the tendon pulls."""

    force: Array  # At the load cell [N], shape (N,)
    # What the spool has wound in beyond what the finger has taken, r theta - l [m], (N,)
    surplus: Array

    def __post_init__(self) -> None:
        if self.force.shape != self.surplus.shape:
            raise InvalidDataset(
                f"force and surplus are of the same rows; they have {self.force.size} and "
                f"{self.surplus.size}"
            )


def name_finger(recordings: Sequence[Recording]) -> str:
    """Return the one bench whose recordings show a tip while a load cell pulls.

    Raises:
        InvalidDataset: There is none, or there are several.
    """
    fingers = sorted({r.bench for r in recordings if shows_string(r)})
    if len(fingers) != 1:
        found = ", ".join(fingers) or f"none among {len(recordings)}"
        raise InvalidDataset(
            "give and slack of a tendon are found on train recordings of one finger that hold "
            f"force, tip_x and tip_z, and {TAUT:g} N or more; there are {found}"
        )
    return fingers[0]


def shows_string(recording: Recording) -> bool:
    """Tell whether a recording shows both ends of one tendon and what pulls it."""
    if recording.tip is None or recording.force is None or recording.tendon_count != 1:
        return False
    return bool(np.any((recording.force[:, 0] >= TAUT) & recording.enabled))


def pieces_of(recordings: Sequence[Recording], finger: str, model: Model) -> list[TautRows]:
    """Return the rows with a taut tendon, by pieces, of a finger's recordings that show it."""
    bench, radius = bench_of(finger, model), spool_radius_of(model)
    out = []
    for recording in recordings:
        if recording.bench != finger or not shows_string(recording):
            continue
        assert recording.force is not None
        assert recording.tip is not None
        mechanism = override_mechanism(bench, recording.bench_overrides)
        force, tendon = recording.force[:, 0], mechanism.tendons[0]
        wound = (radius or tendon.spool_radius) * recording.motor_position[:, 0]
        surplus = wound - excursion(tendon, joints_at(recording.tip, mechanism))
        taut = (force >= TAUT) & recording.enabled
        piece = (recording.time - recording.time[0]) // PIECE
        for number in np.unique(piece[taut]):
            here = taut & (piece == number)
            out.append(TautRows(force=force[here], surplus=surplus[here]))
    return out


def joints_at(tip: Array, mechanism: Mechanism) -> Array:
    r"""Return the joint angles that put a finger's tip at x and z, shape (T, J).

    .. math::
        \cos q_2 = \frac{x^2 + z^2 - L_1^2 - L_2^2}{2 L_1 L_2}, \qquad
        q_1 = \operatorname{atan2}(-z, x) - \operatorname{atan2}(L_2 \sin q_2, L_1 + L_2 \cos q_2)
    """
    first, second = planar_lengths(mechanism)
    x, down = tip[:, 0], -tip[:, 1]
    cosine = (x**2 + down**2 - first**2 - second**2) / (2.0 * first * second)
    distal = np.arccos(np.clip(cosine, -1.0, 1.0))
    inner = np.arctan2(second * np.sin(distal), first + second * np.cos(distal))
    return np.column_stack([np.arctan2(down, x) - inner, distal])


def planar_lengths(mechanism: Mechanism) -> tuple[float, float]:
    """Return the lengths of a finger's phalanges [m]; refuse any other mechanism."""
    lengths = [length for length in mechanism.link_lengths if length is not None]
    if len(lengths) == len(mechanism.joints) == 2 and mechanism.tip is not None:
        angles = np.cumsum(PROBE)
        flat = np.array([np.cos(angles) @ lengths, -np.sin(angles) @ lengths])
        tip = tip_position(mechanism, np.array(PROBE))
        if tip is not None and np.allclose(tip[[0, 2]], flat, atol=1.0e-6):
            return lengths[0], lengths[1]
    raise InvalidDataset(
        f"{mechanism.name}: without a load cell a bench must be a slider, or a finger of two "
        "joints in a plane whose tip is seen and which lies along +x at rest"
    )
