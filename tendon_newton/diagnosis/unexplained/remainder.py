"""The rest of the error, side by side: that of the servo, and that of the mechanism."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Array, Indices, Mask, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.identification.study import Study, replacements

Side = Literal["servo", "mechanism", "whole"]
RECENT = 0.1  # Time over which the change of command and force is taken [s]
TURNED = 0.05  # Speed from which a direction counts as a direction [rad/s]
TAUT = 0.05  # Tension from which the servo's slopes are taken on a nominal bench [N]
OUTLIERS = 0.005  # Share of the rows whose size is cut: the rows of jumps must not decide


@dataclass(frozen=True, kw_only=True)
class Remainder:
    """The residual of one side at M rows of some recordings, and what it may depend on."""

    side: Side
    residual: Array  # Measured minus modelled [N or rad], shape (M,)
    signals: Mapping[str, Array]  # Name -> value at each row, shape (M,)
    recording: Indices  # Index of each row's recording, shape (M,)
    scale: BenchScale = field(default_factory=BenchScale)  # Scale of the benches

    @property
    def size(self) -> float:
        """Root mean square of the residual [N or rad]."""
        return rms(self.residual)


def side_words(side: Side, scale: BenchScale) -> tuple[str, str]:
    """Return what is measured of a side, and its unit."""
    if side == "servo":
        return f"{scale.force_name} at the measured motion", scale.force_unit
    return "motor angle" if side == "whole" else "motor angle at the measured force", "rad"


@dataclass(frozen=True, kw_only=True)
class RemainderRows:
    """Rows of one recording, beside those of the model."""

    recording: Recording
    index: int
    kept: Mask  # Whether each row's past is known, shape (T,)
    theta: Array  # Residual of the angle [rad], shape (T,)
    force: Array | None  # Residual of the tension [N]; None without a load cell

    @property
    def angle(self) -> Array:
        """Simulated motor angle [rad]."""
        return self.recording.compared_angle - self.theta

    @property
    def speed(self) -> Array:
        """Simulated motor speed [rad/s]."""
        return np.gradient(self.angle, self.recording.time)

    @property
    def tension(self) -> Array | None:
        """Simulated tension [N]."""
        measured = self.recording.force
        return None if self.force is None or measured is None else measured[:, 0] - self.force


def find_remainders(study: Study, values: Mapping[int, float]) -> tuple[Remainder, ...]:
    """Return what a model leaves of its recordings, by side.

    The load cell sits between servo and mechanism. In closed loop an error of either moves both
    signals. Seen from the measured angle the servo's force is wrong by its own error alone. Seen
    from the measured force the mechanism's angle is wrong by its own error alone.

    Args:
        values: The model's parameters, column -> value.
    """
    residuals = study.residuals(*replacements([values]))
    rows = [
        RemainderRows(
            recording=study.recordings[index],
            index=index,
            kept=(residual := residuals[index]).trusted,
            theta=residual.theta[0],
            force=None if residual.force is None else residual.force[0],
        )
        for index in range(len(study.recordings))
    ]
    both = [r for r in rows if r.force is not None and r.recording.command is not None]
    if len(both) < len(rows):
        return (collect("whole", rows, [r.theta for r in rows], study.scale),)
    stiffness = servo_stiffness(both, TAUT * study.scale.force)
    servo = [r.force + stiffness * r.theta for r in both if r.force is not None]
    give = {bench: mechanism_give(both, bench) for bench in {r.recording.bench for r in both}}
    mechanism = [r.theta - give[r.recording.bench] * r.force for r in both if r.force is not None]
    return (
        collect("servo", both, servo, study.scale),
        collect("mechanism", both, mechanism, study.scale),
    )


def servo_stiffness(rows: list[RemainderRows], taut: float) -> float:
    """Return how the model's force falls with the angle [N/rad], its friction set aside.

    Taken from the simulated signals, so that it holds for every actuator model.
    """
    parts: list[Array] = []
    for r in rows:
        command, tension, speed = r.recording.command, r.tension, r.speed
        assert command is not None
        assert tension is not None
        moving = np.sign(speed) * (np.abs(speed) > TURNED)
        table = np.stack([command[:, 0] - r.angle, moving, speed, np.ones_like(speed), tension], 1)
        parts.append(table[tension > taut])
    table = np.concatenate(parts)
    if len(table) < table.shape[1]:
        return 0.0
    return float(np.linalg.lstsq(table[:, :-1], table[:, -1], rcond=None)[0][0])


def mechanism_give(rows: list[RemainderRows], bench: str) -> float:
    """Return how the model's angle grows with the tension on a bench [rad/N]."""
    own = [r for r in rows if r.recording.bench == bench]
    angle = np.concatenate([r.angle for r in own])
    tension = np.concatenate([r.tension for r in own if r.tension is not None])
    spread = float(np.var(tension))
    return float(np.cov(tension, angle)[0, 1] / spread) if spread > 0.0 else 0.0


