"""One uninterrupted log of a bench, checked when it is built."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.channels import CHANNELS
from tendon_newton.data.files.html_table import html_table
from tendon_newton.data.lost_signs import lost_sign
from tendon_newton.data.recording_plot import recording_figure
from tendon_newton.data.stamps import stamp_fault, step_fault
from tendon_newton.errors import InvalidRecording, shown
from tendon_newton.frozen_mapping import frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Array", "BenchOverrides", "Indices", "Mask", "Recording"]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
"""Places in another array, or numbers of recordings, blocks, folds or columns."""
Mask = NDArray[np.bool_]  # What holds for each row, entry or parameter

DrivenBy = Literal["command", "path", "force"]
"""What a recording gives a simulation: commands of its servo; where its shaft was, and what loaded
the joint; or its measured tension alone."""
SERVO = "servo"  # Bench of a servo whose load is not known
FREE = "free"  # Obstacle of a recording in which nothing touches the mechanism
FEW_ROWS = 0.05  # Share of rows beyond belief that are failed reads; more are another unit [1]
BENCH_NAME = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """One uninterrupted log of a bench under a known command or a known force."""

    name: str
    """File name inside its dataset, for messages and outputs."""
    bench: str
    """Name under ``assets/`` of the bench that was measured."""
    time: Array
    """Sample instants [s], strictly increasing, shape (T,)."""
    motor_position: Array
    """Servo shaft angle theta [rad], positive winds the tendon in, shape (T, D)."""
    motor_velocity: Array
    """Servo shaft speed theta_dot [rad/s], shape (T, D)."""
    command: Array | None = None
    """Desired shaft angle theta_d [rad], held until the next row, shape (T, D)."""
    force: Array | None = None
    """Tendon tension at the load cell [N] (a torque [N m] on the pendulum), shape (T, D)."""
    joint_position: Array | None = None
    """Angles or places of the joints at encoders of their own [rad, m], shape (T, J).

    That of an only joint may be given in the shape (T,)."""
    joint_load: Array | None = None
    """Torque on an only joint from outside [N m], positive the way its angle grows, shape (T,).

    With it, and without commands, the measured shaft angle is the input and the force is compared.
    """
    tip: Array | None = None
    """Finger tip (tip_x, tip_z) in the base frame [m], shape (T, 2)."""
    current: Array | None = None
    """Motor current [A], shape (T,)."""
    voltage: Array | None = None
    """Supply voltage [V], shape (T,)."""
    temperature: Array | None = None
    """Motor temperature [degC], shape (T,)."""
    enabled: Mask = field(default_factory=lambda: np.ones(0, dtype=np.bool_))
    """False where the motor gives neither torque nor back-EMF, shape (T,); all true by default."""
    extra: Mapping[str, NDArray[Any]] = field(default_factory=dict[str, NDArray[Any]])
    """Columns that the format does not know, numbers or words, shape (T,) each."""
    start: Literal["equilibrium", "first_row"] = "equilibrium"
    """State from which a simulation starts."""
    bench_overrides: BenchOverrides = field(default_factory=BenchOverrides)
    """Bench numbers of this recording alone."""
    actuator_overrides: Mapping[str, float] = field(default_factory=dict[str, float])
    """Actuator numbers of this recording alone, in the actuator's own units."""
    load_cell_rate: float | None = None
    """Rate of the load cell where it is slower than the rows [Hz]."""
    current_in: Literal["winding"] | None = None
    """Where the current flows, if it is the motor's own; a supply's is not compared."""
    obstacle: str = FREE
    """What stood in the mechanism's way, in a word; ``free`` where nothing did."""

    servo: str | None = None
    """Kind of its servo, where the file says it."""

    def __post_init__(self) -> None:
        freeze_arrays(self)
        check_setting(self)
        check_time(self)
        check_shapes(self)
        check_values(self)

    def __repr__(self) -> str:
        return (
            f"Recording({self.name!r}, {self.bench}: {self.sample_count} rows, "
            f"{self.duration:.1f} s, {', '.join(self.signals)})"
        )

    def _repr_html_(self) -> str:
        """Show the ranges of its signals in a notebook."""
        columns = ((name, getattr(self, name)) for name in self.signals)
        rows = [(name, f"{v.min():.4g}", f"{v.max():.4g}", v.shape) for name, v in columns]
        return html_table(repr(self), ("signal", "least", "most", "shape"), rows)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what another process builds the recording from, so that arrays stay read-only."""
        return partial(type(self), **{f.name: getattr(self, f.name) for f in fields(self)}), ()

    def plot(self, simulated: "Recording | None" = None) -> "Figure":
        """Draw command, angle and tension; with a simulation of the same rows also what it misses.

        Args:
            simulated: What `simulate` made of this recording.
        """
        return recording_figure(self, simulated)

    @property
    def signals(self) -> tuple[str, ...]:
        """Fields that were commanded or measured."""
        fields_there = (channel.field for channel in CHANNELS)
        return tuple(name for name in fields_there if getattr(self, name) is not None)

    @property
    def sample_count(self) -> int:
        """Rows T."""
        return int(self.time.shape[0])

    @property
    def tendon_count(self) -> int:
        """Tendons D."""
        return int(self.motor_position.shape[1])

    @property
    def coupled(self) -> bool:
        """Whether strings of one mechanism are wound, which turn each other's motors."""
        return self.tendon_count > 1 and self.bench != SERVO

    @property
    def driven_by(self) -> DrivenBy:
        """What a simulation is given: commands, the shaft's path under a load, or the force."""
        if self.command is not None:
            return "command"
        return "force" if self.joint_load is None else "path"

    @property
    def compared_angle(self) -> Array:
        """What a simulation's angle is compared with [rad], shape (T,): servo 0's, or the joint's.

        Where the shaft's path is the input, the joint's angle is not.
        """
        if self.driven_by == "path" and self.joint_position is not None:
            return self.joint_position[:, 0]
        return self.motor_position[:, 0]

    @property
    def duration(self) -> float:
        """Time from the first row to the last [s]."""
        return float(self.time[-1] - self.time[0])


