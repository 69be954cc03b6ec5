"""The plant: two phalanges, a flexor through guides and an extensor over two knuckles.

It shares no code with ``tendon_newton``, and no equation beyond Newton's: strings are measured in
the plane, friction is a field of bristles, delays fall between rows, and steps are explicit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Place = tuple[float, float]

STEP = 1e-4  # [s] at half of it the angle moves by less than half of an encoder's floor
ROW_RATE = 80.0  # [Hz]
REST = 1.5  # [s] before the first row, without friction and with much damping
CALM = 4.0  # [1] that damping against the joints' own
GRAVITY = 9.81  # [m/s^2]
SPOOL = 0.0125  # [m]
GAIN = 4.2  # [N/rad]
FORCE_LIMIT = 21.0  # [N]
BRISTLE = 60e-6  # [m] of string over which friction builds up
BRISTLE_TIME = 1e-3  # [s] in which a bent bristle's own motion dies out
MASS, LENGTH = np.array([0.015, 0.009]), np.array([0.034, 0.026])  # [kg], [m]
INERTIA = np.array([1.445e-6, 5.07e-7])  # [kg m^2] about the centres of mass
SPRING, DAMPING = np.array([0.03, 0.02]), np.array([6e-4, 3e-4])  # [N m/rad], [N m s/rad]
RANGE = 1.5  # [rad] either joint, from 0
STOP, STOP_DAMPING = 30.0, np.array([0.02, 0.005])  # [N m/rad], [N m s/rad]
# per string: the guides before and behind each joint, seen from its axis while straight [m]
FLEXOR = (((-0.012, -0.0085), (0.012, -0.008)), ((-0.010, -0.007), (0.009, -0.0062)))
EXTENSOR = (((-0.016, 0.008), (0.014, 0.0055)), ((-0.020, 0.0055), (0.010, 0.004)))
KNUCKLES = ((0.0, 0.0), (0.006, 0.0045))  # [m] radius to the middle of the string; 0 is none
Both = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Faults:
    """What is wrong; pairs are of the flexor's servo and of the extensor's."""

    gain: Both = (1.0, 1.0)
    delay: Both = (0.0, 0.0)
    """[s]"""
    coulomb: Both = (0.0, 0.0)
    """[N]"""
    viscous: Both = (0.0, 0.0)
    """[N s/rad] at the spool."""
    slack: Both = (0.0, 0.0)
    """[m]"""
    lag: Both = (0.0, 0.0)
    """Time constant of the motor's force [s]."""
    cell_gain: Both = (1.0, 1.0)
    cell_bias: Both = (0.0, 0.0)
    """[N]"""
    stiffness: float = 1.0
    """Of both joints [1]."""
    damping: float = 1.0
    """Of both joints [1]."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recording to make."""

    command: Array
    """Of flexor and extensor, each held for a row [rad], shape (T, 2)."""
    faults: Faults = field(default_factory=Faults)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What happened at the rows, before any noise, shape (T, 2) each."""

    angle: Array
    """Of the spools [rad]."""
    force: Array
    """What the load cells say [N]."""
    joints: Array
    """[rad]"""


def crossing(before: Place, behind: Place, knuckle: float, turn: Array) -> Array:
    """Return a string's length [m] past a joint that has turned; a knuckle lies on its back."""
    x = behind[0] * np.cos(turn) + behind[1] * np.sin(turn)
    z = behind[1] * np.cos(turn) - behind[0] * np.sin(turn)
    straight = np.hypot(x - before[0], z - before[1])
    if knuckle == 0.0:
        return straight
    near, far = np.hypot(*before), np.hypot(x, z)
    start = np.arctan2(before[1], before[0]) - np.arccos(knuckle / near)
    end = np.arctan2(z, x) + np.arccos(knuckle / far)
    free = np.sqrt(near**2 - knuckle**2) + np.sqrt(far**2 - knuckle**2)
    return np.where(start > end, free + knuckle * (start - end), straight)


class Strings:
    """How much string the joints take up, and their moment arms, from a table of angles."""

    def __init__(self) -> None:
        self.start, self.width = -0.3, 1e-3
        turn = self.start + self.width * np.arange(2201)
        paths = [
            [crossing(*guides, knuckle, turn) for guides, knuckle in zip(path, radii, strict=True)]
            for path, radii in zip((FLEXOR, EXTENSOR), KNUCKLES, strict=True)
        ]
        rest = round(-self.start / self.width)
        self.taken = np.array([[own[rest] - own for own in path] for path in paths])
        self.arm = np.gradient(self.taken, self.width, axis=-1, edge_order=2)

    def at(self, q: Array) -> tuple[Array, Array]:
        """Return excursions [m], shape (B, 2), and arms [m], (B, 2 strings, 2 joints)."""
        place = (q - self.start) / self.width
        low = np.clip(place.astype(np.intp), 0, self.taken.shape[-1] - 2)
        share = place - low
        joint = np.arange(2)
        taken = self.taken[:, joint, low] * (1.0 - share) + self.taken[:, joint, low + 1] * share
        arm = self.arm[:, joint, low] * (1.0 - share) + self.arm[:, joint, low + 1] * share
        return taken.sum(axis=-1).T, arm.transpose(1, 0, 2)


