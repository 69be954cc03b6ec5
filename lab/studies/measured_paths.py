"""Machines of a stranger that logged torque: ``python -m lab.studies.measured_paths OUT``.

Each machine is a law of its own here, with numbers drawn anew each time, and shares no code with
the package. Its log is a CSV file without a command. The whole way is walked: `import mapped`,
`diagnose`. ``OUT/measured_paths.json`` has each number that is found beside what was planted and
what least squares by numpy find, given the right law, the true delay and Stribeck speed. What is
finished there is not done again.
"""

import argparse
import json
import os
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import savgol_filter
from scipy.stats import binomtest

from tendon_newton.cli import main as program
from tendon_newton.data.recording import Array

RATE = 100.0  # Rows per second
RUNS, ROWS = 4, 1500
COUNT = 2.0 * np.pi / 16384.0  # Of the encoder [rad]; of the axis 10 um
GRAVITY = 9.81  # [m/s2]
WINDOW = 11  # Rows of the cubics by which least squares get their rates
DRAWING = (0.5, 2.0)  # What the drawing says of a mass, which is fitted, by its true one [1]

HEADER = "time,place,motor"
MAPPING = """bench = "machine"
fit = ["mass"]
{stated}
[columns]
t = {column = "time"}
theta = {column = "place"}
theta_dot = {derive = "theta"}
force = {column = "motor", scale = {scale}}

[model]
kind = "measured_path"
"""

MASS, INERTIA = "fitted mass", "inertia_error scale"
COULOMB, VISCOUS = "coulomb_friction force", "viscous_friction coefficient"
SLIDING, STATIC, SPEED = (
    f"stribeck_friction {number}"
    for number in ("coulomb_force", "static_force", "stribeck_velocity")
)
BIAS, DRIFT = "load_cell_bias offset", "load_cell_drift rate"
DELAY = "load_cell_delay delay"
Numbers = Mapping[str, float]
"""Numbers [SI] by effect and parameter, those of the bench by "fitted" and theirs."""


@dataclass(frozen=True, kw_only=True)
class Machine:
    """One machine: the ranges of its numbers, and how it is logged."""

    ranges: Mapping[str, tuple[float, float]]
    kind: str = "shaft"  # `asset new --kind`
    noise: float = 0.12  # Of the torque [N m] or force [N]
    by_current: bool = False  # Whether it logs amperes

    def drawn(self, rng: np.random.Generator) -> dict[str, float]:
        """Return the true numbers of one draw."""
        out = {name: float(rng.uniform(*ends)) for name, ends in self.ranges.items()}
        if STATIC in out:  # drawn as what it is above the sliding force
            out[STATIC] += out[SLIDING]
        return out


ARM = {MASS: (1.0, 4.0), INERTIA: (1.2, 2.5), VISCOUS: (0.2, 1.0)}
DRY_ARM = {**ARM, COULOMB: (0.5, 2.0)}
MACHINES = {
    "gravity": Machine(ranges=DRY_ARM),
    "drift": Machine(ranges={**DRY_ARM, BIAS: (0.3, 1.0), DRIFT: (-0.08, -0.02)}),
    "delayed current": Machine(ranges={**DRY_ARM, DELAY: (0.012, 0.04)}, by_current=True),
    "stribeck": Machine(
        ranges={**ARM, SLIDING: (0.5, 1.5), STATIC: (0.5, 1.2), SPEED: (0.15, 0.5)}
    ),
    "linear axis": Machine(
        ranges={MASS: (5.0, 20.0), COULOMB: (4.0, 15.0), VISCOUS: (15.0, 50.0)},
        kind="slider",
        noise=0.8,
    ),
}


def terms(
    machine: Machine, truth: Numbers, length: float, t: Array, motion: Sequence[Array]
) -> dict[str, Array]:
    """Return what each number of a law is multiplied with, shape (T,) each.

    Inertia counts as a whole [kg m2], dry friction as what slides and what is lost with speed.
    """
    q, v, a = motion
    weight = GRAVITY * length * np.sin(q)
    out = {MASS: weight, INERTIA: a} if machine.kind == "shaft" else {MASS: a}
    out |= {VISCOUS: v, SLIDING if SLIDING in truth else COULOMB: np.sign(v)}
    if STATIC in truth:
        out[STATIC] = np.exp(-((v / truth[SPEED]) ** 2)) * np.sign(v)
    if DRIFT in truth:
        out |= {BIAS: np.ones_like(t), DRIFT: t}
    return out


