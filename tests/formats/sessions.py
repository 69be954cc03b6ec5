"""Small made-up logs of a bench as MCAP files."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.logs import ros_messages as ros
from tendon_hardware.logs.mcap_file import McapFile
from tendon_hardware.logs.session_log import SessionLog, TimeBase
from tendon_hardware.servos.base import ServoCounters, ServoHealth, ServoState
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.formats.topic_mapping import (
    COMMAND_TOPIC,
    FORCE_TOPIC,
    SESSION_RECORD,
    STATE_TOPIC,
)
from tendon_newton.data.model_file import load_model

EPOCH = 1_767_225_600_000_000_000  # 1 January 2026 [ns]
START = 1234.5  # Of the bench's clock [s]
HEALTH = ServoHealth(
    voltage=11.1, temperature=30.0, hardware_error=0, torque_enabled=True, watchdog_tripped=False
)


@dataclass(frozen=True, kw_only=True)
class Signals:
    """What is written, as functions of time [s]."""

    theta: Callable[[float], float] = lambda t: float(np.sin(t))
    theta_d: Callable[[float], float] = lambda t: float(np.round(2.0 * t) / 10.0)
    force: Callable[[float], float] = lambda t: 2.0 + t


def write_session(
    path: Path,
    *,
    rows: int = 160,
    cell_rate: float = 20.0,
    signals: Signals | None = None,
    silence: tuple[float, float] | None = None,
    finish: bool = True,
    **session: str,
) -> Path:
    """Write two seconds of a bench at 80 Hz.

    Args:
        cell_rate: Readings of the load cell per second [Hz].
        silence: Interval in which the load cell sends nothing [s].
        finish: Whether the file gets its end; if not, as the process was killed.
    """
    signals = signals or Signals()
    file = McapFile(path, {SESSION_RECORD: {"bench": "finger", "seed": "7", **session}})
    log = SessionLog(file, TimeBase(start=START, epoch=EPOCH))
    stride = round(80.0 / cell_rate)
    for k in range(rows):
        t = k / 80.0
        instant = START + t
        log.command(instant - 0.001, signals.theta_d(t))
        log.state(
            ServoState(
                time=instant, position=signals.theta(t), velocity=float(np.cos(t)), current=0.1
            )
        )
        quiet = silence is not None and silence[0] < t < silence[1]
        if k % stride == 0 and not quiet:
            log.raw_force(
                LoadCellReading(
                    sequence=k,
                    device_time_us=4_000_000_000 + 12_500 * k,
                    host_time=instant,
                    counts=-1000 - k,
                )
            )
            log.force(instant, instant + 0.002, signals.force(t))
        if k % 40 == 0:
            log.health(instant, HEALTH, ServoCounters())
            log.event(instant, "servo", "warn", "something happened", seconds=0.1)
    if finish:
        log.finish({"bench": "finger", "rows": str(rows), **session})
    else:
        file.flush(sync=False)
        file.close()
    return path


def write_two_tendons(path: Path, *, frames: tuple[str, str] = ("thumb", "index")) -> Path:
    """Write two servos in one message and two load cells on one topic."""
    file = McapFile(path, {})
    for k in range(80):
        stamp = EPOCH + k * 12_500_000
        names = ["thumb", "index"]
        file.write(COMMAND_TOPIC, ros.JOINT_STATE, stamp, ros.joint_state(stamp, names, [1.0, 2.0]))
        file.write(
            STATE_TOPIC,
            ros.JOINT_STATE,
            stamp,
            ros.joint_state(stamp, names, [0.1, 0.2], [0.0, 0.0], [0.3, 0.4]),
        )
        for frame, force in zip(frames, (5.0, 6.0), strict=True):
            file.write(FORCE_TOPIC, ros.WRENCH, stamp, ros.wrench(stamp, frame, force))
    file.finish({})
    return path


def write_states(path: Path, messages: list[ros.Message], *, topic: str = STATE_TOPIC) -> Path:
    """Write JointState messages as they are, one every 12.5 ms."""
    file = McapFile(path, {})
    for k, message in enumerate(messages):
        file.write(topic, ros.JOINT_STATE, EPOCH + k * 12_500_000, message)
        file.write(
            COMMAND_TOPIC,
            ros.JOINT_STATE,
            EPOCH + k * 12_500_000,
            ros.joint_state(EPOCH + k * 12_500_000, ["a"], [0.5]),
        )
    file.finish({})
    return path


@dataclass(frozen=True, kw_only=True)
class ReadingConfig:
    """What every verb that simulates starts from."""

    dataset: tyro.conf.Positional[Path]  # Folder of the dataset
    model: Path  # Model file


def main(config: ReadingConfig) -> None:
    """Read both, dataset first."""
    load_dataset(config.dataset)
    load_model(config.model)
