"""One hidden cause: as the contract names it, and as the plant has it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from tests.planted.physics.causes import Causes

Values = Mapping[str, float]
Draw = Callable[[np.random.Generator, float], "Planted"]
"""Draws a cause of a given size [1]: 1 is well above the noise, 0 would be nothing."""

FRICTIONS = ("viscous", "coulomb", "load")


@dataclass(frozen=True, kw_only=True)
class Planted:
    """One hidden cause."""

    parameters: Values = field(default_factory=dict)
    """Parameters of the effect in its own words and units."""
    causes: Values = field(default_factory=dict)
    """The fields of ``Causes`` that it changes."""

    def built_on(self, base: Causes) -> Causes:
        """Add this cause to a plant; frictions add up."""
        sums = {name: getattr(base, name) + self.causes.get(name, 0.0) for name in FRICTIONS}
        return Causes(**{**vars(base), **self.causes, **sums})


def planted(parameters: Values, **causes: float) -> Planted:
    """Build a cause from the effect's parameters and the plant's fields."""
    return Planted(parameters=dict(parameters), causes=causes)


def single(parameter: str, cause: str, value: float) -> Planted:
    """Build a cause of one number that plant and effect share."""
    return planted({parameter: value}, **{cause: value})


def either(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number of that size, of either sign."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def factor(rng: np.random.Generator, low: float, high: float, size: float) -> float:
    """Draw a factor of that size, evenly in the logarithm."""
    return float(np.exp(size * rng.uniform(np.log(low), np.log(high))))


def evenly(parameter: str, cause: str, low: float, high: float) -> Draw:
    """Return the draw of one number between two bounds."""
    return lambda rng, size: single(parameter, cause, size * float(rng.uniform(low, high)))


def either_way(parameter: str, cause: str, low: float, high: float) -> Draw:
    """Return the draw of one number of that size, of either sign."""
    return lambda rng, size: single(parameter, cause, size * either(rng, low, high))


def off(parameter: str, cause: str, low: float, high: float) -> Draw:
    """Return the draw of a factor that is off by that share, to either side."""
    return lambda rng, size: single(parameter, cause, 1.0 + size * either(rng, low, high))


def times(parameter: str, cause: str, low: float, high: float) -> Draw:
    """Return the draw of a factor of that size, evenly in the logarithm."""
    return lambda rng, size: single(parameter, cause, factor(rng, low, high, size))
