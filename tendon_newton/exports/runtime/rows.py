"""Commands of a CSV file through the bench, row by row."""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.exports.runtime.facts import PERIOD, SERVO_ROWS, SPAN, TIME_STEP


def replay(bench: Any, rows: dict[str, Any], step: float = TIME_STEP) -> dict[str, Any]:
    """Replay commands and return what the bench would report in each row.

    Args:
        bench: A simulation of it.
        rows: `t` [s], shape (T,), `theta_d` [rad], shape (T, D), and where they are known
            `voltage` [V] and `enabled`, shape (T,); where its first row is not rest, what the
            simulation's `begin` takes.
        step: Longest step [s].

    Returns:
        `t`, `angle` [rad], `rate` [rad/s] and `force` [N], shape (T, D), and `joints` (T, J).
    """
    time = np.asarray(rows["t"])
    command = np.asarray(rows["theta_d"]).reshape(len(time), -1)
    out: dict[str, list[Any]] = {"angle": [], "rate": [], "force": [], "joints": []}
    bench.begin(command[0], *inputs_of(rows, 0), rows, step)
    for k in range(len(time)):
        bench.ask(command[k], *inputs_of(rows, k))
        for name, values in zip(out, bench.report(), strict=True):
            out[name].append(np.array(values))
        if k + 1 < len(time):
            interval = (time[k + 1] - time[k]) * PERIOD
            count = max(1, math.ceil(interval / step - 1.0e-6))
            bench.advance(interval / count, count)
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


def steps_and_ramps(count: int, low: Any, high: Any) -> dict[str, Any]:
    """Return ten seconds of commands at 80 Hz between two angles [rad], of all or of each servo."""
    time = np.arange(800) / 80.0
    share = np.where(time < 4.0, np.floor(time) % 2.0, 0.5 - 0.5 * np.cos(math.pi * (time - 4.0)))
    lowest, highest = np.broadcast_to(low, count), np.broadcast_to(high, count)
    return {"t": time, "theta_d": lowest + np.outer(share, highest - lowest)}


def write_rows(path: Path, rows: dict[str, Any]) -> None:
    """Write a replay as a CSV file."""
    count = rows["angle"].shape[1]
    ends = [""] if count == 1 else [f"_{d}" for d in range(count)]
    header = ["t", *(f"{n}{e}" for n in ("theta", "theta_dot", "force") for e in ends)]
    table = np.column_stack([rows[name] for name in ("t", "angle", "rate", "force")])
    lines = [",".join(header), *(",".join(f"{x:.9g}" for x in line) for line in table)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def run(make: Callable[[], Any]) -> None:
    """Replay a file of commands, or some steps and ramps, and say what came of it."""
    parser = argparse.ArgumentParser(description="Replay commands through the exported model.")
    parser.add_argument("commands", type=Path, nargs="?", help="CSV file with t and theta_d")
    parser.add_argument("--out", type=Path, help="CSV file for the result")
    parser.add_argument("--step", type=float, default=TIME_STEP, help="longest step [s]")
    options = parser.parse_args()
    count = len(SERVO_ROWS)
    rows = (
        read_commands(options.commands, count)
        if options.commands
        else steps_and_ramps(count, *SPAN)
    )
    result = replay(make(), rows, options.step)
    if options.out:
        write_rows(options.out, result)
    angle, force = result["angle"], result["force"]
    print(
        f"{len(angle)} rows, {rows['t'][-1] - rows['t'][0]:.2f} s: motor angle "
        f"{angle.min():.4f} to {angle.max():.4f} rad, force {force.min():.3f} to {force.max():.3f}"
    )
