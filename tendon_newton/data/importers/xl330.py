"""Logs of a Dynamixel XL330-M288-T that turns a pendulum, one JSON file each.

A file states ``mass`` kg, ``length`` m, ``kp`` (firmware units), ``vin`` V and ``entries`` with
``timestamp`` s, ``position`` rad (0 hangs down), ``speed`` rad/s, ``load`` (PWM), ``input_volts``
V, ``temp`` degC, ``goal_position`` rad and ``torque_enable``. Source of the format: Rhoban/bam.
"""

import hashlib
import json
from collections.abc import Sequence
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.checks.registers import unwrap_register, wrap_period
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.importers.xl330_findings import dataset_findings, log_findings
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidRecording, TendonNewtonError, listed, shown

FULL_DUTY = 885.0  # counts of the PWM and load registers at full duty (ROBOTIS e-manual)
COUNTS_PER_RAD = 4096.0 / (2.0 * pi)  # encoder resolution (ROBOTIS e-manual)
GAIN_DIVISOR = 256.0  # firmware: PWM counts = kp * position counts / 256
SPEED_UNIT = 0.229 * 2.0 * pi / 60.0  # [rad/s] one count of the velocity register (e-manual)

# Start values of what the logs do not state. ROBOTIS e-manual at 5 V: stall 0.52 N m at 1.47 A,
# 103 rev/min without load. Torque per current at stall, losses included, is 0.354 N m/A; volts per
# speed without load is at most 0.464 V s/rad; the constant lies between.
TORQUE_CONSTANT = 0.41  # [N m/A]
RESISTANCE = 3.4  # [ohm] 5 V / 1.47 A
# order of magnitude: a rotor of 2.4e-8 kg m^2 behind the gear of 288.35:1
ARMATURE = 2e-3  # [kg m^2]

ENTRY_KEYS = (
    "timestamp",
    "position",
    "speed",
    "load",
    "input_volts",
    "temp",
    "goal_position",
    "torque_enable",
)
SIZE_LIMIT = 1 << 25
"""Bytes of a log, whose entries take twenty times as much in memory."""
FILE_KEYS = ("mass", "length", "kp", "vin", "entries")


def read_xl330(folder: Path) -> Imported:
    """Read every log of a folder."""
    if not folder.is_dir():
        came = "it is a file" if folder.exists() else "no such folder"
        raise InvalidRecording(f"{folder}: XL330 logs come as a folder of .json files; {came}")
    paths = sorted(folder.glob("*.json"))
    if not paths:
        raise InvalidRecording(f"{folder}: XL330 logs come as a folder of .json files; none is")
    findings: list[Finding] = []
    logs = []
    for path in paths:
        log, found = read_log(path)
        logs.append(log)
        findings += found
    return Imported(
        logs=tuple(logs),
        start_model=start_model,
        limits={"duty": 1.0},
        findings=(*findings, *dataset_findings(logs)),
    )


def duty_per_rad(kp: float) -> float:
    """Duty per position error of the servo's loop [1/rad] for its gain in firmware units."""
    return kp * COUNTS_PER_RAD / (GAIN_DIVISOR * FULL_DUTY)


def start_model(logs: Sequence[ImportedLog]) -> Model:
    """Make the model to start from; the recordings carry their own ``duty_per_rad``."""
    duties = [log.recording.actuator_overrides["duty_per_rad"] for log in logs]
    values = {
        "duty_per_rad": float(np.median(duties)),
        "max_duty": 1.0,
        "supply_voltage": float(np.median([float(log.conditions["vin"]) for log in logs])),
        "torque_constant": TORQUE_CONSTANT,
        "resistance": RESISTANCE,
        "armature": ARMATURE,
        "spool_radius": 1.0,  # [m] the servo turns the arm directly: force is torque
    }
    return Model(
        actuator=NamedValues(name="pwm_servo", values=values),
        fit=("torque_constant", "resistance", "armature"),
    )


