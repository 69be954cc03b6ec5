"""Measurements that a person makes without the motor, and what each would settle."""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.next_experiment.expected_run import Forecast, Told
from tendon_newton.diagnosis.next_experiment.open_sets import PlayedSets
from tendon_newton.diagnosis.next_experiment.run_design import LITTLE


@dataclass(frozen=True, kw_only=True)
class ByHand:
    """A number that a person can measure."""

    how: str  # What to do, as an order
    error: float  # Standard deviation of the result [unit of the number]
    minutes: float  # Time that it takes [min]


BY_HAND: dict[str, ByHand] = {
    "spool_radius_error.scale": ByHand(
        how="measure the spool with a caliper", error=0.004, minutes=2.0
    ),
    "load_cell_gain.scale": ByHand(
        how="hang a known mass on the load cell", error=0.003, minutes=5.0
    ),
    "load_cell_bias.offset": ByHand(
        how="read the load cell with a slack tendon", error=0.01, minutes=1.0
    ),
    "joint_stiffness_error.scale": ByHand(
        how="weigh the return spring's force at two lengths", error=0.01, minutes=10.0
    ),
}
"""Number, ``owner.name`` -> how it is measured. A caliper reads 0.05 mm of a spool of 12.5 mm, a
kitchen scale a gram of 300 g; the last two are chosen."""


@dataclass(frozen=True, kw_only=True)
class Worth:
    """What a measurement by hand would tell."""

    number: str
    told: Told

    @property
    def rate(self) -> float:
        """Bits of names and predictions for each minute [bit/min]."""
        return (self.told.names + self.told.task) / BY_HAND[self.number].minutes

    def text(self) -> str:
        """Return it in words."""
        own = BY_HAND[self.number]
        return (
            f"{own.how} ({own.minutes:g} min): {self.told.names:.1f} bits about names and "
            f"{self.told.task:.1f} about the task are expected"
        )


def best_by_hand(forecast: Forecast) -> Worth | None:
    """Return the measurement that tells most for its time; None where none tells anything."""
    found = [
        Worth(number=name, told=forecast.told(measured(forecast, name, own.error), 1.0))
        for name, own in BY_HAND.items()
        if any(name in one.names for one in forecast.sets)
    ]
    telling = [worth for worth in found if worth.told.names + worth.told.task > LITTLE]
    return max(telling, key=lambda worth: worth.rate, default=None)


def measured(forecast: Forecast, name: str, error: float) -> PlayedSets:
    """Return a measurement as a run of one row; a set without the number has it at nothing.

    Args:
        forecast: The sets.
        name: Number, ``owner.name``.
        error: Standard deviation of the result [unit of the number].
    """
    sets, slopes = forecast.sets, list[Array]()
    means = np.zeros((len(sets), 1))
    for k, own in enumerate(sets):
        slope = np.zeros((len(own.names), 1))
        if name in own.names:
            f = own.names.index(name)
            scale, place = own.coordinates[f], float(own.place[f])
            size = abs(scale.place(scale.value(place) + error) - place)
            means[k], slope[f] = place / size, 1.0 / size
        slopes.append(slope)
    return PlayedSets(
        means=means @ means.T,
        slopes=tuple(tuple(one @ other.T for other in slopes) for one in slopes),
        mixed=tuple(one @ means.T for one in slopes),
        rows=1,
    )
