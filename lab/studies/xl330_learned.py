"""Real XL330 logs: a learned torque, ``python -m lab.studies.xl330_learned LOGS``.

A perceptron takes the place of motor, gear and friction: from the voltage that the firmware's law
applies, speed and load now and in the last 40 ms it answers with an angular acceleration. No torque
was measured, so it is trained through the motion, in closed loop, on the same splits as
``lab.studies.xl330``. The logs are Rhoban/bam's; they are not part of this repository.
"""

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from lab.studies.xl330 import gains
from tendon_newton.cli import main as tendon_newton
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.recording import Recording

STEP = 5.0e-3  # [s]
PAST = (0, 2, 4, 8)  # Steps ago of what the network sees: 0, 10, 20 and 40 ms
GRAVITY_PER_ARM = 9.81  # [m/s^2], over the arm's length: acceleration of a pendulum without a motor
VOLTS, SPEED, LOAD = 3.0, 3.0, 1.0  # About which size the inputs have [V], [rad/s], [1]
PUSH = 100.0  # About which size the answer has [rad/s^2]
SLOPE = 0.03
"""Time over which a segment's first speed is taken from the angles [s]; the register is late."""
LENGTHS = (20, 60, 120)
"""Steps of the segments that are trained on, one after the other: 0.1, 0.3 and 0.6 s."""
UPDATES = 300  # Per length
BATCH = 128
LEARNING_RATE = 3.0e-3


@dataclass(frozen=True, kw_only=True)
class Logs:
    """Several logs on one grid of time, each over its own length, shape (logs, T)."""

    goal: Tensor  # Commanded angle [rad]
    angle: Tensor  # Measured angle [rad]
    speed: Tensor  # Its slope [rad/s]
    volts: Tensor  # Supply [V], zero where the torque is off
    gain: Tensor  # Duty per radian [1/rad], shape (logs, 1)
    arm: Tensor  # Length [m], shape (logs, 1)

    @staticmethod
    def of(recordings: Sequence[Recording]) -> "Logs":
        """Put some recordings on a grid of time."""
        time = np.arange(0.0, min(r.time[-1] - r.time[0] for r in recordings), STEP)
        columns = [on_grid(recording, time) for recording in recordings]
        goal, angle, speed, volts = (torch.stack(part) for part in zip(*columns, strict=True))
        numbers = [
            (r.actuator_overrides["duty_per_rad"], r.bench_overrides.given["length"][0])
            for r in recordings
        ]
        gain, arm = torch.tensor(numbers, dtype=torch.float32).T[:, :, None]
        return Logs(goal=goal, angle=angle, speed=speed, volts=volts, gain=gain, arm=arm)


def on_grid(recording: Recording, time: np.ndarray) -> tuple[Tensor, ...]:
    """Return goal, angle, speed and applied supply of a recording at some instants."""
    assert recording.command is not None
    assert recording.voltage is not None
    own = recording.time - recording.time[0]
    held = np.searchsorted(own, time, side="right") - 1
    angle = recording.motor_position[:, 0]
    before, after = (np.interp(time + side, own, angle) for side in (-SLOPE / 2, SLOPE / 2))
    columns = (
        recording.command[held, 0],
        np.interp(time, own, angle),
        (after - before) / SLOPE,
        (recording.voltage * recording.enabled)[held],
    )
    return tuple(torch.tensor(column, dtype=torch.float32) for column in columns)


def network() -> nn.Module:
    """Return an untrained network."""
    return nn.Sequential(
        nn.Linear(4 * len(PAST), 32), nn.Tanh(), nn.Linear(32, 32), nn.Tanh(), nn.Linear(32, 1)
    )


def roll_out(net: nn.Module, logs: Logs, rows: Tensor, begin: Tensor, length: int) -> Tensor:
    """Return the angles [rad] of segments in closed loop from their measured start.

    Args:
        net: What answers with accelerations.
        logs: Where commands, supply and start are from.
        rows: Log of each segment, shape (S,).
        begin: First step of each segment, shape (S,).
        length: Steps.

    Returns:
        Shape (S, length).
    """
    gain, arm = logs.gain[rows, 0], logs.arm[rows, 0]
    angle, speed = logs.angle[rows, begin], logs.speed[rows, begin]
    seen: list[Tensor] = []
    angles = []
    for k in range(length):
        supply = logs.volts[rows, begin + k]
        volts = (gain * (logs.goal[rows, begin + k] - angle)).clamp(-1.0, 1.0) * supply
        sample = [volts / VOLTS, speed / SPEED, torch.sin(angle) / LOAD, (supply > 0.0).float()]
        seen.append(torch.stack(sample, dim=1))
        past = torch.cat([seen[max(k - ago, 0)] for ago in PAST], dim=1)
        push = PUSH * net(past)[:, 0] - GRAVITY_PER_ARM / arm * torch.sin(angle)
        speed = speed + STEP * push
        angle = angle + STEP * speed
        angles.append(angle)
    return torch.stack(angles, dim=1)


def train(logs: Logs, seed: int) -> nn.Module:
    """Train through ever longer segments of the motion."""
    torch.manual_seed(seed)
    net = network()
    optimizer = torch.optim.Adam(net.parameters(), lr=LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, UPDATES * len(LENGTHS))
    count, last = logs.angle.shape
    for length in LENGTHS:
        for _ in range(UPDATES):
            rows = torch.randint(count, (BATCH,))
            begin = torch.randint(last - length - 1, (BATCH,))
            steps = begin[:, None] + torch.arange(1, length + 1)[None, :]
            error = roll_out(net, logs, rows, begin, length) - logs.angle[rows[:, None], steps]
            optimizer.zero_grad()
            error.abs().mean().backward()
            nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimizer.step()
            schedule.step()
    return net


def closed_loop_error(net: nn.Module, logs: Logs) -> float:
    """Return the mean absolute error [rad] of whole logs from their first row."""
    count, length = logs.angle.shape
    with torch.no_grad():
        begin = torch.zeros(count, dtype=torch.int64)
        angles = roll_out(net, logs, torch.arange(count), begin, length - 1)
    return float((angles - logs.angle[:, 1:]).abs().mean())


def main() -> None:
    """Train for each gain that is held out, and print the errors on it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument(
        "--test", type=int, action="append", help="gains to hold out: each by default"
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    for gain in arguments.test or gains(arguments.logs):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "dataset"
            words = ["--out", str(out), "--test", f"kp={gain}"]
            if tendon_newton(["import", "xl330", str(arguments.logs), *words]) != 0:
                raise SystemExit(2)
            dataset = load_dataset(out)
        seen, held = Logs.of(dataset.train), Logs.of(dataset.test)
        for seed in arguments.seeds:
            net = train(seen, seed)
            print(
                f"held out kp {gain}, seed {seed}: mean absolute error of theta, closed loop: "
                f"{1e3 * closed_loop_error(net, held):.1f} mrad; on the train logs "
                f"{1e3 * closed_loop_error(net, seen):.1f} mrad",
                flush=True,
            )


if __name__ == "__main__":
    main()
