"""What encoders and a camera saw of a tendon's two ends, and nothing of its force."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.in_time.balance import turned
from tendon_newton.errors import InvalidDataset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.tendon.taut_rows import joints_at

TURN = 0.01
"""Turn of the spool over which a line comes to slip the other way through its guide [rad]. The turn
is 0.1 mm of line and six counts of an encoder: about the stretch when the guide's friction changes
sides."""


@dataclass(frozen=True, kw_only=True)
class SensorlessMotion:
    """Motion of one recording, without its force."""

    recording: Recording  # Has no ``force``
    mechanism: Mechanism  # Mechanism of the bench, with the recording's own numbers
    wound: Array  # Line on the spool [m], shape (T,)
    joints: Array
    """Joint angles that the tip tells [rad], shape (T, J); J = 0 where only the spool is seen."""
    direction: Array  # From -1, paid out, to 1, wound in [1], shape (T,)

    def joints_seen_by(self, camera: Sequence[float]) -> Array:
        """Return the joint angles if the tip is seen off its place by x and z [m], shape (T, J)."""
        if not self.joints.shape[1] or not len(camera):
            return self.joints
        assert self.recording.tip is not None
        return joints_at(self.recording.tip - np.asarray(camera), self.mechanism)


def motions_of(recordings: Sequence[Recording]) -> tuple[SensorlessMotion, ...]:
    """Drop the force of those recordings that tell something without it.

    Left out are recordings without a command, of a bench without a tendon, and of a finger whose
    tip was not seen.

    Raises:
        InvalidDataset: None is left, or a bench is no slider and no planar finger of two joints.
    """
    mechanisms: dict[str, Mechanism] = {}
    motions = []
    for recording in map(without_force, (r for r in recordings if r.command is not None)):
        if recording.bench not in mechanisms:
            mechanisms[recording.bench] = load_mechanism(recording.bench)
        mechanism = override_mechanism(mechanisms[recording.bench], recording.bench_overrides)
        if any(tendon.direct for tendon in mechanism.tendons):
            continue
        if len(mechanism.joints) == 1 or recording.tip is not None:
            motions.append(motion_of(recording, mechanism))
    if not motions:
        raise InvalidDataset(
            "without a load cell a force network learns from theta_d, theta, theta_dot and, on a "
            f"finger, the tip; none of {len(recordings)} train recordings has them"
        )
    return tuple(motions)


def without_force(recording: Recording) -> Recording:
    """Return a recording as it would be without a load cell."""
    return replace(recording, force=None, load_cell_rate=None)


def motion_of(recording: Recording, mechanism: Mechanism) -> SensorlessMotion:
    """Return where both ends of a recording's tendon were."""
    if recording.tendon_count != 1 or len(mechanism.tendons) != 1:
        raise InvalidDataset(
            f"{recording.name}: without a load cell a bench may have one tendon; "
            f"{mechanism.name} has {len(mechanism.tendons)}"
        )
    position = recording.motor_position[:, 0]
    return SensorlessMotion(
        recording=recording,
        mechanism=mechanism,
        wound=mechanism.tendons[0].spool_radius * position,
        joints=np.empty((recording.sample_count, 0))
        if len(mechanism.joints) == 1 or recording.tip is None
        else joints_at(recording.tip, mechanism),
        direction=turned(position, 0.5 * TURN),
    )
