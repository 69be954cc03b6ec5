"""Commands of a CSV file through the hook, row by row."""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.exports.runtime.engine import mujoco
from tendon_newton.exports.runtime.stepping import Hook

LONGEST_STEP = 1.0e-4
"""Default step [s]."""


def replay(hook: Hook, rows: dict[str, Any], step: float = LONGEST_STEP) -> dict[str, Any]:
    """Replay commands and return what the bench would report in each row.

    Args:
        hook: A model with its servos.
        rows: `t` [s], shape (T,), `theta_d` [rad], shape (T, D), and where they are known
            `voltage` [V] and `enabled`, shape (T,); `start` with motor angles [rad] and speeds
            [rad/s] of the first row, where it is not rest.
        step: Longest step [s].

    Returns:
        `t`, `theta`, `theta_dot`, `force` (T, D) and `joints` (T, J).
    """
    time, command = np.asarray(rows["t"]), np.asarray(rows["theta_d"])
    command = command.reshape(len(time), -1)
    first, rate = rows.get("start", (None, None))
    hook.voltage, hook.enabled = inputs_of(rows, 0)
    hook.model.opt.timestep = step
    hook.reset(command[0], first, rate)
    out: dict[str, list[Any]] = {"theta": [], "theta_dot": [], "force": [], "joints": []}
    for k in range(len(time)):
        hook.command[:] = command[k]
        hook.voltage, hook.enabled = inputs_of(rows, k)
        reading = hook.read()
        out["theta"].append(reading.angle)
        out["theta_dot"].append(reading.angle_rate)
        out["force"].append(reading.force)
        out["joints"].append(hook.data.qpos[hook.places].copy())
        if k + 1 < len(time):
            interval = (time[k + 1] - time[k]) * hook.period
            count = max(1, math.ceil(interval / step - 1.0e-6))
            hook.model.opt.timestep = interval / count
            for _ in range(count):
                hook.step()
    return {"t": time, **{name: np.array(values) for name, values in out.items()}}


def inputs_of(rows: dict[str, Any], k: int) -> tuple[float, float]:
    """Return supply [V], zero for the model's own, and whether the motor is on, in a row."""
    voltage, enabled = rows.get("voltage"), rows.get("enabled")
    return (
        0.0 if voltage is None else float(voltage[k]),
        1.0 if enabled is None else float(enabled[k]),
    )


def read_commands(path: Path, count: int) -> dict[str, Any]:
    """Read a CSV file with t and theta_d, or theta_d_0, theta_d_1 and so on."""
    with path.open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    names = ["theta_d"] if count == 1 else [f"theta_d_{d}" for d in range(count)]
    if len(lines) < 2 or not {"t", *names} <= set(lines[0]):
        raise SystemExit(
            f"{path} must have two rows or more with the columns t, {', '.join(names)}"
        )
    columns = {name: np.array([float(line[name]) for line in lines]) for name in ("t", *names)}
    return {"t": columns["t"], "theta_d": np.array([columns[name] for name in names]).T}


def steps_and_ramps(count: int, low: float, high: float) -> dict[str, Any]:
    """Return ten seconds of commands at 80 Hz between two angles [rad]."""
    time = np.arange(800) / 80.0
    share = np.where(time < 4.0, np.floor(time) % 2.0, 0.5 - 0.5 * np.cos(math.pi * (time - 4.0)))
    command = low + (high - low) * share
    return {"t": time, "theta_d": np.repeat(command[:, None], count, axis=1)}


def write_rows(path: Path, rows: dict[str, Any]) -> None:
    """Write a replay as a CSV file."""
    count = rows["theta"].shape[1]
    ends = [""] if count == 1 else [f"_{d}" for d in range(count)]
    header = ["t", *(f"{n}{e}" for n in ("theta", "theta_dot", "force") for e in ends)]
    table = np.column_stack([rows["t"], rows["theta"], rows["theta_dot"], rows["force"]])
    lines = [",".join(header), *(",".join(f"{x:.9g}" for x in line) for line in table)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def run(make: Any, folder: Path, span: tuple[float, float]) -> None:
    """Replay a file of commands, or some steps and ramps, and say what came of it."""
    parser = argparse.ArgumentParser(description="Replay commands through the exported model.")
    parser.add_argument("commands", type=Path, nargs="?", help="CSV file with t and theta_d")
    parser.add_argument("--out", type=Path, help="CSV file for the result")
    parser.add_argument("--step", type=float, default=LONGEST_STEP, help="longest step [s]")
    options = parser.parse_args()
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    hook = make(model, mujoco.MjData(model))
    count = len(hook.servos)
    rows = (
        read_commands(options.commands, count)
        if options.commands
        else steps_and_ramps(count, *span)
    )
    result = replay(hook, rows, options.step)
    if options.out:
        write_rows(options.out, result)
    theta, force = result["theta"], result["force"]
    print(
        f"{len(theta)} rows, {rows['t'][-1] - rows['t'][0]:.2f} s: motor angle "
        f"{theta.min():.4f} to {theta.max():.4f} rad, force {force.min():.3f} to {force.max():.3f}"
    )
