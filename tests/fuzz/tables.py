"""Sound settings and answers to spoil, and how they are read."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomli_w

from tendon_hardware.control.goals import read_goals
from tendon_hardware.load_cells.calibration import load_calibration, write_calibration
from tendon_newton.arms.arm import motions_of
from tendon_newton.arms.arm_file import read_arm
from tendon_newton.arms.placement import find_placement
from tendon_newton.data.cards.force_network_card import ForceNetworkCard
from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.diagnosis.diagnosed_bench import recorded_benches
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.diagnosis.in_time.changes_report import write_changes
from tendon_newton.diagnosis.known_servos import known_servos, told, write_servo
from tendon_newton.diagnosis.next_experiment.open_sets_file import read_open_sets
from tendon_newton.diagnosis.posterior import read_posterior, write_posterior
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.workflows.diagnosing import stated_day
from tendon_train.refresh.refresh_outcome import told_drift
from tests.arms.planted_arm import planted_mechanism, planted_motion
from tests.bad_input.test_bad_input_diagnoses import ANSWER, OPEN, SETS
from tests.diagnosis.in_time.test_changes_report import SLACK, STRETCHY, day
from tests.fuzz.mutations import table_changer
from tests.hardware.deploy.policies import card_of
from tests.hardware.load_cells.test_calibration import fit, points
from tests.train.actuator.network_files import card_of as force_card_of
from tests.train.policy.test_randomisation import open_number, write_sets

__all__ = ["ANSWER", "OPEN"]
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


def posterior_folder(folder: Path) -> Path:
    """Write a diagnosis, and beside it what it leaves open, which is spoilt."""
    slack, gain = open_number("tendon_slack", "length", 1e-3, 3e-3), open_number("a", "b", 1.0, 2.0)
    write_sets(folder / "diagnosis.json", (0.7, {slack: 1e-4, gain: 0.1}), (0.3, {gain: 0.2}))
    return folder / "diagnosis.posterior.json"


def draw_worlds(path: Path) -> None:
    """Worlds of `train-policy --randomise` have numbers, infinite ones where a cause is absent."""
    drawn = read_posterior(path.with_name("diagnosis.json"))
    if drawn.sets:
        assert not any(np.isnan(values).any() for values in drawn.sample(16, 0).values())


def servo_folder(folder: Path) -> Path:
    """Copy a servo that ships, whose evidence is spoilt."""
    for file in next(iter(known_servos().values())).iterdir():
        shutil.copyfile(file, folder / file.name)
    return folder / "evidence.json"


def read_servo(path: Path) -> None:
    """Tell what a servo's evidence says, and write the servo with another gain."""
    told(path.parent)
    out = path.parent / "own"
    out.mkdir(exist_ok=True)
    write_servo(path.parent, out, gain=100.0, supply=None)
    assert np.isfinite(load_model(out / "model.toml").actuator.values["duty_per_rad"])


def earlier_folder(folder: Path) -> Path:
    """Write the diagnosis of an earlier day, and its model."""
    open_folder(folder)
    return folder / "diagnosis.json"


def read_earlier(path: Path) -> None:
    """Read what `diagnose --against` and `doctor --against` know of the earlier day."""
    day = stated_day(path.parent, load_model(path.with_name("model.toml")))
    recorded_benches(path.parent)
    assert all(np.isfinite(n.value) for own in day.estimates.values() for n in own.values())


def changes_file(folder: Path) -> Path:
    """Write what changed since a day."""
    write_changes(folder, {"monday": day(SLACK, STRETCHY)}, "sunday")
    return folder / "changes.json"


def change_json_text(content: bytes, rng: Random) -> bytes:
    """Change a value of a JSON file, or its text."""
    return table_changer(json.loads(content), json.dumps)(content, rng)


def read_changes(path: Path) -> None:
    """Read what a refresh takes over."""
    told_drift(path.parent)


def arm_motions(folder: Path) -> Path:
    """Write an arm and a log of each joint; that of one is spoilt."""
    mechanism = planted_mechanism(folder)
    motion = planted_motion("slow", np.random.default_rng(0), -0.2, -1.0)
    for joint, log in zip(mechanism.joint_names, motion.recordings, strict=True):
        write_dataset(folder / "joints" / joint, [replace(log, name="slow.csv")], [])
    return folder / "joints" / "elbow" / "slow.csv"


def stand_arm(path: Path) -> None:
    """Find how the arm of `diagnose --arm` stands."""
    mechanism = load_mechanism(path.parents[2] / "arm" / "arm.usda")
    logs = {
        joint: load_dataset(path.parents[1] / joint, require_test=False).train
        for joint in mechanism.joint_names
    }
    placed = find_placement(mechanism, motions_of(logs, mechanism.joint_names))
    assert np.all(np.isfinite([*placed.arm.zero, *placed.tilt]))
