"""Recordings of a made-up servo whose force depends on its past, so that a network has to look."""

from pathlib import Path

import numpy as np

from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.excitations import excite
from tendon_newton.data.recording import Recording
from tests.made import recorded

GAIN = 4.2  # [N/rad]
STIFFNESS = 1.5  # [N/rad] of the load
FRICTION = 1.0  # [N] that the servo holds
LAG = 0.06  # [s]
LIMIT = 21.0  # [N]


def servo_log(
    name: str,
    *,
    bench: str = "finger",
    excitation: str = "random_steps",
    duration: float = 20.0,
    seed: int = 0,
    rate: float = 80.0,
    noise: float = 0.02,
) -> Recording:
    """Record a servo that lags, with a friction that opposes its motion, on a spring.

    A dry friction holds the angle within a band about the equilibrium; the force is the spring's.
    """
    rng = np.random.default_rng(seed)
    time, command = excite(excitation, duration, rng, rate)
    step = 1.0 / rate
    angle, velocity = np.zeros_like(command), np.zeros_like(command)
    q, band = command[0] * GAIN / (GAIN + STIFFNESS), FRICTION / (GAIN + STIFFNESS)
    for k, asked in enumerate(command):
        rest = asked * GAIN / (GAIN + STIFFNESS)
        goal = np.clip(q, rest - band, rest + band)
        moved = (goal - q) * (1.0 - np.exp(-step / LAG))
        velocity[k], q = moved / step, q + moved
        angle[k] = q
    force = np.clip(STIFFNESS * angle + rng.normal(0.0, noise, time.size), 0.0, LIMIT)
    columns = {"command": command, "motor_velocity": velocity, "force": force}
    return recorded(time, angle, name=name, bench=bench, **columns)


def write_servo_dataset(folder: Path, *, duration: float = 12.0) -> Path:
    """Write a small dataset with train recordings on two benches and the paper's test runs."""
    train = [
        servo_log(
            f"{bench}_{excitation}_{seed}.csv",
            bench=bench,
            excitation=excitation,
            duration=duration,
            seed=seed,
        )
        for bench in ("finger", "spring_weak")
        for seed, excitation in enumerate(("random_steps", "sine", "ramps"))
    ]
    tests = ("steps_held_1s", "steps_held_2s", "contact_ramp", "closing_sine_hand_perturbation")
    test = [
        servo_log(
            f"finger_{name}_0.csv",
            excitation=name.removesuffix("_hand_perturbation"),
            duration=10.0,
            seed=10 + seed,
        )
        for seed, name in enumerate(tests)
    ]
    write_dataset(folder, train, test)
    return folder
