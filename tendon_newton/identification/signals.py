"""The table of signals: what was measured beside what a simulation makes of it, a row for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tendon_newton.data.checks.measures import difference_noise, encoder_noise, resolution
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.identification.load_cell import fill_between_readings
from tendon_newton.identification.noise_floor import NoiseFloor, angle_noise, force_noise
from tendon_newton.mechanisms.geometry.joints import JointKind
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

DIVERGED = 1.0e4  # Stands for an angle [rad] or force [N] that is not finite
Rows = Mapping[str, Array]
"""What a rollout simulated of one recording, by its own names, shape (N, S, D) or (N, S, J)."""


@dataclass(frozen=True, kw_only=True)
class View:
    """What is compared of one servo of a recording."""

    recording: Recording  # With the signals of this servo alone
    mechanism: Mechanism  # The bench with this recording's own numbers
    servo: int = 0
    cell: tuple[int, int] | None = None  # First row read and rows per reading of a slow load cell
    draw: float | None = None  # Current of the motor per newton [A/N]; None where no model tells
    gives_way: bool = False  # Whether its supply is an only motor's, and no input of its model


@dataclass(frozen=True, kw_only=True)
class Signal:
    """One signal: where it is measured and simulated, its noise, and what is not known of it."""

    words: str  # What a report calls it
    unit: str
    shown: tuple[float, str]  # What a report multiplies it with, and its unit then
    rollout: Callable[[Recording], str]  # Name that a rollout has for what it follows from
    measured: Callable[[View], Array | None]
    """Components as they were measured [unit], shape (C, T); None where none is compared."""
    simulated: Callable[[View, Rows], Array]
    """The same as simulated [unit], shape (N, C, S)."""
    noise: Callable[[Sequence[View]], float | None]
    """Standard deviation of what no model could predict, from the views that have it [unit]."""
    form: Callable[[Scales, View], float]
    """By how much laws miss it, where they miss an angle and a force by `Scales` [unit]."""
    by_servo: bool = False  # Whether each servo has its own; else a recording has it once
    zero: float = 0.0
    """By how much its zero may be off in each recording [unit]: that is no error of a model."""
    relative: bool = False  # Whether its size in each recording is not known

    def residual(self, measured: Array, simulated: Array, trusted: Mask) -> Array:
        """Return measured (C, T) minus simulated (N, C, T), with the likeliest size and zero."""
        if self.relative:
            own = simulated[..., trusted]
            size = (own * measured[:, trusted]).sum(axis=-1) / (own**2).sum(axis=-1)
            simulated = size[..., None] * simulated
        out = measured - simulated
        if self.zero > 0.0:
            middle = out[..., trusted].mean(axis=-1, keepdims=True)
            out -= np.clip(middle, -self.zero, self.zero)
        return out


@dataclass(frozen=True, kw_only=True)
class Scales:
    """A size of each signal, in its own unit."""

    theta: float  # [rad]
    force: float  # [N]
    others: Mapping[str, float] = field(default_factory=dict[str, float])

    def of(self, signal: str) -> float:
        """Return the size of one signal."""
        return {"theta": self.theta, "force": self.force, **self.others}[signal]


def finite(signal: Array) -> Array:
    """Replace what diverged by a number that no fit will like."""
    return np.clip(np.nan_to_num(signal, nan=DIVERGED), -DIVERGED, DIVERGED)


def compared_signal(recording: Recording) -> str:
    """Return the simulated signal that an angle is compared with: a joint's on a given path."""
    on_joint = recording.driven_by == "path" and recording.joint_position is not None
    return "joints" if on_joint else "angle"


def compares_force(recording: Recording) -> bool:
    """Tell whether a recording's force is compared: it was measured, and is not the input."""
    return recording.force is not None and recording.driven_by != "force"


def of_servo(name: str) -> Callable[[View, Rows], Array]:
    """Return what takes a servo's own of a rollout's signal."""
    return lambda view, rows: finite(rows[name][:, None, :, view.servo])