def factors(truth: Numbers, length: float) -> dict[str, float]:
    """Return what the terms of a law are multiplied with."""
    out = {**truth}
    if INERTIA in out:
        out[INERTIA] *= out[MASS] * length**2
    if STATIC in out:
        out[STATIC] -= out[SLIDING]
    return out


def numbers(found: Numbers, length: float) -> dict[str, float]:
    """Return the numbers of a law by what its terms are multiplied with."""
    out = {**found}
    if INERTIA in out:
        out[INERTIA] /= out[MASS] * length**2
    if STATIC in out:
        out[STATIC] += out[SLIDING]
    return out


def moved(t: Array, rng: np.random.Generator, size: float) -> list[Array]:
    """Return place, rate and acceleration of a sum of slow swings, shape (T,) each."""
    q, v, a = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    for frequency in rng.uniform(0.08, 0.9, 4):
        w, phase = 2.0 * np.pi * frequency, rng.uniform(0.0, 2.0 * np.pi)
        height = size * rng.uniform(0.5, 1.0) * min(1.0, 0.35 / frequency)
        q += height * np.sin(w * t + phase)
        v += height * w * np.cos(w * t + phase)
        a -= height * w**2 * np.sin(w * t + phase)
    return [q, v, a]


def logs_of(
    machine: Machine, truth: Numbers, length: float, rng: np.random.Generator
) -> list[Array]:
    """Return what the machine logs, columns time, place and torque, shape (T, 3) each."""
    out, t = list[Array](), np.arange(ROWS) / RATE
    size, count = (0.8, COUNT) if machine.kind == "shaft" else (0.2, 1.0e-5)
    then, factor = t - truth.get(DELAY, 0.0), factors(truth, length)
    for _ in range(RUNS):
        seed = rng.integers(1 << 32)
        q, earlier = (moved(at, np.random.default_rng(seed), size) for at in (t, then))
        law = terms(machine, truth, length, then, earlier)
        asked = np.sum([factor[name] * term for name, term in law.items()], axis=0)
        read = asked + machine.noise * rng.standard_normal(ROWS)
        out.append(np.column_stack([t, count * np.round(q[0] / count), read]))
    return out


def regressed(
    machine: Machine, truth: Numbers, length: float, logs: Sequence[Array]
) -> dict[str, float]:
    """Return what least squares find of the runs that are fitted."""
    tables, reads, inner = list[dict[str, Array]](), list[Array](), slice(WINDOW, -WINDOW)
    for log in logs:
        t, q, read = log.T
        v, a = (
            np.asarray(savgol_filter(q, WINDOW, 3, deriv=k, delta=1.0 / RATE), dtype=np.float64)
            for k in (1, 2)
        )
        tables.append(terms(machine, truth, length, t, [q, v, a]))
        reads.append(np.interp(t + truth.get(DELAY, 0.0), t, read)[inner])
    columns = np.concatenate([np.column_stack([*table.values()])[inner] for table in tables])
    found = np.linalg.lstsq(columns, np.concatenate(reads), rcond=None)[0]
    return numbers({name: float(x) for name, x in zip(tables[0], found, strict=True)}, length)


def diagnosed(
    machine: Machine, length: float, mass: float, scale: float, logs: Sequence[Array], folder: Path
) -> dict[str, Any]:
    """Walk the whole way from CSV files to the answer.

    Args:
        machine: Says what it is.
        length: Of the arm [m].
        mass: What the drawing says [kg].
        scale: Torque per ampere [N m/A], or 1.
        logs: Columns time, place and torque, shape (T, 3) each.
        folder: Empty.
    """
    csv, mapping = folder / "logs", folder / "mapping.toml"
    csv.mkdir(parents=True)
    for k, log in enumerate(logs):
        rows = log / (1.0, 1.0, scale)
        np.savetxt(csv / f"run_{k}.csv", rows, "%.9g", ",", header=HEADER, comments="")
    new = ["asset", "new", "machine", "--kind", machine.kind, "--folder", str(folder)]
    stated = f"bench_overrides = {{length = {length}}}" if machine.kind == "shaft" else ""
    mapping.write_text(MAPPING.replace("{stated}", stated).replace("{scale}", str(scale)))
    os.environ["TENDON_NEWTON_ASSETS"] = str(folder)
    data, out = str(folder / "data"), folder / "found"
    for line in (
        [*new, "--mass", str(mass)],
        ["import", "mapped", str(csv), "--mapping", str(mapping), "--out", data],
        ["diagnose", data, "--out", str(out)],
    ):
        with redirect_stdout(StringIO()) as said:
            code = program(line)
        if code:
            raise SystemExit(f"{' '.join(line)}: {said.getvalue()}")
    return json.loads((out / "diagnosis.json").read_text())