STRINGS = Strings()


class Batch:
    """Runs that go on side by side: numbers per run and servo, shape (B, 2)."""

    def __init__(self, faults: Sequence[Faults]) -> None:
        for name in vars(faults[0]):
            values = np.array([getattr(own, name) for own in faults], dtype=np.float64)
            setattr(self, name, values if values.ndim == 2 else values[:, None])
        self.calm = 1.0

    def pulls(
        self, q: Array, v: Array, bent: Array, late: Array, command: Array
    ) -> tuple[Array, ...]:
        """Return angles [rad], tensions [N], arms [m] and the rates of bristles and late forces.

        They are in [m/s] and [N/s].
        """
        taken, arm = STRINGS.at(q)
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

    def accelerations(self, q: Array, v: Array, tension: Array, arm: Array) -> Array:
        """Return what moves the joints [rad/s^2]: Lagrange's equations of a double pendulum."""
        (m1, m2), (l1, l2) = MASS, LENGTH
        c1, c2 = l1 / 2.0, l2 / 2.0
        cos, sin = np.cos(q[:, 1]), np.sin(q[:, 1])
        far = INERTIA[1] + m2 * c2**2
        cross = far + m2 * l1 * c2 * cos
        near = INERTIA[0] + m1 * c1**2 + m2 * l1**2 + far + 2.0 * m2 * l1 * c2 * cos
        swing = m2 * l1 * c2 * sin
        weight = GRAVITY * m2 * c2 * np.cos(q[:, 0] + q[:, 1])
        whole = GRAVITY * (m1 * c1 + m2 * l1) * np.cos(q[:, 0]) + weight
        over = np.maximum(q - RANGE, 0.0) + np.minimum(q, 0.0)
        torque = np.einsum("bdj,bd->bj", arm, tension) - self.stiffness * SPRING * q
        torque -= self.calm * self.damping * DAMPING * v
        back = STOP * np.abs(over) + STOP_DAMPING * v * np.sign(
            over
        )  # a stop pushes and never pulls
        torque -= np.sign(over) * np.maximum(back, 0.0)
        first = torque[:, 0] + whole + swing * v[:, 1] * (2.0 * v[:, 0] + v[:, 1])
        second = torque[:, 1] + weight - swing * v[:, 0] ** 2
        scale = near * far - cross**2
        return np.stack(
            [(far * first - cross * second) / scale, (near * second - cross * first) / scale], 1
        )

    def step(self, state: Sequence[Array], command: Array, h: float) -> list[Array]:
        """Return joints, rates, bristles and late forces a step later, by the midpoint rule."""
        at = list(state)
        for part in (0.5, 1.0):
            _, tension, arm, *more = self.pulls(*at, command)
            rates = [at[1], self.accelerations(at[0], at[1], tension, arm), *more]
            at = [own + part * h * rate for own, rate in zip(state, rates, strict=True)]
        return at


def simulate(runs: Sequence[Run], *, step: float = STEP) -> tuple[Motion, ...]:
    """Run recordings of one length side by side, each from rest under its first command."""
    commands = np.stack([run.command for run in runs])
    every = round(1.0 / ROW_RATE / step)
    quiet = Batch([replace(run.faults, coulomb=(0.0, 0.0)) for run in runs])
    quiet.calm = CALM
    batch = Batch([run.faults for run in runs])
    state = [np.zeros((len(runs), 2)) for _ in range(4)]
    for _ in range(round(REST / step)):
        state = quiet.step(state, commands[:, 0], step)
    state = [state[0], 0.0 * state[1], 0.0 * state[2], state[3]]
    late = np.rint(batch.delay / step).astype(np.intp)
    rows: list[tuple[Array, Array, Array]] = []
    which = np.arange(len(runs))[:, None]
    for k in range(commands.shape[1] * every):
        heard = np.maximum((k - late) // every, 0)
        command = commands[which, heard, np.arange(2)]
        if k % every == 0:
            angle, tension, *_ = batch.pulls(*state, command)
            rows.append((angle, batch.cell_gain * tension + batch.cell_bias, state[0]))
        state = batch.step(state, command, step)
    angle, force, joints = (np.stack(signal, axis=1) for signal in zip(*rows, strict=True))
    return tuple(
        Motion(angle=a, force=f, joints=j) for a, f, j in zip(angle, force, joints, strict=True)
    )