def read_log(path: Path) -> tuple[ImportedLog, list[Finding]]:
    """Read one log and say what was found in its registers."""
    size = path.stat().st_size
    if size > SIZE_LIMIT:
        raise InvalidRecording(
            f"{path}: an XL330 log has at most {SIZE_LIMIT} bytes; it has {size}"
        )
    content = path.read_bytes()
    table = read_json(content, path)
    columns = read_entries(table["entries"], path)
    load, duty_wraps = unwrapped(columns["load"], 1.0)
    speed, speed_wraps = unwrapped(columns["speed"], SPEED_UNIT)
    gain = duty_per_rad(read_number(table, "kp", path))
    sizes = {key: (read_number(table, key, path),) for key in ("mass", "length")}
    try:
        recording = Recording(
            name=f"{path.stem}.csv",
            bench="pendulum",
            time=columns["timestamp"],
            command=columns["goal_position"][:, None],
            motor_position=columns["position"][:, None],
            motor_velocity=speed[:, None],
            voltage=columns["input_volts"],
            temperature=columns["temp"],
            enabled=columns["torque_enable"] != 0.0,
            extra={"duty": load / FULL_DUTY},
            start="first_row",
            bench_overrides=BenchOverrides(**sizes),
            actuator_overrides={"duty_per_rad": gain},
        )
    except TendonNewtonError as error:
        raise InvalidRecording(f"{path}: {error}") from error
    log = ImportedLog(
        recording=recording,
        conditions=conditions_of(table, path),
        source=path,
        sha256=hashlib.sha256(content).hexdigest(),
    )
    return log, log_findings(log, duty_wraps, speed_wraps)


def unwrapped(values: Array, unit: float) -> tuple[Array, int]:
    """Undo a wrapped register and count the rows that were wrapped."""
    period = wrap_period(values, unit)
    if period is None:
        return values, 0
    return unwrap_register(values, period), int((values > 0.5 * period).sum())


def read_json(content: bytes, path: Path) -> dict[str, Any]:
    """Read a file's table and check its keys."""
    try:
        table = json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InvalidRecording(f"{path}: an XL330 log must be JSON: {error}") from error
    if not isinstance(table, dict):
        raise InvalidRecording(
            f"{path}: an XL330 log must be a JSON object; it is a {type(table).__name__}"
        )
    for key in FILE_KEYS:
        if key not in table:
            raise InvalidRecording(
                f"{path}: an XL330 log must state {key!r}; it states {listed(table)}"
            )
    motor = str(table.get("motor", "xl330"))
    if not motor.startswith("xl330"):
        raise InvalidRecording(f"{path}: the motor must be an xl330; it is {shown(motor)}")
    return table


def read_number(table: dict[str, Any], key: str, path: Path) -> float:
    """Read a positive number that a file states once."""
    value = finite_number(table[key])
    if value is None or value <= 0.0:
        raise InvalidRecording(
            f"{path}: {key} must be a positive number; it is {shown(table[key])}"
        )
    return value


def read_entries(entries: Any, path: Path) -> dict[str, Array]:
    """Turn the list of entries into columns, naming an entry that lacks a number."""
    if not isinstance(entries, list) or not entries:
        raise InvalidRecording(f"{path}: entries must be a list with one object per row")
    columns: dict[str, list[float]] = {key: [] for key in ENTRY_KEYS}
    for row, entry in enumerate(entries):
        for key, column in columns.items():
            value = entry.get(key) if isinstance(entry, dict) else None
            number = float(value) if isinstance(value, bool) else finite_number(value)
            if number is None:
                raise InvalidRecording(
                    f"{path}: {key} must be a number in every entry; entry {row} has {shown(value)}"
                )
            column.append(number)
    return {key: np.array(column) for key, column in columns.items()}


def conditions_of(table: dict[str, Any], path: Path) -> dict[str, float | str]:
    """Everything that a file states once, for selecting it."""
    stated = {key: value for key, value in table.items() if isinstance(value, int | float | str)}
    return {"file": path.stem, "vin": read_number(table, "vin", path), **stated}
