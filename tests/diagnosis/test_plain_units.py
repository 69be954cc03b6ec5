"""Machines of other sizes in plain SI units: a cart of tens of kilograms, a shaft of 0.5 N m.

Both are integrated here, by a loop that shares nothing with the simulator.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.cli.diagnosis.diagnose import summary
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues, load_model, write_model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.diagnose import Evidence, diagnose
from tendon_newton.diagnosis.reporting.report import Origin, write_report
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.simulation.hosts.replay import replay
from tests.made import recorded, stated_model

pytestmark = pytest.mark.slow

ROW, STEP = 0.01, 1.0e-4  # [s]
MASS, VISCOUS, DRY = 95.0, 240.0, 20.0  # [kg], [N s/m], [N] of the cart
START = 0.3  # [m] where it begins
SHAFT = 1.0  # [m] so that an angle of one radian is a travel of one metre
LOAD, ARM, GRAVITY = 0.49, 0.10, 9.81  # [kg], [m], [m/s2] of the shaft
SERVO = 4.0  # [N m/rad]
SHAFT_VISCOUS, SHAFT_DRY = 0.05, 0.008  # [N m s/rad], [N m]

Drive = Callable[[float, float, float], float]  # Time [s], position and speed -> force
Found = tuple[Diagnosis, Evidence]


def integrated(
    drive: Drive,
    weight: Callable[[float], float],
    inertia: float,
    viscous: float,
    dry: float,
    rows: int,
    start: float = 0.0,
    *,
    held: bool = False,
) -> Array:
    """Return position, speed, the drive's force and what friction leaves of it, row by row.

    Friction lies between drive and load and sticks exactly. A held drive changes once a row.
    """
    x, v, force, every = start, 0.0, 0.0, round(ROW / STEP)
    log = np.zeros((rows, 4))
    for k in range(rows * every):
        new_row = k % every == 0
        if new_row or not held:
            force = drive(STEP * k, x, v)
        push = force - weight(x) - viscous * v
        sign = np.sign(v) if v != 0.0 else np.sign(push)
        free = v + STEP * (push - dry * sign) / inertia
        stuck = (v == 0.0 and abs(push) < dry) or free * v < 0.0
        if new_row:
            left = weight(x) if stuck else force - viscous * v - dry * sign
            log[k // every] = x, v, force, left
        v = 0.0 if stuck else free
        x += STEP * v
    return log


def cart(seed: int) -> Recording:
    """A cart under a position loop: 0.4 m of rail, forces of 150 N, read to 10 um and 0.5 N."""
    rng = np.random.default_rng(seed)
    waves = [(rng.uniform(0.1, 0.5), rng.uniform(0.0, 6.28)) for _ in range(3)]

    def loop(t: float, x: float, v: float) -> float:
        waved = sum(0.05 * (np.sin(6.28 * f * t + at) - np.sin(at)) for f, at in waves)
        goal = START + 0.2 * (1.0 - np.exp(-t)) + waved
        return 9000.0 * (goal - x) - 900.0 * v

    log = integrated(loop, lambda x: 0.0, MASS, VISCOUS, DRY, rows=800, start=START, held=True)
    numbers = {"mass": (MASS,), "stiffness": (0.0,), "damping": (0.0,), "range": (2.0,)}
    return recorded(
        ROW * np.arange(len(log)),
        1e-5 * np.round(log[:, 0] / SHAFT / 1e-5),
        name=f"cart_{seed}",
        bench="spring_weak",
        motor_velocity=log[:, 1] / SHAFT,
        force=log[:, 2] + 0.5 * rng.standard_normal(len(log)),
        start="first_row",
        bench_overrides=BenchOverrides(**numbers),
    )


def shaft(seed: int) -> Recording:
    """An arm on a servo's shaft: torques of 0.5 N m, read to a count of 4096 and 0.5 mN m."""
    rng = np.random.default_rng(seed)
    waves = rng.uniform((0.1, 0.4), (0.3, 0.8))

    def command(t: float) -> float:
        return float(0.8 * np.sin(6.28 * waves[0] * t) + 0.3 * np.sin(6.28 * waves[1] * t))

    def weight(q: float) -> float:
        return LOAD * GRAVITY * ARM * np.sin(q)

    log = integrated(
        lambda t, q, _: SERVO * (command(ROW * int(t / ROW + 1e-6)) - q),
        weight,
        LOAD * ARM**2,
        SHAFT_VISCOUS,
        SHAFT_DRY,
        rows=800,
    )
    count = 2.0 * np.pi / 4096.0
    time = ROW * np.arange(len(log))
    return recorded(
        time,
        count * np.round(log[:, 0] / count),
        name=f"shaft_{seed}",
        bench="pendulum",
        command=np.array([command(t) for t in time]),
        motor_velocity=log[:, 1],
        force=log[:, 3] + 5e-4 * rng.standard_normal(len(log)),
        start="first_row",
        bench_overrides=BenchOverrides(mass=(LOAD,), length=(ARM,)),
    )


