"""Where both ends of a finger's string were while a load cell said how hard it was pulled."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidDataset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of
from tendon_train.actuator.without_cell.sensorless_motion import joints_at

TAUT = 0.3
"""Tension from which a row counts [N]: some times what a load cell of 5 kg drifts by."""
PIECE = 5.0
"""Length of the pieces that a recording is cut into [s]: creep of the joints and wander of the cell
are forgotten within them."""


@dataclass(frozen=True, kw_only=True)
class TautRows:
    """Rows of a piece of a recording in which the tendon pulls."""

    force: Array
    """At the load cell [N], shape (N,)."""
    surplus: Array
    """What the spool has wound in beyond what the finger has taken, r theta - l [m], (N,)."""

    def __post_init__(self) -> None:
        """Refuse what does not belong together."""
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
    """Return the rows with a taut tendon, piece by piece of each recording of a finger.

    Args:
        recordings: Recordings of any benches; those that do not show the string are left out.
        finger: Name of the bench.
        model: Says in which numbers the bench differs from its asset.
    """
    bench, radius = bench_of(finger, model), spool_radius_of(model)
    out = []
    for recording in recordings:
        if recording.bench != finger or not shows_string(recording):
            continue
        assert recording.force is not None
        mechanism = override_mechanism(bench, recording.bench_overrides)
        force, surplus = recording.force[:, 0], surplus_of(recording, mechanism, radius)
        taut = (force >= TAUT) & recording.enabled
        piece = (recording.time - recording.time[0]) // PIECE
        for number in np.unique(piece[taut]):
            here = taut & (piece == number)
            out.append(TautRows(force=force[here], surplus=surplus[here]))
    return out


def surplus_of(recording: Recording, mechanism: Mechanism, radius: float | None) -> Array:
    """Return r theta - l [m] of each row, shape (T,), by the joint angles that the tip tells."""
    tendon = mechanism.tendons[0]
    wound = (tendon.spool_radius if radius is None else radius) * recording.motor_position[:, 0]
    assert recording.tip is not None
    return wound - excursion(tendon, joints_at(recording.tip, mechanism))