def angle_of(view: View, rows: Rows) -> Array:
    """Return the angle that an encoder would have read [rad], shape (N, 1, S)."""
    return of_servo(compared_signal(view.recording))(view, rows)


def force_of(view: View, rows: Rows) -> Array:
    """Return the force that the load cell would have told [N], shape (N, 1, S)."""
    force = of_servo("force")(view, rows)
    return force if view.cell is None else fill_between_readings(force, *view.cell)


def measured_force(view: View) -> Array | None:
    """Return the force at the load cell [N], shape (1, T)."""
    force = view.recording.force
    return force.T if force is not None and compares_force(view.recording) else None


def median_noise(
    measured: Callable[[View], Array | None], noise: Callable[[View, Array], float]
) -> Callable[[Sequence[View]], float | None]:
    """Return what takes the median noise of all components that views have; None without any."""

    def found(views: Sequence[View]) -> float | None:
        rows = [(view, own) for view in views if (own := measured(view)) is not None]
        every = [noise(view, part) for view, own in rows for part in own]
        return float(np.median(every)) if every else None

    return found


def joints_of(view: View, kind: JointKind) -> list[int]:
    """Return the joints of a kind; none but where a command drives and encoders are on all."""
    read, joints = view.recording.joint_position, view.mechanism.joints
    if view.servo or view.recording.driven_by != "command" or read is None:
        return []
    return [j for j, own in enumerate(joints) if own.kind == kind and read.shape[1] == len(joints)]


def gear(mechanism: Mechanism) -> float:
    """Return what the first motor turns while all its joints turn alike [rad/rad, rad/m]."""
    tendon = mechanism.tendons[0]
    return float(np.abs(tendon.moment_arm).sum()) / tendon.spool_radius


def at_joints(kind: JointKind, words: str, unit: str) -> Signal:
    """Return the row of encoders on joints of a kind; where they have their zeros is not known."""

    def measured(view: View) -> Array | None:
        joints, read = joints_of(view, kind), view.recording.joint_position
        return read.T[joints] if joints and read is not None else None

    def noise(view: View, own: Array) -> float:
        return encoder_noise(gear(view.mechanism) * own) / gear(view.mechanism)

    return Signal(
        words=words,
        unit=unit,
        shown=(1e3, f"m{unit}"),
        rollout=lambda _: "joints",
        measured=measured,
        simulated=lambda view, rows: finite(
            np.moveaxis(rows["joints"][..., joints_of(view, kind)], 2, 1)
        ),
        noise=median_noise(measured, noise),
        form=lambda usual, view: usual.theta / gear(view.mechanism),
        zero=np.inf,
    )


def measured_tip(view: View) -> Array | None:
    """Return x and z of the tip [m], shape (2, T); None where nothing moves or saw it."""
    tip, recording = view.recording.tip, view.recording
    unseen = view.servo or view.mechanism.tip is None or recording.driven_by == "path"
    return None if tip is None or unseen else tip.T


def measured_current(view: View) -> Array | None:
    """Return the current of the only motor's winding [A], shape (1, T)."""
    own = view.recording
    is_motors = own.current_in == "winding" and own.driven_by == "command" and view.draw is not None
    return own.current[None, :] if own.current is not None and is_motors else None


def measured_voltage(view: View) -> Array | None:
    """Return the voltage of the only motor's supply [V], shape (1, T); one value may be stated."""
    own = view.recording.voltage
    is_motors = view.gives_way and view.recording.driven_by == "command"
    return own[None, :] if own is not None and is_motors and np.ptp(own) > 0.0 else None


def voltage_noise(view: View, own: Array) -> float:
    """Return the noise of a supply [V], shape (T,): what is not its motor's doing.

    What it gives way follows from the position error, less than in proportion. Counts, late
    readings and what others draw from it do not.
    """
    command = view.recording.command
    assert command is not None  # by `measured_voltage`
    doing = np.abs(command - view.recording.motor_position) ** np.arange(3)
    left = own - doing @ np.linalg.lstsq(doing, own)[0]
    return max(float(left.std()), resolution(own) / float(np.sqrt(12.0)))


