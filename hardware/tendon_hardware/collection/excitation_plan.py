"""Recordings to make, in order and with obstacles: the paper's 36 minutes, and shorter plans.

Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), section III. The plan
has about 36 minutes at 80 Hz, half on the finger, a quarter each on a weak and a strong spring.
Part of the time on the finger something blocks it. The step protocol, the contact ramps and the
perturbed sinusoid of section IV are test recordings: no fit sees them. How the paper's minutes
divide among its excitations is not said; here steps, which excite most, have the most.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.dataset import SPLITS, Split
from tendon_newton.data.excitations import excite, find_excitation
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter, look_up, unknown_name

BENCHES = ("finger", "spring_weak", "spring_strong")

OBSTACLES: dict[str, str] = {
    "free": "Nothing may touch the mechanism.",
    "tape_roll": "Put a roll of tape into the finger's path so that it stops it half closed.",
    "hand": "Hold the finger open with your hand for the whole run: it must not close.",
    "hand_perturbation": (
        "While it moves, hold the finger now and then for about a second, each time somewhere else."
    ),
}
"""What stands in the mechanism's way, and what the operator is asked to do for it."""
BY_HAND = ("hand", "hand_perturbation")
"""What the operator is asked for before every run, since nobody holds a finger between two."""


@dataclass(frozen=True, kw_only=True)
class PlannedRun:
    """Bench, excitation, length and obstacle of a recording to be made."""

    name: str  # Name of its file, without ending
    bench: str  # Name of the bench's asset
    excitation: str  # Name of the command's shape
    duration: float  # Length [s]
    split: Split = "train"  # ``train`` or ``test``
    obstacle: str = "free"  # Obstacle in the bench's way

    def __post_init__(self) -> None:
        find_excitation(self.excitation)
        if self.obstacle not in OBSTACLES:
            raise unknown_name("obstacle", self.obstacle, OBSTACLES)
        if self.split not in SPLITS:
            raise unknown_name("split", self.split, SPLITS)
        if not 1.0 <= self.duration <= 3600.0:
            raise InvalidParameter(f"a run must last 1 to 3600 s; it lasts {self.duration:g} s")

    def command(self, seed: int, rate: float) -> Array:
        """Return the command [rad] at every row, shape (T,).

        What is drawn depends on the seed and the run's name, not on what else is in the plan.
        """
        _, command = excite(self.excitation, self.duration, self.generator(seed), rate)
        return command

    def generator(self, seed: int) -> np.random.Generator:
        """Return the run's own source of random numbers."""
        return np.random.default_rng([seed, zlib.crc32(self.name.encode())])


@dataclass(frozen=True, kw_only=True)
class Share:
    """Several runs of one kind."""

    excitation: str
    count: int
    duration: float  # Length of each run [s]
    obstacle: str = "free"
    split: Split = "train"


STEP_TESTS = (
    Share(excitation="steps_held_1s", count=1, duration=8.0, split="test"),
    Share(excitation="steps_held_2s", count=1, duration=16.0, split="test"),
    Share(excitation="steps_held_3s", count=1, duration=24.0, split="test"),
)
"""Each goes twice through the angles; 48 s."""

FINGER_TESTS = (
    *STEP_TESTS,
    Share(excitation="contact_ramp", count=1, duration=20.0, split="test"),
    Share(excitation="contact_ramp", count=1, duration=20.0, split="test", obstacle="tape_roll"),
    Share(excitation="contact_ramp", count=1, duration=20.0, split="test", obstacle="hand"),
    Share(excitation="closing_sine", count=1, duration=20.0, split="test"),
    Share(excitation="closing_sine", count=1, duration=30.0, split="test",
        obstacle="hand_perturbation"),
)  # fmt: skip
"""Test runs of the paper's plan on the finger: 158 s."""