def ideal(gain: float, **more: float) -> Model:
    """What a user writes down of a drive."""
    return stated_model("ideal", {"gain": gain, **more})


@pytest.fixture(scope="module")
def of_cart() -> Found:
    """The diagnosis of two recordings of the cart without commands, tested on a third."""
    dataset = Dataset(path=Path(), train=(cart(1), cart(2)), test=(cart(3),))
    return diagnose(dataset, ideal(100.0, spool_radius=SHAFT))


@pytest.fixture(scope="module")
def of_shaft() -> Found:
    """The diagnosis of three recordings of the shaft, tested on a fourth; grease is known."""
    dataset = Dataset(path=Path(), train=(shaft(1), shaft(2), shaft(3)), test=(shaft(4),))
    grease = NamedValues(name="viscous_friction", values={"coefficient": SHAFT_VISCOUS})
    return diagnose(dataset, replace(ideal(SERVO), effects=(grease,)))


def page_of(found: Found, folder: Path) -> str:
    """Return the report as HTML."""
    write_report(folder / "report.html", *found, Origin())
    return (folder / "report.html").read_text(encoding="utf-8")


def numbers_of(diagnosis: Diagnosis) -> dict[str, tuple[float, str]]:
    """Return the first number of each named cause, with its unit."""
    firsts = {e.name: next(iter(e.parameters.values())) for e in diagnosis.effects}
    return {name: (estimate.value, estimate.unit) for name, estimate in firsts.items()}


def test_a_cart_of_tens_of_kilograms_is_diagnosed(of_cart: Found) -> None:
    """20 N and 240 N s/m of friction, each within 5 %, and nothing else."""
    diagnosis, _ = of_cart
    found = numbers_of(diagnosis)
    assert set(found) == {"viscous_friction", "coulomb_friction"}
    assert found["viscous_friction"] == (pytest.approx(VISCOUS, rel=0.05), "N s/rad")
    assert found["coulomb_friction"] == (pytest.approx(DRY, rel=0.05), "N")
    assert diagnosis.verdict == "explained"
    assert diagnosis.extended.theta_rmse < 0.01 * diagnosis.baseline.theta_rmse


def test_what_was_found_of_a_cart_is_a_model_that_can_be_used(of_cart, tmp_path) -> None:
    """The extended model is written, read and simulated (1 mm: noise of the force that drives)."""
    diagnosis, _ = of_cart
    write_model(tmp_path / "model.toml", diagnosis.model)
    test = cart(3)
    (out,) = replay([test], load_model(tmp_path / "model.toml"))
    assert np.abs(out.motor_position - test.motor_position).max() < 3e-3


def test_a_candidate_at_its_bound_is_said_to_be(of_cart: Found, tmp_path: Path) -> None:
    """In the file, in the table and in a sentence, with what it would explain."""
    diagnosis, _ = of_cart
    entries: list[dict[str, Any]] = json.loads(json.dumps(diagnosis.to_json()))["candidates"]
    held = {entry["name"]: entry["at_bound"] for entry in entries if "at_bound" in entry}
    assert held["sample_period_error"] == ["scale"]
    assert not held.keys() & {"viscous_friction", "coulomb_friction"}
    score = next(entry["score"] for entry in entries if entry["name"] == "sample_period_error")
    sentence = (
        "sample_period_error is at its bound (scale = 0.8) and so cannot be named; "
        f"alone it removes {100.0 * score:.0f} % of the gap."
    )
    assert sentence in diagnosis.notes
    page = page_of(of_cart, tmp_path)
    assert "sample period error (at its bound)" in page
    assert sentence in page
    assert sentence in summary(diagnosis)


def test_a_shaft_is_diagnosed_in_newton_metres(of_shaft: Found, tmp_path: Path) -> None:
    """8 mN m of dry friction within 5 %; no unit of the report is that of a string."""
    diagnosis, _ = of_shaft
    found = numbers_of(diagnosis)
    assert found == {"coulomb_friction": (pytest.approx(SHAFT_DRY, rel=0.05), "N m")}
    page = page_of(of_shaft, tmp_path)
    assert "shaft torque" in page
    assert "tendon force" not in page
    assert "N m s/rad" in page
    assert "shaft torque, RMS" in summary(diagnosis)
