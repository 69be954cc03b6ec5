r"""How a log begins: what moved, and what its servos had been told before the first row.

Nobody logs what was commanded before. A servo that stands had been told to stand there: its sag
:math:`\theta_d - \theta` away, which the rows show in which it rests. So a log that begins with a
jump of the command begins at rest. A servo in motion was on its way to what it is told now, and
nobody knows how far: its first rows say nothing of it until that is forgotten.
"""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.checks.measures import encoder_noise
from tendon_newton.data.recording import Array, Mask, Recording

AT_FIRST, LEAST_ROWS = 0.02, 3
"""Time [s] and rows that are looked at first: a finger's swing takes five times as long."""
SEEN = 28.0  # Standard deviations of its encoder from which on a way is one: eight counts
GAINED = 0.5  # Way of the first half to that of the second [1]; from rest it is a third or less
REST = 0.3  # Time [s] after which a servo whose command stands has come to rest
QUIET = 5.0  # Standard deviations of its encoder by which a servo at rest may wander
JUMP = 2.0  # Scatter of its sag by which a first command is no jump
FORGOTTEN = 3.0  # Times by which a servo is late after which its past has gone by
SHARE = 0.25  # Share of a log at most whose past is not known [1]


@dataclass(frozen=True, kw_only=True)
class FirstRow:
    """The state in which a log begins."""

    angle: Array  # Angles of the shafts [rad], shape (D,)
    rate: Array  # Their rates [rad/s], 0 where a servo stands, shape (D,)
    before: Array | None  # Commands before the first row [rad], shape (D,); None without commands
    doubtful: float = 0.0  # Time [s] in which the rows still show a past that is not known
    if_held: bool = False  # Whether that holds for a model with dry friction alone


def first_row(recording: Recording) -> FirstRow:
    """Return the state in which a recording begins."""
    angle, rate, command = recording.motor_position, recording.motor_velocity[0], recording.command
    if command is None:
        return FirstRow(angle=angle[0], rate=rate, before=None)
    rate, before, doubtful = rate.copy(), command[0].copy(), 0.0
    time = recording.time - recording.time[0]
    for d, followed in enumerate(angle.T):
        if len(time) < LEAST_ROWS or np.ptp(followed) == 0.0:
            continue  # nothing was measured: the state is as it is stated
        servo = Servo(time, command[:, d], followed, recording.enabled)
        if servo.moves:
            doubtful = max(doubtful, servo.memory())
        else:
            rate[d], before[d] = 0.0, servo.held()
    return FirstRow(angle=angle[0], rate=rate, before=before, doubtful=doubtful)


def start_of(recording: Recording) -> FirstRow | None:
    """Return the state in which a simulation of it begins; None for friction-free equilibrium.

    Friction holds a mechanism away from equilibrium, by more than an encoder's count. So a log
    whose first rows show where its servo rests begins there, if its model has dry friction. Several
    strings hold each other, and what was not measured rests nowhere: these begin in equilibrium.
    """
    if recording.start == "first_row" or recording.command is None:
        return first_row(recording)
    time, angle = recording.time - recording.time[0], recording.motor_position
    last = int(np.searchsorted(time, REST - 1.0e-9))
    if angle.shape[1] > 1 or last >= len(time) or np.ptp(angle) == 0.0:
        return None
    if not Servo(time, recording.command[:, 0], angle[:, 0], recording.enabled).rests()[last]:
        return None
    place = angle[: last + 1].mean(axis=0)
    return FirstRow(angle=place, rate=np.zeros(1), before=recording.command[0], if_held=True)


class Servo:
    """What the rows of a log say of one servo.

    Args:
        time: Since the first row [s], shape (T,).
        command: Desired angle [rad], shape (T,).
        angle: Measured angle [rad], shape (T,).
        enabled: Whether its motor is on; what hangs on one that is off follows nothing. Shape (T,).
    """

    def __init__(self, time: Array, command: Array, angle: Array, enabled: Mask) -> None:
        self.time, self.command, self.angle, self.enabled = time, command, angle, enabled
        self.noise = encoder_noise(angle)
        self.changes = np.append(0, np.cumsum(np.diff(command) != 0.0))
        """How often the command has changed, shape (T,)."""
        self.moves = self._moves()
        """Whether it is in motion in the first row: of the first way beyond noise, half of the time
        has brought a third or more."""

    def _moves(self) -> bool:
        count = max(LEAST_ROWS, int(np.searchsorted(self.time, AT_FIRST, side="right"))) | 1
        while count <= len(self.time):
            ways = np.abs(np.diff(self.angle[[0, count // 2, count - 1]]))
            if ways.max() > SEEN * self.noise:
                return bool(ways[0] > GAINED * ways[1])
            count = 2 * count - 1
        return False

    def rests(self) -> Mask:
        """Tell in which rows it has long been told one thing, and has not moved since.

        A motor that is off holds nothing, and rests nowhere.
        """
        ago = np.searchsorted(self.time, self.time - REST + 1.0e-9)
        stands = np.abs(self.angle - self.angle[ago]) <= QUIET * self.noise
        told = self.enabled & self.enabled[ago] & (self.changes == self.changes[ago])
        return (self.time >= REST - 1.0e-9) & told & stands

    def sag(self) -> tuple[Array, float]:
        """Return how far below its command it rests, shape (T,), and the scatter of that [rad].

        A line says so through its rests; failing these, through the last rows of what it was told;
        under a command that never stands through all rows, beside what it is late by.
        """
        rows, behind = self.rests(), self.command - self.angle
        late = np.zeros_like(behind)
        if not rows.any():
            since = self.time - self.time[np.searchsorted(self.changes, self.changes)]
            rows = (np.diff(self.changes, append=self.changes[-1]) > 0) & (since > REST / 2.0)
            rows &= self.enabled
        if not rows.any():
            rows, late = self.enabled.copy(), np.gradient(self.angle, self.time)
        if not rows.any():
            return np.zeros_like(behind), 0.0
        place = self.angle - self.angle[rows].mean()
        parts = np.stack([np.ones_like(place), place, late], axis=1)
        line = np.linalg.lstsq(parts[rows], behind[rows], rcond=None)[0]
        low, high = float(behind[rows].min()), float(behind[rows].max())
        scatter = float(np.sqrt(np.mean((behind[rows] - parts[rows] @ line) ** 2)))
        return np.clip(parts[:, :2] @ line[:2], min(0.0, low), max(0.0, high)), scatter

    def held(self) -> float:
        """Return what it had been told if it stands in the first row [rad]."""
        row = int(np.searchsorted(self.time, REST - 1.0e-9))
        if row < len(self.time) and self.rests()[row]:
            return float(self.command[0])
        sag, scatter = self.sag()
        held = float(self.angle[0] + sag[0])
        first = float(self.command[0])
        return first if abs(first - held) <= JUMP * max(scatter, self.noise) else held

    def memory(self) -> float:
        """Return how long its past shows [s]: some times by which it is late in the mean.

        A servo that follows a jump or a ramp late by T is behind by T times its way.
        """
        follows = (self.enabled & ~self.rests())[:-1]
        behind = np.abs(self.command - self.angle - self.sag()[0])[:-1] * follows
        way = float(np.abs(np.diff(self.angle)).sum())
        late = float(behind @ np.diff(self.time)) / max(way, QUIET * self.noise)
        return min(FORGOTTEN * late, SHARE * float(self.time[-1]))
