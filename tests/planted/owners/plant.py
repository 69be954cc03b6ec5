"""The plant: fingers of phalanges in a plane, each pulled by strings with a servo of their own.

It shares no code with ``tendon_newton``, and no equation beyond Newton's: strings are measured in
the plane, phalanges turn by absolute angles, friction is a field of bristles, delays fall between
rows, and steps are explicit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tests.planted.owners.strings import Array, Strings

STEP = 1e-4  # [s] at half of it the angle moves by less than half of an encoder's floor
ROW_RATE = 80.0  # [Hz]
REST = 1.5  # [s] before the first row, without friction and with much damping
CALM = 4.0  # [1] that damping against the joints' own
GRAVITY = 9.81  # [m/s^2]
SPOOL = 0.0125  # [m]
GAIN = 4.2  # [N/rad]
FORCE_LIMIT = 21.0  # [N]
BRISTLE = 60e-6  # [m] of string over which friction builds up
JOINT_BRISTLE = 4e-3  # [rad] the same of a joint
BRISTLE_TIME = 1e-3  # [s] in which a bent bristle's own motion dies out
STOP = 30.0  # [N m/rad] of either end of a joint's range, from 0 on
OF_FINGER = ("stiffness", "damping", "rubbing")
Each = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Finger:
    """Numbers of one finger with J joints and S strings; arrays have shape (J,)."""

    mass: Array  # [kg]; centres of mass lie at half length
    length: Array  # [m]
    inertia: Array  # About the centres of mass [kg m^2]
    spring: Array  # [N m/rad]
    damping: Array  # [N m s/rad]
    range: Array  # [rad] from 0
    stop_damping: Array  # [N m s/rad]
    strings: Strings

    @property
    def string_count(self) -> int:
        """Strings S."""
        return len(self.strings.taken)


@dataclass(frozen=True, kw_only=True)
class Faults:
    """What is wrong, a number for each servo or finger; a lone number is that of all."""

    gain: Each = (1.0,)
    delay: Each = (0.0,)  # [s]
    coulomb: Each = (0.0,)  # [N]
    viscous: Each = (0.0,)  # [N s/rad] at the spool
    slack: Each = (0.0,)  # [m]
    lag: Each = (0.0,)  # Time constant of the motor's force [s]
    cell_gain: Each = (1.0,)
    cell_bias: Each = (0.0,)  # [N]
    stiffness: Each = (1.0,)  # Of a finger's joints [1]
    damping: Each = (1.0,)  # Of a finger's joints [1]
    # Dry friction of a finger's joints as a share of their springs' torque at full range [1]
    rubbing: Each = (0.0,)

    def of(self, finger: int, strings: int) -> "Faults":
        """Return those of one finger with some strings."""
        parts = {}
        for name, each in vars(self).items():
            count = 1 if name in OF_FINGER else strings
            parts[name] = each if len(each) == 1 else each[finger * count :][:count]
        return Faults(**parts)


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recording to make."""

    command: Array  # Of every servo, each held for a row [rad], shape (T, D)
    faults: Faults = field(default_factory=Faults)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What happened at the rows, before any noise."""

    angle: Array  # Of the spools [rad], shape (T, D)
    force: Array  # What the load cells say [N], shape (T, D)
    joints: Array  # [rad], shape (T, J) finger by finger


class Batch:
    """Runs of one finger that go on side by side: numbers per run and string, shape (B, S)."""

    def __init__(self, finger: Finger, faults: Sequence[Faults]) -> None:
        self.finger = finger
        for name in vars(faults[0]):
            count = 1 if name in OF_FINGER else finger.string_count
            each = [np.broadcast_to(getattr(own, name), count) for own in faults]
            setattr(self, name, np.array(each, dtype=np.float64))
        self.calm = 1.0
        mass, length = finger.mass, finger.length
        beyond = np.append(np.cumsum(mass[::-1])[-2::-1], 0.0)  # [kg] that each phalanx carries
        lever = mass * length / 2.0 + beyond * length  # [kg m]
        own = finger.inertia + mass * length**2 / 4.0 + beyond * length**2
        joints = np.arange(len(mass))
        near, far = np.minimum.outer(joints, joints), np.maximum.outer(joints, joints)
        self.weights = GRAVITY * lever
        self.carried = np.where(near == far, np.diag(own), length[near] * lever[far])

    def pulls(
        self, q: Array, v: Array, bent: Array, late: Array, command: Array
    ) -> tuple[Array, ...]:
        """Return angles [rad], tensions [N], arms [m] and the rates of bristles and late forces.

        They are in [m/s] and [N/s].
        """
        taken, arm = self.finger.strings.at(q)
        rate = np.einsum("bdj,bj->bd", arm, v)
        angle = (taken + self.slack) / SPOOL
        asked = np.clip(self.gain * GAIN * (command - angle), -FORCE_LIMIT, FORCE_LIMIT)
        motor = np.where(self.lag > 0.0, late, asked)
        following = (asked - late) / np.maximum(self.lag, STEP)
        bending = rate - np.abs(rate) * bent / BRISTLE
        dry = self.coulomb * (bent + BRISTLE_TIME * bending) / BRISTLE
        tension = motor - dry - self.viscous * rate / SPOOL
        loose = np.clip(command, taken / SPOOL, angle)  # a slack string lets its spool turn freely
        angle = np.where((tension <= 0.0) & (self.slack > 0.0), loose, angle)
        return angle, np.maximum(tension, 0.0), arm, bending, following

    def torques(self, q: Array, v: Array, rubbed: Array, bending: Array) -> Array:
        """Return what springs, dampers, bristles and stops do to the joints [N m], shape (B, J)."""
        own = self.finger
        over = np.maximum(q - own.range, 0.0) + np.minimum(q, 0.0)
        torque = -self.stiffness * own.spring * q - self.calm * self.damping * own.damping * v
        limit = self.rubbing * own.spring * own.range
        torque -= limit * (rubbed + BRISTLE_TIME * bending) / JOINT_BRISTLE
        # a stop pushes and never pulls
        back = STOP * np.abs(over) + own.stop_damping * v * np.sign(over)
        return torque - np.sign(over) * np.maximum(back, 0.0)

    def accelerations(self, q: Array, v: Array, torque: Array) -> Array:
        """Return what joint torques do to the joints [rad/s^2]: Newton's law of each phalanx.

        A phalanx feels the torque of its own joint less that of the next one.
        """
        turn, speed = np.cumsum(q, axis=1), np.cumsum(v, axis=1)
        apart = turn[:, :, None] - turn[:, None, :]
        swing = np.einsum("bij,bj->bi", self.carried * np.sin(apart), speed**2)
        moved = torque.copy()
        moved[:, :-1] -= torque[:, 1:]
        moved += self.weights * np.cos(turn) - swing
        found = np.linalg.solve(self.carried * np.cos(apart), moved[..., None])[..., 0]
        return np.diff(found, axis=1, prepend=0.0)

    def step(self, state: Sequence[Array], command: Array, h: float) -> list[Array]:
        """Return joints, rates, bristles, late forces and the joints' bristles a step later.

        By the midpoint rule.
        """
        at = list(state)
        for part in (0.5, 1.0):
            q, v, bent, late, rubbed = at
            _, tension, arm, *more = self.pulls(q, v, bent, late, command)
            bending = v - np.abs(v) * rubbed / JOINT_BRISTLE
            torque = self.torques(q, v, rubbed, bending) + np.einsum("bdj,bd->bj", arm, tension)
            rates = [v, self.accelerations(q, v, torque), *more, bending]
            at = [own + part * h * rate for own, rate in zip(state, rates, strict=True)]
        return at


def simulate(finger: Finger, runs: Sequence[Run], *, step: float = STEP) -> tuple[Motion, ...]:
    """Run recordings of one length side by side, each from rest under its first command.

    Fingers of a run that has several feel nothing of each other: each is a run of its own.
    """
    own = finger.string_count
    fingers = runs[0].command.shape[1] // own
    single = [
        Run(command=run.command[:, k * own :][:, :own], faults=run.faults.of(k, own))
        for run in runs
        for k in range(fingers)
    ]
    found = simulate_alone(finger, single, step)
    return tuple(beside(found[at : at + fingers]) for at in range(0, len(found), fingers))


def beside(fingers: Sequence[Motion]) -> Motion:
    """Return the motion of several fingers as that of one bench."""
    names = ("angle", "force", "joints")
    return Motion(**{n: np.concatenate([getattr(own, n) for own in fingers], 1) for n in names})


def simulate_alone(finger: Finger, runs: Sequence[Run], step: float) -> list[Motion]:
    """Run recordings of single fingers side by side."""
    commands = np.stack([run.command for run in runs])
    every = round(1.0 / ROW_RATE / step)
    quiet = Batch(finger, [replace(r.faults, coulomb=(0.0,), rubbing=(0.0,)) for r in runs])
    quiet.calm = CALM
    batch = Batch(finger, [run.faults for run in runs])
    joints, strings = (len(runs), len(finger.mass)), (len(runs), finger.string_count)
    state = [np.zeros(shape) for shape in (joints, joints, strings, strings, joints)]
    for _ in range(round(REST / step)):
        state = quiet.step(state, commands[:, 0], step)
    state = [state[0], 0.0 * state[1], 0.0 * state[2], state[3], 0.0 * state[4]]
    late = np.rint(batch.delay / step).astype(np.intp)
    rows: list[tuple[Array, Array, Array]] = []
    which = np.arange(len(runs))[:, None]
    for k in range(commands.shape[1] * every):
        heard = np.maximum((k - late) // every, 0)
        command = commands[which, heard, np.arange(finger.string_count)]
        if k % every == 0:
            angle, tension, *_ = batch.pulls(*state[:4], command)
            rows.append((angle, batch.cell_gain * tension + batch.cell_bias, state[0]))
        state = batch.step(state, command, step)
    signals = (np.stack(signal, axis=1) for signal in zip(*rows, strict=True))
    return [Motion(angle=a, force=f, joints=j) for a, f, j in zip(*signals, strict=True)]
