"""Machines of a stranger that logged angle and torque, ``python -m lab.studies.measured_paths``.

Each machine is a few lines of its own here, and shares no code with the package. Its log is a CSV
file without a command. The whole way is walked: `import mapped`, `diagnose`. Beside each number
that is found stand what was planted and what least squares by numpy find, given the right law and
the true delay and Stribeck speed, which they cannot fit.
"""

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from tendon_newton.cli import main as program
from tendon_newton.data.recording import Array

RATE = 100.0  # Rows per second
RUNS, ROWS = 4, 1500
COUNT = 2.0 * np.pi / 16384.0  # Of the encoder [rad]; of the axis 10 um
GRAVITY = 9.81  # [m/s2]
MASS, LENGTH, ROTOR = 2.3, 0.4, 0.21  # Of the arms [kg, m, kg m2]
WINDOW = 11  # Rows of the cubics by which least squares get their rates

FIRST_MASS = 4.0  # What the drawing says [kg]; it is fitted
HEADER = "time,place,torque"
MAPPING = """bench = "machine"
fit = ["mass"]
{stated}
[columns]
t = {column = "time"}
theta = {column = "place"}
theta_dot = {derive = "theta"}
force = {column = "torque"}

[model]
kind = "measured_path"
"""

Number = tuple[str, str]  # Effect and parameter, or "fitted" and a number of the bench


@dataclass(frozen=True, kw_only=True)
class Machine:
    """One machine: what it asks of its motor, and what of that has a name."""

    kind: str  # `asset new --kind`
    torque: Callable[[Array, Array, Array, Array], Array]
    """Torque or force [N m, N] by time, place, rate and acceleration, shape (T,) each."""
    truth: dict[Number, float]
    columns: Callable[[Array, Array, Array, Array], Sequence[Array]]
    """Columns of a regression, in the order of `named`."""
    named: Callable[[Array], dict[Number, float]]
    """Numbers by a regression's coefficients."""
    noise: float  # Of the torque [N m, N]
    late: float = 0.0  # Delay of the torque [s]


def arm(q: Array, a: Array) -> Array:
    """Return what gravity and inertia ask of an arm that hangs at 0 [N m]."""
    inertia = MASS * LENGTH**2 + ROTOR
    return inertia * a + MASS * GRAVITY * LENGTH * np.sin(q)


def stribeck(v: Array, speed: float) -> Array:
    """Return the share of dry friction that speed has not taken away yet [1]."""
    return np.exp(-((v / speed) ** 2)) * np.sign(v)


OF_ARM = {
    ("fitted", "mass"): MASS,
    ("inertia_error", "scale"): 1.0 + ROTOR / (MASS * LENGTH**2),
    ("coulomb_friction", "force"): 1.1,
    ("viscous_friction", "coefficient"): 0.55,
}


def arm_columns(t: Array, q: Array, v: Array, a: Array) -> list[Array]:
    """Return the columns of an arm with dry and viscous friction."""
    return [np.sin(q), a, np.sign(v), v]


def arm_numbers(x: Array) -> dict[Number, float]:
    """Return an arm's numbers by their coefficients."""
    mass = x[0] / (GRAVITY * LENGTH)
    return dict(zip(OF_ARM, (mass, x[1] / (mass * LENGTH**2), x[2], x[3]), strict=True))


MACHINES = {
    "gravity": Machine(
        kind="shaft",
        torque=lambda t, q, v, a: arm(q, a) + 1.1 * np.sign(v) + 0.55 * v,
        truth=OF_ARM,
        columns=arm_columns,
        named=arm_numbers,
        noise=0.12,
    ),
    "drift": Machine(
        kind="shaft",
        torque=lambda t, q, v, a: arm(q, a) + 1.1 * np.sign(v) + 0.55 * v + 0.6 + 0.05 * t,
        truth=OF_ARM | {("load_cell_bias", "offset"): 0.6, ("load_cell_drift", "rate"): 0.05},
        columns=lambda t, q, v, a: [*arm_columns(t, q, v, a), np.ones_like(t), t],
        named=lambda x: (
            arm_numbers(x) | {("load_cell_bias", "offset"): x[4], ("load_cell_drift", "rate"): x[5]}
        ),
        noise=0.12,
    ),
    "delayed current": Machine(
        kind="shaft",
        torque=lambda t, q, v, a: arm(q, a) + 1.1 * np.sign(v) + 0.55 * v,
        truth=OF_ARM | {("load_cell_delay", "delay"): 0.024},
        columns=arm_columns,
        named=arm_numbers,
        noise=0.12,
        late=0.024,
    ),
    "stribeck": Machine(
        kind="shaft",
        torque=lambda t, q, v, a: arm(q, a) + 0.9 * np.sign(v) + 0.8 * stribeck(v, 0.3) + 0.55 * v,
        truth={
            **{key: OF_ARM[key] for key in list(OF_ARM)[:2]},
            ("stribeck_friction", "coulomb_force"): 0.9,
            ("stribeck_friction", "static_force"): 1.7,
            ("stribeck_friction", "stribeck_velocity"): 0.3,
            ("viscous_friction", "coefficient"): 0.55,
        },
        columns=lambda t, q, v, a: [*arm_columns(t, q, v, a), stribeck(v, 0.3)],
        named=lambda x: {
            **{key: value for key, value in arm_numbers(x).items() if key[0] != "coulomb_friction"},
            ("stribeck_friction", "coulomb_force"): x[2],
            ("stribeck_friction", "static_force"): x[2] + x[4],
        },
        noise=0.12,
    ),
    "linear axis": Machine(
        kind="slider",
        torque=lambda t, q, v, a: 12.0 * a + 8.0 * np.sign(v) + 30.0 * v,
        truth={
            ("fitted", "mass"): 12.0,
            ("coulomb_friction", "force"): 8.0,
            ("viscous_friction", "coefficient"): 30.0,
        },
        columns=lambda t, q, v, a: [a, np.sign(v), v],
        named=lambda x: {
            ("fitted", "mass"): x[0],
            ("coulomb_friction", "force"): x[1],
            ("viscous_friction", "coefficient"): x[2],
        },
        noise=0.8,
    ),
}