def voltage_form(usual: Scales, view: View) -> float:
    """Return by how much laws miss a supply [V]: as much of it as of its motor's greatest force."""
    own, most = view.recording.voltage, view.mechanism.tendons[0].force_limit
    return 0.0 if own is None else float(np.mean(own)) * usual.force / most


def reach(mechanism: Mechanism) -> float:
    """Return how far the tip moves at most while the first motor turns [m/rad].

    One joint alone may take up all that its tendon gives.
    """
    tip = tip_position(mechanism, np.zeros(len(mechanism.joints)))
    tendon = mechanism.tendons[0]
    arms = np.abs(tendon.moment_arm)
    per_turn = tendon.spool_radius / arms[arms > 0.0].min()
    return 0.0 if tip is None else float(per_turn * np.linalg.norm(tip))


SIGNALS: dict[str, Signal] = {
    "theta": Signal(
        words="motor angle",
        unit="rad",
        shown=(1e3, "mrad"),
        rollout=compared_signal,
        measured=lambda view: view.recording.compared_angle[None, :],
        simulated=angle_of,
        noise=lambda views: angle_noise([view.recording for view in views]),
        form=lambda usual, _: usual.theta,
        by_servo=True,
    ),
    "force": Signal(
        words="tendon force",
        unit="N",
        shown=(1.0, "N"),
        rollout=lambda _: "force",
        measured=measured_force,
        simulated=force_of,
        noise=lambda views: force_noise([view.recording for view in views]),
        form=lambda usual, _: usual.force,
        by_servo=True,
    ),
    "joint": at_joints("revolute", "joint angle", "rad"),
    "slide": at_joints("prismatic", "joint position", "m"),
    "tip": Signal(
        words="tip",
        unit="m",
        shown=(1e3, "mm"),
        rollout=lambda _: "tip",
        measured=measured_tip,
        simulated=lambda _, rows: finite(np.moveaxis(rows["tip"], 2, 1)),
        noise=median_noise(measured_tip, lambda _, own: difference_noise(own)),
        form=lambda usual, view: reach(view.mechanism) * usual.theta,
        zero=np.inf,
    ),
    "current": Signal(
        words="motor current",
        unit="A",
        shown=(1e3, "mA"),
        rollout=lambda _: "current",
        measured=measured_current,
        simulated=of_servo("current"),
        noise=median_noise(measured_current, lambda _, own: encoder_noise(own)),
        form=lambda usual, view: usual.force * (view.draw or 0.0),
        zero=np.inf,
    ),
    "voltage": Signal(
        words="supply voltage",
        unit="V",
        shown=(1.0, "V"),
        rollout=lambda _: "voltage",
        measured=measured_voltage,
        simulated=lambda _, rows: finite(1.0 - rows["voltage"][:, None, :, 1]),
        noise=median_noise(measured_voltage, voltage_noise),
        form=voltage_form,
        relative=True,
    ),
}
"""A further signal is a row here: with it, what a model leaves of it counts in every fit."""


def compared(view: View) -> dict[str, Array]:
    """Return what is compared of a view as it was measured, name -> components, shape (C, T)."""
    found = {name: signal.measured(view) for name, signal in SIGNALS.items()}
    return {name: values for name, values in found.items() if values is not None}


def noise_of(views: Sequence[View]) -> NoiseFloor:
    """Return the noise of all signals that some views have."""
    found = {name: signal.noise(views) for name, signal in SIGNALS.items()}
    theta, force = found.pop("theta"), found.pop("force")
    assert theta is not None  # every recording has a motor's angle
    others = {name: size for name, size in found.items() if size is not None}
    return NoiseFloor(theta=theta, force=force, others=others)
