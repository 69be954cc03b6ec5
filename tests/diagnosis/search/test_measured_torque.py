"""Angle and torque of an arm without a command: its numbers are those of a linear regression."""

from pathlib import Path

import numpy as np

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.reporting.report import write_report
from tests.made import recorded, stated_model

START = stated_model(
    "measured_path", fit=("mass",), bench_overrides={"pendulum": BenchOverrides(mass=(4.0,))}
)
MASS, LENGTH, INERTIA = 2.3, 0.4, 0.58  # kg, m, kg m2: a rotor is more than half of m l2
DRY, VISCOUS, DRIFT = 1.1, 0.55, 0.05  # N m, N m s/rad, N m/s
NOISE, COUNT = 0.12, 2.0 * np.pi / 16384.0  # N m, rad


def asked(t: Array, q: Array, v: Array, a: Array) -> Array:
    """What an arm that hangs at 0 asks of its motor [N m], part by part, shape (T, 6)."""
    one = np.ones_like(t)
    return np.column_stack([9.81 * LENGTH * np.sin(q), a, np.sign(v), v, one, t])


def run(rng: np.random.Generator) -> tuple[Recording, Array]:
    """Twelve seconds of two slow swings, and the parts of their torque."""
    t = np.arange(1200) / 100.0
    w, phase = 2.0 * np.pi * rng.uniform(0.1, 0.9, (2, 1)), rng.uniform(0.0, 6.0, (2, 1))
    q, v, a = (
        0.9 * np.sum(w**k * np.sin(w * t + phase + k * np.pi / 2.0), axis=0) for k in range(3)
    )
    parts = asked(t, q, v, a)
    torque = parts @ (MASS, INERTIA, DRY, VISCOUS, 0.0, DRIFT) + NOISE * rng.standard_normal(1200)
    angle = COUNT * np.round(q / COUNT)
    columns = {"force": torque, "joint_load": np.zeros_like(t)}
    numbers = BenchOverrides(length=(LENGTH,))
    return recorded(t, angle, bench="pendulum", **columns, bench_overrides=numbers), parts


def test_an_arm_without_commands_tells_what_a_regression_tells(rng, tmp_path) -> None:
    """Frictions, inertia and drift are named, and nothing else, with a regression's intervals.

    The regression knows the true motion. Its intervals are 1.96 deviations; a diagnosis's at most
    four times as wide, since three recordings know their own scatter badly, and hold the truth.
    """
    runs = [run(rng) for _ in range(4)]
    train, test = [r for r, _ in runs[:3]], [r for r, _ in runs[3:]]
    found, evidence = diagnose(Dataset(path=Path(), train=tuple(train), test=tuple(test)), START)
    table = np.concatenate([parts for _, parts in runs[:3]])
    least = 1.96 * NOISE * np.sqrt(np.diag(np.linalg.inv(table.T @ table)))
    numbers = {e.name: x for e in found.effects for x in e.parameters.values()}
    numbers |= {"mass": found.fitted["mass"]}
    weight = MASS * LENGTH**2
    truth = {
        "mass": (MASS, least[0]),
        "inertia_error": (
            INERTIA / weight,
            np.hypot(least[1] / weight, INERTIA / weight / MASS * least[0]),
        ),
        "coulomb_friction": (DRY, least[2]),
        "viscous_friction": (VISCOUS, least[3]),
        "load_cell_drift": (DRIFT, least[5]),
    }
    assert set(numbers) == set(truth)
    for name, (value, half) in truth.items():
        low, high = numbers[name].ci95
        assert low <= value <= high, name
        assert high - low < 8.0 * half, name
    write_report(tmp_path / "report.html", found, evidence)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert " mrad" not in page  # an angle that was given has no error, and the arm no other motion
    assert "As the finger moves" not in page
    assert "mrad" not in found.change