def motion(t: Array, rng: np.random.Generator, size: float) -> tuple[Array, Array, Array]:
    """Return place, rate and acceleration of a sum of slow swings, shape (T,) each."""
    q, v, a = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    for frequency in rng.uniform(0.08, 0.9, 4):
        w, phase = 2.0 * np.pi * frequency, rng.uniform(0.0, 2.0 * np.pi)
        height = size * rng.uniform(0.5, 1.0) * min(1.0, 0.35 / frequency)
        q += height * np.sin(w * t + phase)
        v += height * w * np.cos(w * t + phase)
        a -= height * w**2 * np.sin(w * t + phase)
    return q, v, a


def logs_of(machine: Machine, rng: np.random.Generator) -> list[Array]:
    """Return what the machine logs, columns time, place and torque, shape (T, 3) each."""
    out: list[Array] = []
    size, count = (0.8, COUNT) if machine.kind == "shaft" else (0.2, 1.0e-5)
    for _ in range(RUNS):
        t = np.arange(ROWS) / RATE
        swings = np.random.default_rng(rng.integers(1 << 32))
        state = swings.bit_generator.state
        q, _, _ = motion(t, swings, size)
        swings.bit_generator.state = state
        asked = machine.torque(t - machine.late, *motion(t - machine.late, swings, size))
        read = asked + machine.noise * rng.standard_normal(ROWS)
        out.append(np.column_stack([t, count * np.round(q / count), read]))
    return out


def regressed(machine: Machine, logs: Sequence[Array]) -> dict[Number, float]:
    """Return what least squares find of the runs that are fitted."""
    tables, reads = [], []
    for log in logs:
        t, q, read = log.T
        v, a = (
            np.asarray(savgol_filter(q, WINDOW, 3, deriv=k, delta=1.0 / RATE), dtype=np.float64)
            for k in (1, 2)
        )
        then = np.interp(t + machine.late, t, read)
        tables.append(np.column_stack(machine.columns(t, q, v, a))[WINDOW:-WINDOW])
        reads.append(then[WINDOW:-WINDOW])
    found = np.linalg.lstsq(np.concatenate(tables), np.concatenate(reads), rcond=None)[0]
    return machine.named(found)


def diagnosed(machine: Machine, logs: Sequence[Array], folder: Path) -> dict[str, Any]:
    """Walk the whole way from CSV files to the answer."""
    csv, mapping = folder / "logs", folder / "mapping.toml"
    csv.mkdir(parents=True)
    for k, log in enumerate(logs):
        np.savetxt(csv / f"run_{k}.csv", log, "%.9g", ",", header=HEADER, comments="")
    new = ["asset", "new", "machine", "--kind", machine.kind, "--folder", str(folder)]
    stated = f"bench_overrides = {{length = {LENGTH}}}" if machine.kind == "shaft" else ""
    mapping.write_text(MAPPING.replace("{stated}", stated))
    os.environ["TENDON_NEWTON_ASSETS"] = str(folder)
    data, out = str(folder / "data"), folder / "found"
    for line in (
        [*new, "--mass", str(FIRST_MASS)],
        ["import", "mapped", str(csv), "--mapping", str(mapping), "--out", data],
        ["diagnose", data, "--out", str(out)],
    ):
        with redirect_stdout(StringIO()) as said:
            code = program(line)
        if code:
            raise SystemExit(f"{' '.join(line)}: {said.getvalue()}")
    return json.loads((out / "diagnosis.json").read_text())


def numbers_of(answer: dict[str, Any]) -> dict[Number, tuple[float, float, float]]:
    """Return an answer's numbers with their 95 % intervals."""
    found = {
        (e["name"], key): value for e in answer["effects"] for key, value in e["parameters"].items()
    }
    found |= {("fitted", key): value for key, value in answer.get("fitted", {}).items()}
    return {key: (value["value"], *value["ci95"]) for key, value in found.items()}


def main() -> None:
    """Print a table of planted, found and regressed numbers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("machines", nargs="*", default=[*MACHINES], help=", ".join(MACHINES))
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="of motions and noise")
    arguments = parser.parse_args()
    held: list[bool] = []
    for name in arguments.machines:
        for seed in arguments.seeds:
            held += examined(name, seed)
    print(f"{sum(held)} of {len(held)} planted numbers are named and inside their intervals")


def examined(name: str, seed: int) -> list[bool]:
    """Print the table of one machine, and return which planted numbers their intervals hold."""
    machine, held = MACHINES[name], list[bool]()
    logs = logs_of(machine, np.random.default_rng([seed, *name.encode()]))
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        answer = diagnosed(machine, logs, Path(folder))
    print(f"{name}, seed {seed}: {answer['verdict']}, {time.monotonic() - began:.0f} s")
    found, least = numbers_of(answer), regressed(machine, logs[:-1])
    for key in dict.fromkeys([*machine.truth, *found]):
        planted, (value, low, high) = machine.truth.get(key), found.get(key, (np.nan,) * 3)
        if planted is not None:
            held.append(low <= planted <= high)
        print(
            f"  {' '.join(key):38s} {planted or np.nan:8.4f}  least squares "
            f"{least.get(key, np.nan):8.4f}  found {value:8.4f} [{low:.4f}, {high:.4f}]"
        )
    return held


if __name__ == "__main__":
    main()
