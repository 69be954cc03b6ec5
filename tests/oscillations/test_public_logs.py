"""Logs of sound machines that others published: nothing in them shakes."""

import csv
import json
import tarfile
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.importers.lerobot.units import LeRobotUnits
from tendon_newton.data.oscillations.log_reading import read_any_log
from tendon_newton.data.oscillations.log_told import tell_log
from tendon_newton.data.oscillations.shaking import evenly
from tendon_newton.data.oscillations.told_loop import lines_of, tell_lines
from tendon_newton.data.recording import Array

PENDULUM = """bench = "servo"
files = "*.json"
rows = "entries"
[columns]
t = {column = "timestamp"}
theta_d = {column = "goal_position"}
theta = {column = "position"}
enabled = {column = "torque_enable"}
"""


def shaken(folder: Path, mapping: Path) -> tuple[list[str], int]:
    """Return the logs of a folder in which something shakes, and how many there are."""
    log = read_any_log(str(folder), mapping, LeRobotUnits())
    found = [name for joint in tell_log(log) for name in joint.shaken]
    return found, len(log.recordings)


@pytest.mark.slow
def test_pendulums_of_two_servos_are_calm(tmp_path: Path, shared: Path) -> None:
    """Four gains each; every fourth row of the STS3215 comes late, which looks like 25 Hz."""
    mapping = tmp_path / "mapping.toml"
    write_text(mapping, PENDULUM)
    assert shaken(shared / "data" / "xl330", mapping) == ([], 16)
    with tarfile.open(shared / "data" / "sts3215" / "sts3215.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    assert shaken(tmp_path / "sts3215", mapping) == ([], 320)


@pytest.mark.slow
def test_an_arm_is_calm(shared: Path) -> None:
    """Six joints, thirteen motions; a joint that stands is moved by the others' weight."""
    folders = sorted(path.parent for path in (shared / "data" / "so101").glob("*/control.csv"))
    assert len(folders) == 13
    for folder in folders:
        (time, commands), (_, angles) = (
            columns(folder / f"{name}.csv") for name in ("control", "state_motor")
        )
        for place, angle in enumerate(angles.T):
            each = [evenly(time, command, angle) for command in commands.T]
            others = [one.command for k, one in enumerate(each) if k != place]
            told = tell_lines(lines_of(each[place], others))
            assert told.shaking is None, (folder.name, place, told.shaking)


@pytest.mark.parametrize(
    "log", ["strangers/sts3215_free", "strangers/torque_servo", "doors/cart_string"]
)
def test_machines_of_strangers_are_calm(log: str, shared: Path) -> None:
    """A free horn, a torque servo, and a cart whose goal runs too fast for it."""
    folder = shared / "data" / log
    logs = folder / "logs" if (folder / "logs").is_dir() else folder
    assert shaken(logs, folder / "mapping.toml")[0] == []


def columns(path: Path) -> tuple[Array, Array]:
    """Return stamps [s] and the positions of all joints [rad], shape (T,) and (T, 6)."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    time: Array = 1e-6 * np.array([float(row["timestamp"]) for row in rows])
    return time, np.array([json.loads(row["positions"]) for row in rows], dtype=np.float64)