FINGER_TRAINING = (
    Share(excitation="random_steps", count=3, duration=60.0),
    Share(excitation="sine", count=6, duration=30.0),
    Share(excitation="ramps", count=3, duration=50.0),
    Share(excitation="stairs", count=2, duration=50.0),
    Share(excitation="random_steps", count=2, duration=42.0, obstacle="tape_roll"),
    Share(excitation="random_steps", count=2, duration=36.0, obstacle="hand_perturbation"),
    Share(excitation="ramps", count=2, duration=32.0, obstacle="tape_roll"),
    Share(excitation="ramps", count=1, duration=28.0, obstacle="hand"),
    Share(excitation="sine", count=2, duration=32.0, obstacle="hand_perturbation"),
)
"""Training runs on the finger: 922 s, a third of them blocked."""

SPRING_TRAINING = (
    Share(excitation="random_steps", count=3, duration=60.0),
    Share(excitation="sine", count=6, duration=24.0),
    Share(excitation="ramps", count=2, duration=48.0),
    Share(excitation="stairs", count=2, duration=36.0),
)
"""Training runs on a spring: 492 s."""

QUICK = (
    Share(excitation="random_steps", count=1, duration=8.0),
    Share(excitation="ramps", count=1, duration=8.0),
    Share(excitation="steps_held_1s", count=1, duration=8.0, split="test"),
)
"""Two training runs of each bench: a diagnosis that leaves one out still sees the bench."""

REPEATED = Share(excitation="steps_held_2s", count=1, duration=16.0, split="test")
"""Thrice in a session, once a finger has moved: what it does not repeat is a floor."""
BOARD = (
    Share(excitation="random_steps", count=2, duration=60.0),
    REPEATED,
    Share(excitation="sine", count=3, duration=30.0),
    REPEATED,
    Share(excitation="slow_ramps", count=1, duration=60.0),
    Share(excitation="long_holds", count=1, duration=40.0),
    Share(excitation="closing_sine", count=1, duration=20.0, split="test"),
    Share(excitation="contact_ramp", count=1, duration=20.0, split="test"),
    REPEATED,
    Share(excitation="contact_ramp", count=1, duration=20.0, split="test", obstacle="tape_roll"),
)
"""One finger: 310 s to fit, and 108 s to predict, of which 20 s meet what no fit has seen."""


def paper_plan() -> tuple[PlannedRun, ...]:
    """Return the paper's 36 minutes: 18 on the finger, 9 on each spring; 4 of them are tests."""
    return (
        *runs_of("finger", (*FINGER_TRAINING, *FINGER_TESTS)),
        *runs_of("spring_weak", (*SPRING_TRAINING, *STEP_TESTS)),
        *runs_of("spring_strong", (*SPRING_TRAINING, *STEP_TESTS)),
    )


PLANS: dict[str, Callable[[], tuple[PlannedRun, ...]]] = {
    "paper": paper_plan,
    # a minute on all three benches, to try a bench out
    "quick": lambda: tuple(run for bench in BENCHES for run in runs_of(bench, QUICK)),
    # seven minutes on a finger, to be handed in for the board
    "board": lambda: tuple(runs_of("finger", BOARD)),
}


def find_plan(name: str) -> tuple[PlannedRun, ...]:
    """Return a plan's runs; an unknown name is refused."""
    return look_up("plan", name, PLANS)()


def runs_of(bench: str, shares: Sequence[Share]) -> list[PlannedRun]:
    """Name and number the runs on one bench; those with the same obstacle follow each other."""
    runs: list[PlannedRun] = []
    for obstacle in OBSTACLES:
        for share in shares:
            if share.obstacle != obstacle:
                continue
            words = (bench, share.excitation, "" if obstacle == "free" else obstacle)
            stem = "_".join(filter(None, words))
            place = sum(run.name.startswith(f"{stem}_") for run in runs)
            runs += [
                PlannedRun(
                    name=f"{stem}_{place + number}",
                    bench=bench,
                    excitation=share.excitation,
                    duration=share.duration,
                    split=share.split,
                    obstacle=obstacle,
                )
                for number in range(share.count)
            ]
    return runs