def freeze_arrays(recording: Recording) -> None:
    """Replace arrays and mappings by copies that nobody can write to."""
    for name in ("time", *(channel.field for channel in CHANNELS)):
        values = getattr(recording, name)
        if values is not None:
            object.__setattr__(recording, name, frozen_array(values, np.float64))
    joints = recording.joint_position
    if joints is not None and joints.ndim == 1:
        object.__setattr__(recording, "joint_position", frozen_array(joints[:, None], np.float64))
    enabled = np.asarray(recording.enabled, dtype=np.bool_)
    if enabled.size == 0:
        enabled = np.ones(recording.time.shape[:1], dtype=np.bool_)
    object.__setattr__(recording, "enabled", frozen_array(enabled, np.bool_))
    extra = {name: frozen_array(values, None) for name, values in recording.extra.items()}
    object.__setattr__(recording, "extra", frozen(extra))
    object.__setattr__(recording, "actuator_overrides", frozen(recording.actuator_overrides))


def frozen_array(values: NDArray[Any], dtype: Any) -> NDArray[Any]:
    """Copy an array and make the copy read-only."""
    copy = np.array(values, dtype=dtype)
    copy.setflags(write=False)
    return copy


def check_setting(recording: Recording) -> None:
    """Refuse a recording whose circumstances make no sense."""
    if not BENCH_NAME.fullmatch(recording.bench):
        raise InvalidRecording(
            f"{recording.name}: bench must be a name under assets/ (letters, digits, _ and -); "
            f"it is {shown(recording.bench)}"
        )
    if recording.start not in ("equilibrium", "first_row"):
        raise InvalidRecording(
            f"{recording.name}: start must be 'equilibrium' or 'first_row'; "
            f"it is {shown(recording.start)}"
        )
    for key, value in recording.actuator_overrides.items():
        if not isfinite(value):
            raise InvalidRecording(
                f"{recording.name}: actuator override {shown(key)} must be finite; it is {value}"
            )
    if recording.current_in not in (None, "winding"):
        raise InvalidRecording(
            f"{recording.name}: current_in must be 'winding', or left out where it is a supply's; "
            f"it is {shown(recording.current_in)}"
        )
    if not BENCH_NAME.fullmatch(recording.obstacle):
        raise InvalidRecording(
            f"{recording.name}: obstacle must be a word (letters, digits, _ and -), {FREE!r} where "
            f"nothing touches the mechanism; it is {shown(recording.obstacle)}"
        )
    rate = recording.load_cell_rate
    if rate is not None and not (isfinite(rate) and rate > 0.0):
        raise InvalidRecording(
            f"{recording.name}: load_cell_rate must be positive [Hz]; it is {rate}"
        )


