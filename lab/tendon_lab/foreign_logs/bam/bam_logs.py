"""Logs of Rhoban/bam, one JSON file each: a servo turns a pendulum.

A file states ``mass`` kg, ``length`` m, ``kp`` (firmware units), ``vin`` V, ``motor`` and
``entries`` with ``timestamp`` s, ``position`` rad (0 hangs down), ``goal_position`` rad and
``torque_enable``; most have ``speed`` rad/s, ``load``, ``input_volts`` V and ``temp`` degC too.
Source of the format: Rhoban/bam, ``bam/*/record.py``.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_lab.foreign_logs.bam.bam_findings import arm_findings, log_findings
from tendon_lab.foreign_logs.bam.failed_reads import without_failed_reads
from tendon_lab.foreign_logs.bam.feetech import (
    feetech_findings,
    firmware_of,
    goal_findings,
    signed_duty,
    unmeasured_load,
)
from tendon_lab.foreign_logs.bam.motors import BamMotor, motor_named
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.files.text_file import finite_number, read_bytes
from tendon_newton.data.files.values import is_list, is_table
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.lost_signs import lost_sign
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidRecording, TendonNewtonError, listed, shown

REQUIRED = ("timestamp", "position", "goal_position", "torque_enable")
OPTIONAL = ("speed", "load", "torque", "input_volts", "temp", "current")
SIZE_LIMIT = 1 << 25  # Bytes of a log, whose entries take twenty times as much in memory
FILE_KEYS = ("mass", "length", "kp", "vin", "entries")
ARM_SHARE = 0.1  # Weight of an arm that nobody states, as a share of the lightest load [1]
CURRENT_UNIT = 1.0e-3  # [A] ``current`` of the logs that have it is in milliamperes


@dataclass(frozen=True, kw_only=True)
class LogKind:
    """What an importer takes for its own."""

    title: str  # What messages call the logs
    motors: Mapping[str, BamMotor]  # Servos by how their names begin
    unnamed: BamMotor | None = None  # The servo of a log that names none


def read_logs(folder: Path, kind: LogKind) -> Imported:
    """Read every log of a folder; all of one servo.

    Raises:
        InvalidRecording: A file is no such log; the message names it.
    """
    promise = f"{folder}: {kind.title} logs come as a folder of .json files"
    if not folder.is_dir():
        raise InvalidRecording(f"{promise}; {'it is a file' if folder.exists() else 'no such one'}")
    paths = sorted(folder.glob("*.json"))
    if not paths:
        raise InvalidRecording(f"{promise}; none is")
    findings: list[Finding] = []
    logs: list[ImportedLog] = []
    motors: dict[str, BamMotor] = {}
    for path in paths:
        log, motor, found = read_log(path, kind)
        motors[path.name] = motor
        logs.append(log)
        findings += found
    motor = motors[paths[0].name]
    for name, other in motors.items():
        if other is not motor:
            raise InvalidRecording(
                f"{folder}: one import is of one servo; {paths[0].name} and {name} are of two: "
                "put each into a folder of its own"
            )
    return Imported(
        logs=tuple(logs),
        start_model=lambda chosen: start_model_of(chosen, motor),
        limits={"duty": 1.0} if motor.full_duty else {},
        findings=(*findings, *arm_findings(logs), *goal_findings(logs, motor)),
    )


def start_model_of(logs: Sequence[ImportedLog], motor: BamMotor) -> Model:
    """Make the model to start from; the recordings carry their own ``duty_per_rad``."""
    duties = [log.recording.actuator_overrides["duty_per_rad"] for log in logs]
    values = {
        "duty_per_rad": float(np.median(duties)),
        "max_duty": motor.max_duty,
        "supply_voltage": float(np.median([float(log.conditions["vin"]) for log in logs])),
        "torque_constant": motor.torque_constant,
        "resistance": motor.resistance,
        "armature": motor.armature,
        "spool_radius": 1.0,  # [m] the servo turns the arm directly: force is torque
    }
    arm = unweighed_arm(logs)
    return Model(
        actuator=NamedValues(name="pwm_servo", values=values),
        effects=firmware_of(logs, motor),
        bench_overrides={} if arm is None else {"pendulum": BenchOverrides(arm_mass=(arm,))},
        fit=("torque_constant", "resistance", "armature", *([] if arm is None else ["arm_mass"])),
    )


def unweighed_arm(logs: Sequence[ImportedLog]) -> float | None:
    """Return where the search for an arm's mass [kg] starts, None where it has no search.

    Under one load alone a heavier arm is a stronger motor: several loads tell.
    """
    loads = {log.recording.bench_overrides for log in logs}
    weighed = any(load.arm_mass is not None for load in loads)
    if weighed or len(loads) < 2:
        return None
    return ARM_SHARE * min(float(log.conditions["mass"]) for log in logs)


def read_log(path: Path, kind: LogKind) -> tuple[ImportedLog, BamMotor, list[Finding]]:
    """Read one log and say what was found in its registers."""
    content = read_bytes(
        path, InvalidRecording, f"an {kind.title} log is a file", size_limit=SIZE_LIMIT
    )
    table = read_table(content, path, kind)
    motor = motor_of(table, path, kind)
    columns = read_entries(table["entries"], path)
    columns, kept_back = without_failed_reads(columns, f"{path.stem}.csv")
    wraps: dict[str, int] = {}
    for name, unit in (("load", 1.0), ("speed", motor.speed_unit)):
        if name in columns and motor.full_duty and unit:
            columns[name], wraps[name] = unwrapped(columns[name], unit)
    recording = recording_of(path, table, columns, motor)
    log = ImportedLog(
        recording=recording,
        conditions=conditions_of(table, path),
        source=path,
        sha256=content_hash(content),
    )
    told = [*kept_back, *log_findings(log, wraps), *unmeasured_load(log.recording, columns)]
    if motor.load_is_duty:
        told += feetech_findings(log)
    return log, motor, told


def recording_of(
    path: Path, table: Mapping[str, Any], columns: Mapping[str, Array], motor: BamMotor
) -> Recording:
    """Build the recording of a log."""
    position = columns["position"][:, None]
    extra = {}
    if "load" in columns and columns["load"].any():  # some programs log no load and write 0
        name, unit = ("duty", motor.full_duty) if motor.full_duty else ("load", 1.0)
        extra = {name: columns["load"] / unit}
    elif "torque" in columns and motor.load_is_duty:
        extra = {"duty": signed_duty(columns)}
    sizes = {key: (read_number(table, key, path),) for key in ("mass", "length")}
    if finite_number(table.get("arm_mass")):
        sizes["arm_mass"] = (read_number(table, "arm_mass", path),)
    gain = read_number(table, "kp", path) * motor.duty_per_gain
    speed = columns.get("speed")
    current = columns.get("current")
    try:
        recording = Recording(
            name=f"{path.stem}.csv",
            bench="pendulum",
            time=columns["timestamp"],
            command=columns["goal_position"][:, None],
            motor_position=position,
            motor_velocity=np.zeros_like(position) if speed is None else speed[:, None],
            voltage=columns.get("input_volts"),
            current=None if current is None else CURRENT_UNIT * current,
            temperature=columns.get("temp"),
            enabled=columns["torque_enable"] != 0.0,
            extra=extra,
            start="first_row",
            bench_overrides=BenchOverrides(**sizes),
            actuator_overrides={"duty_per_rad": gain},
        )
    except TendonNewtonError as error:
        raise InvalidRecording(f"{path}: {error}") from error
    if speed is not None:
        return recording
    return replace(recording, motor_velocity=np.gradient(position, recording.time, axis=0))


def unwrapped(values: Array, unit: float) -> tuple[Array, int]:
    """Undo a wrapped register and count the rows that were wrapped."""
    lost = lost_sign(values, unit)
    return (values, 0) if lost is None else (lost.mended(values), int(lost.rows.sum()))


def read_table(content: bytes, path: Path, kind: LogKind) -> dict[str, Any]:
    """Read a file's table and check its keys."""
    what = f"{path}: an {kind.title} log must"
    try:
        table = json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InvalidRecording(f"{what} be JSON: {error}") from error
    if not is_table(table):
        raise InvalidRecording(f"{what} be a JSON object; it is a {type(table).__name__}")
    for key in FILE_KEYS:
        if key not in table:
            raise InvalidRecording(f"{what} state {key!r}; it states {listed(table)}")
    return table


