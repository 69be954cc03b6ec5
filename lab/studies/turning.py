"""Turn a ball in a hand's palm by a gait that sees nothing: what a policy must beat.

``python -m lab.studies.turning`` lets the gaits of ``turning.json`` turn 16 balls for 20 s,
on the motor of a data sheet, on a diagnosed one and on one whose strings stretch; some minutes.
``--search 5`` looks for them anew, on 64 balls for 5 s each round. With ``--asked 0.5`` [rad/s] a
gait waits while its ball is ahead of that rate, as a policy might. Hands, balls and joint friction
differ as in training.

Each pair of fingers, index with ring and middle with little, is asked for a wave: offset and
amplitude of the outer and of the inner fingers, a phase between the pairs, and a second harmonic.
An action is a gain times the way from the motor to the wave, as far as a policy may act.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
import warp as wp
from torch import Tensor

from tendon_newton.data.recording import Array
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.scoring.turning_score import turning_worlds, watch
from tendon_train.policy.worlds.environment import FingerEnvironment

GAITS = Path(__file__).with_suffix(".json")
MODELS = Path(__file__).with_name("turning_models")
MOTORS = ("data_sheet", "diagnosed", "stretching")
"""Model files of a servo: as its data sheet has it, as a diagnosis found it, and with strings."""
NUMBERS = {
    "frequency_hz": (0.4, 2.2),
    "phase_rad": (0.0, 6.28),
    "outer_offset_rad": (1.0, 4.5),
    "outer_amplitude_rad": (0.0, 4.0),
    "inner_offset_rad": (1.0, 4.5),
    "inner_amplitude_rad": (0.0, 4.0),
    "harmonic": (-0.5, 0.5),
    "harmonic_phase_rad": (0.0, 6.28),
    "gain": (1.0, 8.0),
}
"""Numbers of a gait, each between these ends in a search."""
LEADS = torch.tensor([1.0, 0.0, 0.0, 1.0])
OUTER = torch.tensor([1.0, 1.0, 0.0, 0.0])
"""Which of index, little, middle and ring are of the pair that leads, and which stand outside."""
HANDS = EnvironmentConfig(task="turn", worlds=16, max_step=1.0e-3, history=1, action_clip=9.0)
RATE = 1.0  # Rate that a policy is asked for [rad/s]; a gait does not know of it
SEED = 77  # Seed of the hands and balls
SEARCHED, ELITE = 5.0, 10
"""Time of a gait in a search [s], and how many of a round make the next one."""
DROP_PRICE = 2.0  # Of one drop in a search [rad/s]


def main() -> None:
    """Search if asked to, and print the figures of the gaits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--search", type=int, default=0, metavar="ROUNDS")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--asked", type=float, help="[rad/s]")
    parser.add_argument("--max-step", type=float, default=HANDS.max_step, help="[s]")
    parser.add_argument("--motors", nargs="+", choices=MOTORS, default=list(MOTORS))
    words = parser.parse_args()
    wp.config.log_level = wp.LOG_ERROR
    gaits = json.loads(GAITS.read_text(encoding="utf-8"))
    for name in words.motors:
        own = replace(HANDS, force=str(MODELS / f"{name}.toml"), max_step=words.max_step)
        if words.search:
            gaits[name] = dict(zip(NUMBERS, search(own, words.search), strict=True))
            GAITS.write_text(json.dumps(gaits, indent=1) + "\n", encoding="utf-8")
        asked = words.asked or RATE
        hands = turning_worlds(own, rate=asked, seconds=words.seconds, seed=SEED)
        gait = torch.tensor([gaits[name][number] for number in NUMBERS])
        walk = Waiting if words.asked else Walk
        figures = watch(hands, walk(hands, gait.repeat(HANDS.worlds, 1)), words.seconds)
        print(f"{name}: {figures.text}", flush=True)


def worlds(config: EnvironmentConfig, seconds: float) -> FingerEnvironment:
    """Return hands and balls that differ."""
    return turning_worlds(config, rate=RATE, seconds=seconds, seed=SEED)


class Walk:
    """Commands of W gaits as actions: offsets from where the motors are.

    Args:
        hands: The worlds; actions are not cut there before they are commands.
        gaits: Numbers of each gait in the order of `NUMBERS`, shape (W, 9).
    """

    def __init__(self, hands: FingerEnvironment, gaits: Tensor) -> None:
        self._hands, self._gaits, self._begun = hands, gaits, hands.steps

    def __call__(self, seen: Tensor) -> Tensor:
        """Return the offsets [rad] of all servos now, shape (W, 4)."""
        time = (self._hands.steps - self._begun) / self._hands.config.rate
        away = self.commands(time) - self._hands.loop.reading.motor_position
        return self._gaits[:, -1:] * away

    def commands(self, time: float | Tensor) -> Tensor:
        """Return the desired motor angles [rad] at a time [s], or of each (W, 1), shape (W, 4)."""
        frequency, phase, *levels, harmonic, shift, _ = self._gaits[..., None].unbind(dim=1)
        offset_out, wave_out, offset_in, wave_in = levels
        angle = 2.0 * np.pi * frequency * time + phase * (1.0 - LEADS)
        wave = torch.sin(angle) + harmonic * torch.sin(2.0 * angle + shift)
        offset = offset_in + (offset_out - offset_in) * OUTER
        return offset + (wave_in + (wave_out - wave_in) * OUTER) * wave


class Waiting(Walk):
    """Gaits that go on the slower the farther their ball is ahead, and wait half a radian ahead."""

    _time = torch.zeros(1)  # How far each gait has gone [s], shape (W, 1)

    def __call__(self, seen: Tensor) -> Tensor:
        """Return the offsets [rad] of all servos now, shape (W, 4)."""
        behind = seen[:, -4:-3]  # [rad], before the three coordinates of the ball
        self._time = self._time + (0.5 + behind).clamp(0.0, 1.0) / self._hands.config.rate
        away = self.commands(self._time) - self._hands.loop.reading.motor_position
        return self._gaits[:, -1:] * away


def search(config: EnvironmentConfig, rounds: int) -> list[float]:
    """Return the numbers of a gait that the cross-entropy method finds."""
    hands = worlds(replace(config, worlds=64), SEARCHED)
    generator = np.random.default_rng(SEED)
    low, high = np.array(list(NUMBERS.values())).T
    gaits = best = generator.uniform(low, high, (64, len(low)))
    for number in range(rounds):
        hands.reset(seed=number)
        scores = judged(hands, gaits)
        best = gaits[np.argsort(-scores)]
        elite = best[:ELITE]
        print(
            f"round {number}: best {scores.max():.2f}, median {np.median(scores):.2f} rad/s",
            flush=True,
        )
        middle, spread = elite.mean(axis=0), elite.std(axis=0) + 0.01 * (high - low)
        fresh = np.clip(generator.normal(middle, spread, gaits.shape), low, high)
        gaits = np.concatenate([elite, fresh[ELITE:]])  # the elite meets other hands
    return [round(float(number), 3) for number in best[0]]


def judged(hands: FingerEnvironment, gaits: Array | Sequence[Array]) -> Array:
    """Return what gaits are worth [rad/s], shape (W,)."""
    walk = Walk(hands, torch.tensor(np.array(gaits), dtype=torch.float32))
    figures = watch(hands, walk, SEARCHED)
    return figures.turned / figures.seconds - DROP_PRICE * figures.drops


if __name__ == "__main__":
    main()
