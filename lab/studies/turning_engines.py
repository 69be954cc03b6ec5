"""Pull the strings of a hand alike in two engines: does the ball go the same way?

``python -m lab.studies.turning_engines`` lets the gait of a diagnosed motor turn the ball in
our solver. Its tensions pull the strings of the virtual bench's scene, which MuJoCo moves. The
strings have no friction here. ``--out`` names the picture of both paths. Some seconds on a core,
once kernels are compiled.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
import warp as wp

from lab.studies.turning import GAITS, HANDS, MODELS, NUMBERS, Walk, worlds
from tendon_hardware.virtual_bench.physics.constants import TIME_STEP, HandBallConstants
from tendon_hardware.virtual_bench.physics.scene import Scene
from tendon_newton.data.cards.turning_task import half_turn
from tendon_newton.data.recording import Array
from tendon_train.policy.config.turning_config import TurningConfig
from tendon_train.policy.worlds.turning import AXIS

MOTOR = "diagnosed"
PLAIN = replace(
    HANDS,
    worlds=1,
    force=str(MODELS / f"{MOTOR}.toml"),
    rate=500.0,
    randomise=("none",),
    spread=0.0,
    max_step=2.0e-3,
    turning=TurningConfig(size_spread=0.0, start_command=1.0e-3),
)
"""One hand as the asset states it, whose fingers begin open."""
ENGINES = ("our solver", "MuJoCo")


@dataclass(frozen=True, kw_only=True)
class Paths:
    """What the ball did in each of `ENGINES` under the same pulls."""

    time: Array  # [s], shape (T,)
    place: Array  # Its middle from where it started [m], shape (2, T, 3)
    turned: Array  # Net turn about the axis of the task [rad], shape (2, T)

    @property
    def text(self) -> str:
        """The ends, and how far the places are apart."""
        ends = ", ".join(
            f"{t:.2f} rad in {e}" for e, t in zip(ENGINES, self.turned[:, -1], strict=True)
        )
        return f"turned in {self.time[-1]:.1f} s: {ends}; {1e3 * self.apart:.2f} mm apart (RMS)"

    @property
    def apart(self) -> float:
        """Root of the mean squared distance between the places [m]."""
        return float(np.sqrt(np.mean(np.sum((self.place[0] - self.place[1]) ** 2, axis=-1))))


def main() -> None:
    """Turn, and say and draw what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--out", type=Path, default=Path("docs/images/turning_engines.png"))
    words = parser.parse_args()
    wp.config.log_level = wp.LOG_ERROR
    paths = turned_in_both(words.seconds)
    print(paths.text, flush=True)
    draw(paths, words.out)


def turned_in_both(seconds: float) -> Paths:
    """Turn the ball for a time [s] in our solver, and pull the scene's strings alike."""
    hands, scene = worlds(PLAIN, seconds), Scene("hand_ball", HandBallConstants())
    hands.loop.numbers("routing_friction", "exponent").fill_(0.0)
    gait = json.loads(GAITS.read_text(encoding="utf-8"))[MOTOR]
    walk, seen = Walk(hands, torch.tensor([[gait[name] for name in NUMBERS]])), torch.empty(0)
    poses = [(hands.loop.body_pose[0].tolist(), scene.ball())]
    pulled = round(1.0 / (PLAIN.rate * TIME_STEP))
    for _ in range(round(seconds * PLAIN.rate)):
        hands.step(walk(seen))
        pulls = hands.loop.reading.force[0].tolist()
        for _ in range(pulled):
            scene.advance(pulls, (0.0,) * len(pulls), TIME_STEP)
        poses.append((hands.loop.body_pose[0].tolist(), scene.ball()))
    pose = np.moveaxis(np.array(poses, dtype=np.float64), 1, 0)
    sine, cosine = half_turn(pose[:, :-1, 3:], pose[:, 1:, 3:], np.array(AXIS))
    turned = np.pad(np.cumsum(2.0 * np.arctan2(sine, cosine), axis=1), ((0, 0), (1, 0)))
    time = np.arange(pose.shape[1]) / PLAIN.rate
    return Paths(time=time, place=pose[..., :3] - pose[:, :1, :3], turned=turned)


def draw(paths: Paths, out: Path) -> None:
    """Draw turn and place over time, ours and the scene's in one picture."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    turn, place = figure.subplots(1, 2)
    for engine, turned, way in zip(ENGINES, paths.turned, 1e3 * paths.place, strict=True):
        turn.plot(paths.time, turned, label=engine)
        place.plot(paths.time, np.linalg.norm(way, axis=-1), label=engine)
    turn.set(xlabel="time [s]", ylabel="turned [rad]")
    place.set(xlabel="time [s]", ylabel="from where it started [mm]")
    turn.legend(frameon=False)
    figure.savefig(out, dpi=100)


if __name__ == "__main__":
    main()