def collect(
    side: Side, rows: list[RemainderRows], residuals: list[Array], scale: BenchScale
) -> Remainder:
    """Put all recordings in a row; rows with an unknown past are left out."""
    tables = [signals_of(side, r) for r in rows]
    names = [name for name in tables[0] if all(name in table for table in tables)]
    kept = [r.kept for r in rows]
    residual = np.concatenate([y[k] for y, k in zip(residuals, kept, strict=True)])
    limit = float(np.quantile(np.abs(residual), 1.0 - OUTLIERS))
    signals = {
        name: np.concatenate([table[name][k] for table, k in zip(tables, kept, strict=True)])
        for name in names
    }
    return Remainder(
        side=side,
        residual=np.clip(residual, -limit, limit),
        signals={name: x for name, x in signals.items() if np.ptp(x) > 0.0},
        recording=np.concatenate(
            [np.full(int(k.sum()), r.index) for r, k in zip(rows, kept, strict=True)]
        ),
        scale=scale,
    )


def signals_of(side: Side, rows: RemainderRows) -> dict[str, Array]:
    """Return what a residual may depend on, shape (T,) each.

    No signal may hold the noise of the residual, or the signal would seem to explain that noise.
    The force is therefore the model's, and but for the servo's side the motion too.
    """
    r = rows.recording
    time = r.time - r.time[0]
    measured = side == "servo"
    angle = r.motor_position[:, 0] if measured else rows.angle
    speed = smooth(r.motor_velocity[:, 0]) if measured else rows.speed
    signals = {"theta": angle, "theta_dot": speed, "t": time}
    signals["time_since_reversal"] = since_reversal(time, speed)
    if r.command is not None:
        signals["theta_d"] = r.command[:, 0]
        signals["theta_d_change"] = recent_change(time, r.command[:, 0])
    if rows.tension is not None:
        signals["force"] = rows.tension
        signals["force_change"] = recent_change(time, rows.tension)
    for name in ("temperature", "voltage"):
        if (column := getattr(r, name)) is not None:
            signals[name] = column
    return signals


def smooth(speed: Array) -> Array:
    """Return a speed without the grain of its register: the mean of three rows."""
    return np.convolve(np.pad(speed, 1, mode="edge"), np.full(3, 1.0 / 3.0), mode="valid")


def recent_change(time: Array, signal: Array) -> Array:
    """Return how far a signal has come within a moment."""
    return signal - np.interp(time - RECENT, time, signal)


def since_reversal(time: Array, speed: Array) -> Array:
    """Return the time since the motion turned round [s]."""
    direction = np.where(np.abs(speed) > TURNED, np.sign(speed), 0.0)
    moving = np.flatnonzero(direction)
    turned = moving[np.flatnonzero(np.diff(direction[moving], prepend=0.0))]
    start = np.zeros(len(time), dtype=np.intp)
    start[turned] = turned
    return time - time[np.maximum.accumulate(start)]
