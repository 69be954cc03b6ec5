"""Fit one of Rhoban/bam's models until its search has converged; runs in their environment.

``PYTHON bam_search.py --logdir LOGS --actuator NAME --model m4 --out m4.json [--known m2.json]``

The simulation, the parameters and their ranges are theirs, and so is the kind of search (CMA-ES
that begins anew). Candidates of several searches go through their simulator at once, as if each
were a log of its own. Models that this one contains are started from (``--known``): none of them
fits better. A search has converged when two that began apart end within 1 % of the best.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from bam.actuators import actuators  # pyright: ignore[reportMissingImports]
from bam.logs import Logs  # pyright: ignore[reportMissingImports]
from bam.model import models  # pyright: ignore[reportMissingImports]
from bam.simulate import Simulator  # pyright: ignore[reportMissingImports]
from cmaes import CMA  # pyright: ignore[reportMissingImports]

SIDE_BY_SIDE, POPULATION = 4, 16
LEVEL = 1.01  # Ratio of errors up to which two searches ended alike [1]
STARTS = 4  # Searches that end before a model may have converged
PATIENCE, WORTH = 40, 1.001
"""Generations in which a search must get better by that ratio, or it ends [1]."""
WIDE, FINE = 1.0 / 6.0, 0.05
"""Spread of a search over the ranges; of one that begins at a contained model [1]."""
CONTAINED = {
    "load_friction_motor": "load_friction_base",
    "load_friction_external": "load_friction_base",
    "load_friction_motor_stribeck": "load_friction_stribeck",
    "load_friction_external_stribeck": "load_friction_stribeck",
}
"""Numbers of a larger model, by that of a smaller one that both are equal to."""
ABSENT = (
    "friction_stribeck",
    "load_friction_base",
    "load_friction_stribeck",
    "load_friction_motor_quad",
    "load_friction_external_quad",
)
"""Numbers that vanish in a smaller model without them."""


class Kept(np.ndarray):
    """Values that ``+=`` leaves alone, as it does a number: their friction adds to a parameter."""

    def __iadd__(self, other: Any) -> np.ndarray:
        """Return the sum, and stay."""
        return self + other


class Objective:
    """Mean absolute error of one of their models on some logs, for many candidates at once."""

    def __init__(self, logdir: Path, actuator: str, model: str) -> None:
        logs = Logs(str(logdir))
        self.count = len(logs.logs)
        logs.logs = logs.logs * (SIDE_BY_SIDE * POPULATION)
        self.batch = logs.make_batch()
        self.positions = np.array([entry["position"] for entry in self.batch["entries"]])
        self.model = models[model]()
        self.model.set_actuator(actuators[actuator]())
        found = self.model.get_parameters()
        self.numbers = {name: p for name, p in found.items() if p.optimize}
        self.low = np.array([p.min for p in self.numbers.values()])
        self.span = np.array([p.max for p in self.numbers.values()]) - self.low

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """Return the error [rad] of each candidate, (64, N) shares of the ranges."""
        values = np.repeat(self.low + self.span * places, self.count, axis=0)
        for number, own in zip(self.numbers.values(), values.T, strict=True):
            number.value = own.view(Kept)
        with np.errstate(all="ignore"):
            rolled = Simulator(self.model).rollout_log(self.batch, simulate_control=True)
            missed = np.abs(np.array(rolled[0]) - self.positions).mean(axis=0)
        left = missed.reshape(-1, self.count).mean(axis=1)
        return np.where(np.isfinite(left), left, 1e3)

    def place(self, known: dict[str, float]) -> np.ndarray:
        """Return where the ranges hold the numbers of a contained model; others stay in between."""
        start = {name: number.min + 0.5 * (number.max - number.min)
                 for name, number in self.numbers.items()}  # fmt: skip
        start |= {name: 0.0 for name in ABSENT if name in start}
        start |= {own: known.get(name, 0.0) for own, name in CONTAINED.items() if own in start}
        start |= {name: value for name, value in known.items() if name in start}
        return np.clip((np.array([*start.values()]) - self.low) / self.span, 0.0, 1.0)

    def named(self, place: np.ndarray) -> dict[str, float]:
        """Return the numbers at a place by their names."""
        values = self.low + self.span * place
        return dict(zip(self.numbers, map(float, values), strict=True))


def search(objective: Objective, known: list[dict[str, float]], seconds: float) -> dict[str, Any]:
    """Search until converged or out of time; return the best numbers and how it went."""
    rng = np.random.default_rng(0)
    size, begun = len(objective.numbers), time.monotonic()
    starts = [objective.place(one) for one in known]
    waiting, running, trials = list(starts), [], 0
    ended: list[Descent] = []
    while time.monotonic() - begun < seconds and not converged(ended):
        while len(running) < SIDE_BY_SIDE:
            mean, spread = (waiting.pop(0), FINE) if waiting else (middle(rng, size), WIDE)
            running.append(Descent(mean, spread, int(rng.integers(2**31))))
        left = objective(np.concatenate([one.ask() for one in running]))
        trials += left.size
        for k, one in enumerate(running):
            one.tell(left[k * POPULATION : (k + 1) * POPULATION])
        ended += [one for one in running if one.over]
        running = [one for one in running if not one.over]
    every = [*ended, *running]
    known_places = np.resize([*starts, np.full(size, 0.5)], (SIDE_BY_SIDE * POPULATION, size))
    ends = [(one.least, one.best) for one in every]
    ends += zip(objective(known_places)[: len(starts)].tolist(), starts, strict=True)
    error, place = min(ends, key=lambda end: end[0])
    return {
        "found": objective.named(place),
        "error": error,
        "trials": trials,
        "searches": len(ended),
        "converged": converged(ended),
    }


def middle(rng: np.random.Generator, size: int) -> np.ndarray:
    """Draw where a search begins: in the middle half of each range."""
    return rng.uniform(0.25, 0.75, size)


class Descent:
    """One search, which ends when it gets no better.

    Args:
        mean: Where it begins, in shares of the ranges.
        spread: How far it looks at first, over the ranges [1].
        seed: Of its draws.
    """

    def __init__(self, mean: np.ndarray, spread: float, seed: int) -> None:
        bounds = np.tile([0.0, 1.0], (mean.size, 1))
        self.inner = CMA(
            mean=mean, sigma=spread, bounds=bounds, population_size=POPULATION, seed=seed
        )
        self.best, self.least = mean, np.inf
        self.mark = 0, np.inf

    def ask(self) -> np.ndarray:
        """Return candidates, (16, N)."""
        self.asked = np.array([self.inner.ask() for _ in range(POPULATION)])
        return self.asked

    def tell(self, left: np.ndarray) -> None:
        """Hear what the candidates leave [rad]."""
        self.inner.tell(list(zip(self.asked, map(float, left), strict=True)))
        if left.min() < self.least:
            self.best, self.least = self.asked[int(left.argmin())], float(left.min())
        if WORTH * self.least < self.mark[1]:
            self.mark = self.inner.generation, self.least

    @property
    def over(self) -> bool:
        """Whether it has got no better for long."""
        return self.inner.should_stop() or self.inner.generation - self.mark[0] >= PATIENCE


def converged(ended: list[Descent]) -> bool:
    """Tell whether enough searches have ended, and two of them at the best."""
    least = min((one.least for one in ended), default=np.inf)
    return len(ended) >= STARTS and sum(one.least <= LEVEL * least for one in ended) >= 2


def main() -> None:
    """Fit one model and write its numbers as their programs read them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logdir", type=Path, required=True)
    parser.add_argument("--actuator", required=True)
    parser.add_argument("--model", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--known", type=Path, nargs="*", default=[])
    parser.add_argument("--seconds", type=float, required=True, help="after which it ends anyhow")
    words = parser.parse_args()
    known = [json.loads(path.read_text()) for path in words.known]
    found = search(Objective(words.logdir, words.actuator, words.model), known, words.seconds)
    words.out.write_text(json.dumps(found))


if __name__ == "__main__":
    main()
