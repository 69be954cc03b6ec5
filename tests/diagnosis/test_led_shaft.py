"""A shaft led against a load: causes are named on a plant that shares no code with the package."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.diagnose import diagnose
from tests.made import stated_model
from tests.physics.runs import RADIUS, led

SPRING = 200.0  # N/m, of the bench spring_weak, relaxed at 0
STIFFNESS = 9000.0  # N/m
GUIDES = 0.2  # exponent of the capstan equation
SPOOL = 1.2  # N, dry friction of the spool
TRAVEL = 0.002  # rad
START = stated_model("measured_path", {"travel": TRAVEL}, fit=("travel",))


def plant(path: Array, load: Array, rng: np.random.Generator) -> Recording:
    """What a string with friction at its spool and its guides would log, with noise.

    The slider moves only where the pull of one side of its guides is too strong or too weak.
    """
    q, side = RADIUS * path[0] - load[0] / STIFFNESS, 0.0
    force, joint = np.zeros(len(path)), np.zeros(len(path))
    for k, angle in enumerate(path):
        way = angle - path[k - 1] if k else 0.0
        if way != 0.0:
            side = np.sign(way) + (side - np.sign(way)) * np.exp(-abs(way) / TRAVEL)
        for sign in (1.0, -1.0):
            share = np.exp(-GUIDES * sign)
            wound = share * STIFFNESS * RADIUS * angle
            balance = (wound - load[k]) / (share * STIFFNESS + SPRING)
            if sign * (balance - q) > 0.0:
                q = balance
        force[k] = STIFFNESS * (RADIUS * angle - q) + SPOOL * side
        joint[k] = q
    recording = led(path, -load)
    noisy = {"force": force[:, None], "joint_position": joint}
    sizes = {"force": 0.02, "joint_position": 2.0e-5}
    return replace(
        recording,
        motor_velocity=np.gradient(recording.motor_position, recording.time, axis=0),
        **{n: x + sizes[n] * rng.standard_normal(x.shape) for n, x in noisy.items()},
    )


def test_what_drives_a_led_shaft_is_named(rng: np.random.Generator) -> None:
    """String, guides and spool are named and nothing else; numbers within 5 % of the plant's."""
    time = np.arange(640) / 80.0
    paths = [2.0 + 1.5 * np.sin(2.0 * np.pi * f * time) for f in (0.2, 0.35, 0.5)]
    loads = [np.full(640, x) for x in (2.0, 6.0, 11.0)]
    train = [plant(path, load, rng) for path, load in zip(paths, loads, strict=True)]
    test = [plant(paths[0], loads[1], rng)]
    found, _ = diagnose(Dataset(path=Path(), train=tuple(train), test=tuple(test)), START)
    numbers = {(e.name, n): x.value for e in found.effects for n, x in e.parameters.items()}
    assert set(numbers) == {
        ("coulomb_friction", "force"),
        ("routing_friction", "exponent"),
        ("tendon_compliance", "stiffness"),
    }
    truth = {"force": SPOOL, "exponent": GUIDES, "stiffness": STIFFNESS}
    for (_, name), value in numbers.items():
        assert abs(value / truth[name] - 1.0) < 0.05
