"""Sound settings and answers to spoil, and how they are read."""

import json
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomli_w

from tendon_hardware.control.goals import read_goals
from tendon_hardware.load_cells.calibration import load_calibration, write_calibration
from tendon_lab.exam.truth_file import read_truth
from tendon_newton.arms.arm_file import read_arm
from tendon_newton.data.cards.force_network_card import ForceNetworkCard
from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.diagnosis.next_experiment.open_sets_file import read_open_sets
from tendon_newton.diagnosis.posterior import write_posterior
from tests.bad_input.test_bad_input_exams import ANSWER, OPEN, SETS, TRUTH
from tests.fuzz.mutations import table_changer
from tests.hardware.deploy.policies import card_of
from tests.hardware.load_cells.test_calibration import fit, points
from tests.train.actuator.network_files import card_of as force_card_of

__all__ = ["ANSWER", "OPEN", "TRUTH"]
MODEL: dict[str, Any] = {
    "bench_overrides": {"finger": {"mass": [0.012, 0.008]}},
    "fit": ["gain"],
    "actuator": {"kind": "ideal", "gain": 4.2, "spool_radius": 0.0125},
    "effects": [
        {"name": "viscous_friction", "coefficient": 1.5},
        {"name": "stribeck_friction", "coulomb_force": 1.0, "static_force": 2.0},
    ],
}
ARM: dict[str, Any] = {
    "schema": 1,
    "asset": "servo",
    "joints": {"shaft": {"sign": -1, "zero": 0.05, "diagnosed": True}},
    "tilt": [0.01, -0.02],
    "floor": -0.03,
}


def arm_folder(folder: Path) -> Path:
    """Write an identified arm of one servo."""
    servo = {"actuator": {"kind": "ideal_position", "compliance": 0.08}}
    (folder / "shaft").mkdir()
    (folder / "shaft" / "model.toml").write_text(tomli_w.dumps(servo))
    (folder / "arm.json").write_text(json.dumps(ARM))
    return folder / "arm.json"


def read_sound_arm(path: Path) -> None:
    """Every number that comes through is finite, and a servo counts one way or the other."""
    arm = read_arm(path).arm
    assert np.all(np.isfinite([*arm.zero, *arm.gravity, arm.floor or 0.0]))
    assert np.abs(arm.sign).tolist() == [1.0]


def model_file(folder: Path) -> Path:
    """Write a model."""
    (folder / "model.toml").write_text(tomli_w.dumps(MODEL))
    return folder / "model.toml"


def read_model(path: Path) -> None:
    """What is read can be written and read again, equal."""
    model = load_model(path)
    write_model(path.with_name("again.toml"), model)
    assert load_model(path.with_name("again.toml")) == model


def read_finite_diagnosis(path: Path) -> None:
    """Every number that comes through is finite."""
    made = read_diagnosis(path)
    numbers = [p.value for cause in made.effects for p in cause.parameters.values()]
    assert np.all(np.isfinite([made.wall_time_s, *numbers]))


def read_truth_file(path: Path) -> None:
    """Read what is hidden in a dataset of an exam."""
    read_truth(path)


def open_folder(folder: Path) -> Path:
    """Write a diagnosis that leaves two sets open, with its model."""
    model_file(folder)
    (folder / "diagnosis.json").write_text(json.dumps(OPEN))
    write_posterior(folder / "diagnosis.json", SETS)
    return folder / "diagnosis.json"


def read_left_open(path: Path) -> None:
    """Read the sets that a diagnosis left open."""
    read_open_sets(path.parent)


def calibration_file(folder: Path) -> Path:
    """Write a calibration."""
    write_calibration(folder / "cell.toml", fit(points()))
    return folder / "cell.toml"


def read_calibration(path: Path) -> None:
    """Read a calibration; one that passes is the one that was written."""
    assert load_calibration(path).identifier == fit(points()).identifier


def read_goal_file(path: Path) -> None:
    """Read goals, which are numbers at all times."""
    goals = read_goals(path)
    assert all(np.isfinite(goals.value(instant)) for instant in (0.0, 1.0, 1e9))


def policy_card_file(folder: Path) -> Path:
    """Write a policy's card."""
    (folder / "card.json").write_text(card_of().to_json())
    return folder / "card.json"


def change_policy_card(content: bytes, rng: Random) -> bytes:
    """Change a value of the card, or its text."""
    return table_changer(json.loads(card_of().to_json()), json.dumps)(content, rng)


def read_policy_card(path: Path) -> None:
    """A card that passes keeps every promise."""
    card = PolicyCard.from_json(path.read_text(errors="replace"))
    assert PolicyCard.from_json(card.to_json()) == card


def force_card_file(folder: Path) -> Path:
    """Write a force network's card."""
    (folder / "card.json").write_text(force_card_of().to_json())
    return folder / "card.json"


def change_force_card(content: bytes, rng: Random) -> bytes:
    """Change a value of the card, or its text."""
    return table_changer(json.loads(force_card_of().to_json()), json.dumps)(content, rng)


def read_force_card(path: Path) -> None:
    """A card that passes can be written and read again."""
    card = ForceNetworkCard.from_json(path.read_text(errors="replace"))
    ForceNetworkCard.from_json(card.to_json())
