"""The plant and another one, written by others, mean the same by each effect.

Under the commands and with the parameters of their recordings it meets their encoder and load cell.
Recordings of another plant are no part of the project; without them these tests are skipped.
"""

import json
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.planted.bench import BENCHES
from tests.planted.causes import Causes
from tests.planted.plant import Motion, Run, simulate

Array = NDArray[np.float64]

CHALLENGES = Path(
    os.environ.get("TENDON_NEWTON_CHALLENGES", Path(__file__).parents[3] / "shared" / "challenges")
)
ROW_RATE = 80.0  # [Hz]

# case: greatest RMS difference of angle [mrad] and force [N]. Encoder and cell alone leave
# 0.45 mrad and 0.05 N. What is above comes from form: bristles stick elsewhere than Coulomb's
# law, and the other plant's saturation, speed limit, contact and tendon are softer or damped.
ALIKE = {
    "c002": (0.6, 0.06), "c003": (0.6, 0.06), "c004": (5.0, 0.06), "c005": (0.6, 0.06),
    "c006": (0.6, 0.06), "c009": (10.0, 0.15), "c010": (1.5, 0.06), "c012": (0.6, 0.06),
    "c013": (0.6, 0.06), "c014": (4.0, 0.06), "c015": (0.6, 0.06), "c016": (0.6, 0.06),
    "c017": (0.6, 0.06), "c018": (2.5, 0.12), "c019": (0.6, 0.06), "c020": (0.6, 0.06),
    "c022": (0.6, 0.06), "c023": (30.0, 0.2), "c024": (5.0, 0.06), "c025": (6.0, 0.06),
    "c026": (8.0, 0.5), "c027": (0.6, 0.06), "c028": (8.0, 0.3), "c029": (0.6, 0.06),
    "c030": (0.6, 0.06), "c032": (3.0, 0.06), "c033": (0.6, 0.06), "c034": (0.6, 0.06),
}  # fmt: skip
FIELDS = {
    "gain_error": {"scale": "gain_scale"},
    "gain_drift": {"rate": "gain_drift"},
    "actuator_lag": {"time_constant": "lag"},
    "deadband": {"width": "deadband"},
    "force_saturation": {"limit": "saturation"},
    "speed_limit": {"limit": "speed_limit"},
    "coulomb_friction": {"force": "coulomb"},
    "viscous_friction": {"coefficient": "viscous"},
    "load_dependent_friction": {"coefficient": "load"},
    "routing_friction": {"exponent": "routing"},
    "spool_radius_error": {"scale": "radius_scale"},
    "joint_damping_error": {"scale": "damping_scale"},
    "inertia_error": {"scale": "inertia_scale"},
    "joint_dry_friction": {"fraction": "joint_friction"},
    "spring_stiffening": {"beta": "stiffening"},
    "viscoelastic_spring": {"stiffness_ratio": "maxwell_ratio", "relaxation_time": "relaxation"},
    "obstruction": {"position": "obstruction_at", "stiffness": "obstruction"},
    "gravity_misalignment": {"angle": "tilt"},
    "load_cell_bias": {"offset": "cell_bias"},
    "load_cell_drift": {"rate": "cell_drift"},
    "load_cell_lag": {"time_constant": "cell_lag"},
    "load_cell_delay": {"delay": "cell_delay"},
    "periodic_cogging": {
        "amplitude": "cogging",
        "per_radian": "cogging_rate",
        "phase": "cogging_phase",
    },
    "command_quantisation": {"lsb": "command_step"},
}


def fields(name: str, values: dict[str, float]) -> dict[str, float]:
    """One cause of theirs in the plant's words."""
    if name == "tendon_compliance":
        return {"compliance": 1.0 / values["stiffness"]}
    if name == "stribeck_friction":
        coulomb = values["coulomb_force"]
        static, speed = values["static_force"] - coulomb, values["stribeck_velocity"]
        return {"coulomb": coulomb, "static": static, "stribeck_speed": speed}
    return {FIELDS[name][parameter]: value for parameter, value in values.items()}


def replay(case: str) -> list[tuple[Array, Motion]]:
    """Their rows, and the motion at those rows."""
    truth = json.loads((CHALLENGES / "truth" / f"{case}.json").read_text())
    hidden = [*truth["known_effects"], *truth["effects"], *truth["outside"]]
    changed = {}
    for cause in hidden:
        changed |= fields(cause["name"], cause["parameters"])
    entries = tomllib.loads((CHALLENGES / case / "dataset.toml").read_text())["recordings"]
    tables, runs = [], []
    for entry in entries:
        table = np.genfromtxt(CHALLENGES / case / entry["file"], delimiter=",", names=True)
        rows = np.arange(round(table["t"][-1] * ROW_RATE) + 1)
        given = np.searchsorted(np.round(table["t"] * ROW_RATE), rows, side="right") - 1
        causes = Causes(bristle=2e-6, **changed)
        bench, command = BENCHES[entry["bench"]], table["theta_d"][given]
        tables.append(table)
        runs.append(Run(bench=bench, causes=causes, time=rows / ROW_RATE, command=command))
    return list(zip(tables, simulate(runs), strict=True))


@pytest.mark.skipif(not (CHALLENGES / "truth").is_dir(), reason="no outside data here")
@pytest.mark.parametrize("case", ALIKE)
def test_another_plant_with_the_same_cause_moves_the_same(case: str) -> None:
    """RMS over all rows of all recordings."""
    force, theta, tip = [], [], []
    for table, motion in replay(case):
        rows = np.round(table["t"] * ROW_RATE).astype(int)
        theta.append(table["theta"] - motion.angle[rows])
        force.append(table["force"] - motion.cell[rows])
        if motion.tip is not None and "tip_z" in (table.dtype.names or ()):
            tip.append(table["tip_z"] - motion.tip[rows, 1])
    most_theta, most_force = ALIKE[case]
    assert 1e3 * np.sqrt(np.mean(np.concatenate(theta) ** 2)) < most_theta
    assert np.sqrt(np.mean(np.concatenate(force) ** 2)) < most_force
    if tip:
        assert np.sqrt(np.mean(np.concatenate(tip) ** 2)) < 0.22e-3 + 1e-5 * most_theta