def check_time(recording: Recording) -> None:
    """Refuse a time column that is short, not finite, not increasing or not in seconds."""
    time = recording.time
    if time.ndim != 1 or time.size < 2:
        raise InvalidRecording(
            f"{recording.name}: a recording needs two rows or more; it has {time.size}"
        )
    (bad,) = np.nonzero(~np.isfinite(time))
    if bad.size:
        raise InvalidRecording(
            f"{recording.name}: t must be finite; row {bad[0]} is {time[bad[0]]}"
        )
    if (fault := step_fault(time)) is not None:
        raise InvalidRecording(f"{recording.name}: {fault}")
    if (fault := stamp_fault(time)) is not None:
        raise InvalidRecording(f"{recording.name}: t must strictly increase; {fault}")


def check_shapes(recording: Recording) -> None:
    """Refuse channels whose rows or tendons do not match."""
    rows = recording.sample_count
    if recording.motor_position.ndim != 2:
        raise InvalidRecording(
            f"{recording.name}: theta must have the shape (T, D); "
            f"it has {recording.motor_position.shape}"
        )
    if recording.command is None and recording.force is None:
        raise InvalidRecording(
            f"{recording.name}: theta_d or force must be there, else nothing drives a simulation; "
            "neither is (a motor's current times its torque constant is its force)"
        )
    matrix = (rows, recording.tendon_count)
    promised = {
        "command": matrix,
        "motor_position": matrix,
        "motor_velocity": matrix,
        "force": matrix,
        "tip": (rows, 2),
    }
    if (joints := recording.joint_position) is not None:
        promised["joint_position"] = (rows, *joints.shape[1:2])
    series = {channel.column: getattr(recording, channel.field) for channel in CHANNELS}
    shapes = {channel.column: promised.get(channel.field, (rows,)) for channel in CHANNELS}
    for column, values in {**series, "enabled": recording.enabled, **recording.extra}.items():
        shape = shapes.get(column, (rows,))
        if values is not None and values.shape != shape:
            raise InvalidRecording(
                f"{recording.name}: {column} must have the shape {shape}; it has {values.shape}"
            )


def check_values(recording: Recording) -> None:
    """Refuse channels that are not finite or not in their unit, naming row and column."""
    for channel in CHANNELS:
        values: Array | None = getattr(recording, channel.field)
        if values is None:
            continue
        table = values.reshape(recording.sample_count, -1)
        bad = ~np.isfinite(table)
        credible = (table >= channel.lower) & (table <= channel.upper)
        rows, places = np.nonzero(bad if bad.any() else ~credible)
        if not rows.size:
            continue
        row, place = int(rows[0]), int(places[0])
        column, value = column_name(recording, channel.column, place), float(table[row, place])
        came = f"row {row} (t = {recording.time[row]:g} s) is {value:g}"
        few = len(set(rows.tolist())) <= FEW_ROWS * recording.sample_count
        mend = f"; {rows.size} rows are no readings: leave those rows out" if few else ""
        if bad.any():
            raise InvalidRecording(f"{recording.name}: {column} must be finite; {came}{mend}")
        lost = lost_sign(table[:, place])
        looks = (
            f"and looks like {channel.slip}" + (mend and mend.replace(" are", " may else be"))
            if lost is None
            else f"in {int(lost.rows.sum())} such rows {lost.text}"
        )
        raise InvalidRecording(
            f"{recording.name}: {column} must be in {channel.unit}; {came}, outside "
            f"[{channel.lower:.4g}, {channel.upper:.4g}], {looks}"
        )


def column_name(recording: Recording, column: str, place: int) -> str:
    """Name a channel's column as it stands in the file."""
    if column == "tip":
        return ("tip_x", "tip_z")[place]
    if column == "joint_angle" and recording.joint_position is not None:
        return f"{column}_{place}" if recording.joint_position.shape[1] > 1 else column
    indexed = column in ("theta_d", "theta", "theta_dot", "force")
    return f"{column}_{place}" if indexed and recording.tendon_count > 1 else column
