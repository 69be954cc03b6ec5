"""Physics and a network: a corrected servo, and the mechanism as far as recordings tell it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.effects import find_effect
from train.policy.taut_rows import shows_string
from train.policy.tendon_fit import fit_tendon


def hybrid_of(corrected: Model, physical: Model, dataset: Dataset) -> Model:
    """Return a corrected servo with a diagnosed mechanism and a measured tendon.

    Of the physical model all stays that it has behind the load cell. Where recordings show the tip
    and the force, give and slack of the tendon are read off them, and take the place of what a
    fit in a closed loop made of them.

    Args:
        corrected: As `train_correction` makes it.
        physical: The diagnosed model.
        dataset: Recordings to learn from.
    """
    behind = tuple(e for e in physical.effects if find_effect(e.name).side != "actuator")
    effects = (*corrected.effects, *behind)
    model = replace(physical, actuator=corrected.actuator, effects=effects, fit=())
    return fit_tendon(dataset, model)[1] if tell_tendon(dataset.train) else model


def tell_tendon(recordings: Sequence[Recording]) -> bool:
    """Tell whether recordings of exactly one finger show the tip while a load cell pulls."""
    return len({r.bench for r in recordings if shows_string(r)}) == 1
