"""A cart on a rail and a mass on a shaft from a few numbers: they check, and move as they must."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.hosts.rollout import Trajectory
from tests.physics.runs import run_of

DRIVE = {"kp": 4000.0, "kd": 0.0, "max_torque": 50.0, "armature": 1e-8, "spool_radius": 1.0}


def made(folder: Path, *words: str) -> str:
    """Write a bench, let it be checked, and return the file to open."""
    assert main(["asset", "new", words[0], "--folder", str(folder), *words[1:]]) == 0
    path = folder / words[0] / f"{words[0]}.usda"
    assert main(["asset", "check", str(path)]) == 0
    return str(path)


def pushed(path: str, goal: float, rows: int, drive: dict[str, float]) -> Trajectory:
    """Ask a bench for a far goal from rest at 0, 1 ms a row."""
    name = Path(path).stem
    run = run_of(np.full(rows, goal), bench=name, rate=1000.0, start="first_row")
    model = Model(actuator=NamedValues(name="pd_torque", values=drive))
    rollout = rollout_of(load_mechanism(path), [run], model, time_step=2.5e-4)
    return rollout.run(rollout.base_vectors(model)[None])[0][0]


def test_a_cart_gains_force_over_mass(tmp_path: Path) -> None:
    """95 kg under 50 N move by F t^2 / (2 m), pushed either way; angles are metres."""
    path = made(tmp_path, "cart", "--kind", "slider", "--mass", "95", "--range", "2")
    for goal in (1.0, -1.0):
        out = pushed(path, goal, 400, DRIVE)
        expected = np.sign(goal) * 0.5 * 50.0 / 95.0 * out.time**2
        np.testing.assert_allclose(out.motor_position[:, 0], expected, atol=1e-6)


def test_a_cart_stops_at_the_ends_of_its_rail(tmp_path: Path) -> None:
    """Under its drive's full force it enters a stop by a thousandth of its range."""
    path = made(
        tmp_path, "cart", "--kind", "slider", "--mass", "5", "--range", "0.2", "--force-limit", "50"
    )
    out = pushed(path, 1.0, 2000, DRIVE)
    assert out.motor_position[-1, 0] == pytest.approx(0.1 + 1e-3 * 0.2, rel=1e-4)


def test_a_shaft_holds_its_weight(tmp_path: Path) -> None:
    """k_p (theta_d - theta) = m g l sin theta with the numbers that were given."""
    numbers = ("--mass", "0.969", "--length", "0.15", "--damping", "0.2")
    path = made(tmp_path, "arm", "--kind", "shaft", *numbers)
    drive = {**DRIVE, "kp": 5.0, "kd": 0.3}
    out = pushed(path, 1.0, 4000, drive)
    theta = out.motor_position[-1, 0]
    assert 5.0 * (1.0 - theta) == pytest.approx(0.969 * 9.81 * 0.15 * np.sin(theta), rel=1e-4)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--kind", "slider", "--mass", "0"), "mass of a slider must lie in"),
        (("--kind", "shaft", "--mass", "1", "2"), "mass of a shaft is one number; there are 2"),
        (("--kind", "shaft", "--moment-arm", "0.01"), "moment_arm belongs to a finger"),
    ],
)
def test_numbers_of_no_such_bench_are_refused(
    words: tuple[str, ...], said: str, tmp_path: Path, capsys
) -> None:
    """One line says what was expected."""
    assert main(["asset", "new", "bench", "--folder", str(tmp_path), *words]) == 2
    assert said in capsys.readouterr().err