def examined(name: str, draw: int) -> dict[str, Any]:
    """Draw a machine, diagnose it, and return what was planted beside what was found."""
    machine, rng = MACHINES[name], np.random.default_rng([draw, *name.encode()])
    truth, length = machine.drawn(rng), round(float(rng.uniform(0.25, 0.6)), 3)
    mass = round(truth[MASS] * float(np.exp(rng.uniform(*np.log(DRAWING)))), 3)
    scale = round(float(rng.uniform(3.0, 15.0)), 2) if machine.by_current else 1.0
    logs = logs_of(machine, truth, length, rng)
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        answer = diagnosed(machine, length, mass, scale, logs, Path(folder))
    found = {
        f"{e['name']} {key}": value
        for e in answer["effects"]
        for key, value in e["parameters"].items()
    }
    found |= {f"fitted {key}": value for key, value in answer.get("fitted", {}).items()}
    return {
        "planted": truth,
        "found": {key: [value["value"], *value["ci95"]] for key, value in found.items()},
        "classes": {e["name"]: e["indistinguishable_from"] for e in answer["effects"]},
        "regressed": regressed(machine, truth, length, logs[:-1]),
        "verdict": answer["verdict"],
        "cpu_s": round(time.process_time() - began, 1),
    }


def counted(answers: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Count what some answers have right and wrong."""
    causes = [{key.split()[0] for key in one["planted"]} - {"fitted"} for one in answers]
    named = [set(one["classes"]) for one in answers]
    read = [
        (true, *one["found"][key][1:])
        for one in answers for key, true in one["planted"].items() if key in one["found"]
    ]  # fmt: skip
    late = {"load_cell_delay", "load_cell_lag"}
    return {
        "sets": len(answers),
        "causes": sum(map(len, causes)),
        "named": sum(len(own & of) for own, of in zip(causes, named, strict=True)),
        "wrong names": sum(len(of - own) for own, of in zip(causes, named, strict=True)),
        "open classes": sum(map(bool, (r for one in answers for r in one["classes"].values()))),
        "drift unasked": sum(
            "load_cell_drift" in of - own for own, of in zip(causes, named, strict=True)
        ),
        "delay unasked": sum(bool(late & of - own) for own, of in zip(causes, named, strict=True)),
        "numbers": len(read),
        "inside": sum(low <= true <= high for true, low, high in read),
    }


def told(answers: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a table of counts, a row for each machine and one for all."""
    groups = {name: [one for key, one in answers.items() if key.rsplit(" ", 1)[0] == name]
              for name in MACHINES} | {"all": [*answers.values()]}  # fmt: skip
    rows = {name: counted(own) for name, own in groups.items() if own}
    lines = ["".join(f"{word:>16s}" for word in ("", *rows["all"]))]
    lines += ["".join(f"{x:>16}" for x in (name, *row.values())) for name, row in rows.items()]
    inside = binomtest(rows["all"]["inside"], rows["all"]["numbers"])
    ends = inside.proportion_ci(method="wilson")
    return "\n".join([*lines, f"inside: {inside.statistic:.1%} [{ends.low:.1%}, {ends.high:.1%}]"])


def main() -> None:
    """Draw, diagnose, and print the table of counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--machines", nargs="+", default=[*MACHINES], choices=[*MACHINES])
    parser.add_argument("--draws", type=int, nargs="+", default=[*range(8)])
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    path = asked.out / "measured_paths.json"
    answers: dict[str, Any] = json.loads(path.read_text()) if path.is_file() else {}
    for draw in asked.draws:
        for name in asked.machines:
            if (key := f"{name} {draw}") not in answers:
                answers[key] = examined(name, draw)
                path.write_text(json.dumps(answers, indent=1) + "\n")
                print(f"{key}: {counted([answers[key]])}", flush=True)
    print(told(answers))


if __name__ == "__main__":
    main()
