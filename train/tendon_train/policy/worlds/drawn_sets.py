"""Worlds that differ as a diagnosis leaves open: each has a whole set of causes."""

from collections.abc import Iterable

import numpy as np
import torch
from torch import Tensor

from tendon_newton.actuators import ACTUATORS
from tendon_newton.data.bench_overrides import OF_BENCH
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.posterior import Posterior, Worlds
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.model.bench_numbers import (
    OWNER,
    TOLERATED,
    WRITTEN,
    BenchNumber,
    name_of,
    numbers_of,
    write_numbers,
)
from tendon_train.policy.worlds.force_model import moves_finger

DECK, SEED = 4096, 0
"""Worlds that are drawn in advance, of which an episode gets one, and the seed of their draws."""
ENDS = (0.025, 0.975)  # Shares of the draws below the two numbers that a card tells [1]


class DrawnSets:
    """Draws worlds of a deck.

    Args:
        mechanism: Their bench, with the model's own numbers.
        actuator: Name of the model's actuator; numbers of another one are left out.
    """

    def __init__(
        self, loop: ControlLoop, mechanism: Mechanism, actuator: str, posterior: Posterior
    ) -> None:
        deck = posterior.sample(DECK, SEED)
        kept = {*causes_of(posterior), actuator}
        own = {key: of_bench(key, drawn, deck, mechanism.name)
               for key, drawn in deck.items() if key[0] in kept}  # fmt: skip
        # Ends of 95 % of the draws of each number
        self.ranges = {f"{owner}.{name}": ends(drawn) for (owner, name), drawn in own.items()}
        pairs: Iterable[tuple[Tensor, Array]] = [
            *((loop.numbers(*key), drawn) for key, drawn in own.items()),
            *built(loop, mechanism, deck),
        ]
        self._pairs = [(values, torch.from_numpy(drawn).to(values)) for values, drawn in pairs]

    def draw(self, share: Tensor, worlds: Tensor) -> None:
        """Give new numbers to some worlds.

        Args:
            share: Place in the deck, from 0 up to 1, shape (W,).
            worlds: Mask of the worlds, shape (W,).
        """
        place = (DECK * share).long()
        for values, drawn in self._pairs:
            further = [1] * (values.ndim - drawn.ndim)
            new = drawn[place].reshape(len(place), *drawn.shape[1:], *further)
            values.copy_(torch.where(worlds.reshape(-1, *[1] * (values.ndim - 1)), new, values))


def causes_of(posterior: Posterior) -> tuple[str, ...]:
    """Return the effects that a simulation must hold for its numbers to differ."""
    owners = {number.owner: None for own in posterior.sets for number in own.numbers}
    return tuple(o for o in owners if o not in (OWNER, *ACTUATORS) and moves_finger(o))


def of_bench(key: tuple[str, str], drawn: Array, deck: Worlds, bench: str) -> Array:
    """Return draws of an effect's number in the size that it has on a bench."""
    effect, number = key
    factor = deck.get((OWNER, f"{bench}.{effect}")) if OF_BENCH.get(effect) == number else None
    return drawn if factor is None else drawn * factor


def ends(drawn: Array) -> tuple[float, float]:
    """Return the ends of 95 % of the draws that are finite."""
    low, high = np.quantile(drawn[np.isfinite(drawn)], ENDS)
    return float(low), float(high)


def built(loop: ControlLoop, mechanism: Mechanism, deck: Worlds) -> list[tuple[Tensor, Array]]:
    """Return arrays of the worlds, (W, J, ...), and what masses and lengths make of them in a deck.

    Those of a bench of several equal chains stay as they are.
    """
    if loop.solver.chain_count > 1:
        return []
    numbers, columns = [], []
    for key in TOLERATED:
        for joint, value in enumerate(numbers_of(key, mechanism)):
            name = name_of(key, mechanism.name, joint, mechanism, {mechanism.name: mechanism})
            found = deck.get((OWNER, name), deck.get((OWNER, f"{mechanism.name}.{name}")))
            if found is not None:
                columns.append(found)
                numbers.append(
                    BenchNumber(bench=mechanism.name, key=key, joint=joint, value=value, name=name)
                )
    if not numbers:
        return []
    arrays = {}
    for name in WRITTEN:
        first = loop.bench_numbers(name)[:1].cpu().numpy().astype(np.float64)
        arrays[name] = np.repeat(first, DECK, axis=0)
    nominal = {name: array[0].copy() for name, array in arrays.items()}
    write_numbers(arrays, numbers, np.stack(columns, axis=1), mechanism.parents)
    return [(loop.bench_numbers(name), array) for name, array in arrays.items()
            if (array != nominal[name]).any()]  # fmt: skip
