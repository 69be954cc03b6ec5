"""A program that an export has written: loaded, fed with a recording, and what it reports."""

import importlib.util
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.checks.first_rows import start_of
from tendon_newton.data.checks.measures import supply_of
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.effects import law_of
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.hosts.timeline import make_timeline


def load_program(path: Path) -> Any:
    """Return a written program as a module, whose kernels Warp keeps compiled under its name."""
    name = f"{path.stem}_{file_hash(path)[:16]}"
    spec: Any = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rows_of(recording: Recording, model: Model) -> dict[str, Any]:
    """Return what a program needs of a recording; that of a network begins with the first row."""
    timeline = make_timeline(recording)
    if find_actuator(model.actuator.name).held:
        timeline = timeline.without_past()
    rows: dict[str, Any] = {
        "t": timeline.time,
        "theta_d": timeline.command,
        "enabled": np.interp(timeline.time, recording.time, recording.enabled) > 0.5,
    }
    if (supply := supply_of(recording)) is not None:
        rows["voltage"] = np.interp(timeline.time, recording.time, supply)
    sticks = any(e.values.get(n) for e in model.effects for n in law_of(e.name).dry)
    if (begin := start_of(recording)) is not None and (sticks or not begin.if_held):
        rows["start"] = (begin.angle, begin.rate)
    return rows


def trajectory_of(recording: Recording, found: Mapping[str, Array]) -> Trajectory:
    """Return what a program reported at the instants of `rows_of`, in the recording's own rows.

    It reported motor ``angle`` [rad], ``rate`` [rad/s] and ``force`` [N], shape (T, D), and
    ``joints`` [rad, m], shape (T, J).
    """
    rows = make_timeline(recording).measured
    rows = rows + len(found["angle"]) - 1 - rows[-1]
    return Trajectory(
        time=recording.time,
        motor_position=found["angle"][rows],
        motor_velocity=found["rate"][rows],
        force=found["force"][rows],
        joint_position=found["joints"][rows],
    )
