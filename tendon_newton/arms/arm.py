"""An arm as its recordings see it: a mechanism with signs, zeros and a base that may be tilted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidRecording, listed
from tendon_newton.mechanisms.geometry.joint_frames import ancestors
from tendon_newton.mechanisms.geometry.joints import ReadOnlyArrays
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import gravity_torque


@dataclass(frozen=True, kw_only=True)
class Arm(ReadOnlyArrays):
    """How an arm's logged angles become a posture: q = sign * angle + zero."""

    mechanism: Mechanism
    # +1 where a servo counts as its joint does, -1 where it counts the other way, shape (J,)
    sign: Array
    zero: Array  # The joint's angle [rad] where its servo says 0, shape (J,)
    gravity: Array  # In the axes of the base [m/s2], shape (3,)
    # Height above the base of what the tip may rest on [m]; None where nothing is known of it
    floor: float | None = None

    def weight(self, angles: Array) -> Array:
        """Return the torque of gravity [N m] at each servo, as it counts, shape (T, J)."""
        q = self.sign * angles + self.zero
        return self.sign * gravity_torque(self.mechanism, q, self.gravity)

    def tip_height(self, angles: Array) -> tuple[Array, Array]:
        """Return the tip's height [m], (T,), at angles (T, J) [rad], and its slopes (T, J)."""
        tip, parents = self.mechanism.tip, self.mechanism.parents
        assert tip is not None, "only an arm with a tip has a floor"
        frames = posture(self.mechanism, self.sign * angles + self.zero)
        place, up = frames.place(tip.body, tip.point), -self.gravity / np.linalg.norm(self.gravity)
        slopes = np.zeros(np.shape(angles))
        for j in ancestors(parents, tip.body):
            way = frames.axis[j]
            if self.mechanism.joints[j].kind == "revolute":
                way = np.cross(way, place - frames.anchor[j])
            slopes[..., j] = self.sign[j] * (way @ up)
        return place @ up, slopes


@dataclass(frozen=True, kw_only=True)
class ArmMotion:
    """Recordings of all servos of an arm during one motion, in the order of its joints."""

    recordings: tuple[Recording, ...]

    def __post_init__(self) -> None:
        """Refuse recordings that were not made together."""
        first = self.recordings[0]
        for recording in self.recordings:
            if not np.array_equal(recording.time, first.time):
                raise InvalidRecording(
                    f"{recording.name}: servos of one arm are logged together; its time stamps "
                    f"are not those of {first.name}"
                )
            if recording.tendon_count != 1:
                raise InvalidRecording(
                    f"{recording.name}: a motion of an arm has each servo's own log; it has "
                    f"{recording.tendon_count} servos"
                )
            if recording.command is None:
                raise InvalidRecording(
                    f"{recording.name}: an arm's servos have commands; no theta_d"
                )

    @property
    def time(self) -> Array:
        """Instants [s], shape (T,)."""
        return self.recordings[0].time

    @property
    def angles(self) -> Array:
        """Measured angles [rad], shape (T, J)."""
        return np.column_stack([r.motor_position[:, 0] for r in self.recordings])

    @property
    def commands(self) -> Array:
        """Commanded angles [rad], shape (T, J)."""
        return np.column_stack([r.command[:, 0] for r in self.recordings if r.command is not None])


def motions_of(
    recordings: Mapping[str, Sequence[Recording]], joints: Sequence[str]
) -> tuple[ArmMotion, ...]:
    """Put the recordings of joints together, those of one place in each sequence.

    A joint without recordings stands at 0.

    Raises:
        InvalidRecording: A joint is none of the arm's, or they have not the same motions.
    """
    if not recordings or set(recordings) - set(joints):
        raise InvalidRecording(
            "an arm has a dataset in a folder of the name of each joint, "
            f"{listed(joints)}; there are folders {listed(recordings)}: rename them"
        )
    counts = {joint: len(own) for joint, own in recordings.items()}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{joint} {count}" for joint, count in counts.items())
        raise InvalidRecording(f"the joints of an arm have the same recordings; there are {told}")
    still = [standing(recording) for recording in next(iter(recordings.values()))]
    each = (recordings.get(joint, still) for joint in joints)
    return tuple(ArmMotion(recordings=own) for own in zip(*each, strict=True))


def standing(recording: Recording) -> Recording:
    """Return a servo that stands at 0 while another one is recorded."""
    nothing = np.zeros_like(recording.motor_position)
    return Recording(
        name="standing", bench=recording.bench, time=recording.time, command=nothing,
        motor_position=nothing, motor_velocity=nothing, start=recording.start,
    )  # fmt: skip