def motor_of(table: Mapping[str, Any], path: Path, kind: LogKind) -> BamMotor:
    """Return the servo that a log is of."""
    if "motor" not in table and kind.unnamed is not None:
        return kind.unnamed
    motor = motor_named(str(table.get("motor", "")), kind.motors)
    if motor is None:
        raise InvalidRecording(
            f"{path}: the motor must be one of {listed(kind.motors)}; it is "
            f"{shown(table.get('motor'))}"
        )
    return motor


def read_number(table: Mapping[str, Any], key: str, path: Path) -> float:
    """Read a positive number that a file states once."""
    value = finite_number(table[key])
    if value is None or value <= 0.0:
        raise InvalidRecording(
            f"{path}: {key} must be a positive number; it is {shown(table[key])}"
        )
    return value


def read_entries(entries: Any, path: Path) -> dict[str, Array]:
    """Turn the list of entries into columns, naming an entry that lacks a number."""
    if not is_list(entries) or not entries:
        raise InvalidRecording(f"{path}: entries must be a list with one object per row")
    first = entries[0] if is_table(entries[0]) else {}
    there = (*REQUIRED, *(key for key in OPTIONAL if key in first))
    columns: dict[str, list[float]] = {key: [] for key in there}
    for row, entry in enumerate(entries):
        for key, column in columns.items():
            value = entry.get(key) if is_table(entry) else None
            number = float(value) if isinstance(value, bool) else finite_number(value)
            if number is None:
                raise InvalidRecording(
                    f"{path}: {key} must be a number in every entry; entry {row} has {shown(value)}"
                )
            column.append(number)
    return {key: np.array(column) for key, column in columns.items()}


def conditions_of(table: Mapping[str, Any], path: Path) -> dict[str, float | str]:
    """Everything that a file states once, for selecting it."""
    stated = {key: value for key, value in table.items() if isinstance(value, int | float | str)}
    names = {f"part{place}": part for place, part in enumerate(path.stem.split("_"))}
    return {**names, "file": path.stem, "vin": read_number(table, "vin", path), **stated}
