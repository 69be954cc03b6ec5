"""A servo that says more than a model's, tried where the model's own leaves something unexplained.

Every servo has a rotor, and few data sheets state it; a firmware's damping is stated by none. So
the numbers that an actuator calls `doubtful` are fitted, and an actuator without them gives way to
its `richer` one. That is a cause as others are: it must bring a price for each of its numbers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.result import ActuatorFound, Diagnosis
from tendon_newton.diagnosis.search.decide.rule import PRICE
from tendon_newton.identification.study import Study, benches_of, replacements
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

LEAVE_NOTHING = ("no_gap", "explained")


@dataclass(frozen=True, kw_only=True)
class RicherActuator:
    """A model whose servo says more, with numbers that are to be fitted."""

    model: Model
    numbers: tuple[str, ...]  # Its numbers that the model before did not have to fit

    @property
    def words(self) -> str:
        """What is tried, in words."""
        numbers = ", ".join(name.replace("_", " ") for name in self.numbers)
        return f"the actuator {self.model.actuator.name}, its {numbers} fitted"


def richer_actuator(model: Model, recordings: Sequence[Recording]) -> RicherActuator | None:
    """Return a model whose servo says more; None where there is none, or nothing commands it."""
    own = find_actuator(model.actuator.name)
    declared = {parameter.name for parameter in own.parameters}
    stated = {key for recording in recordings for key in recording.actuator_overrides}
    if any(recording.command is None for recording in recordings):
        return None
    numbers = tuple(name for name in own.doubtful if name not in {*model.fit, *stated})
    if numbers:
        return RicherActuator(model=replace(model, fit=(*model.fit, *numbers)), numbers=numbers)
    benches = benches_of(recordings, model)
    found = None if stated else own.richer(model.actuator.values, *servo_of(model, benches))
    if found is None:
        return None
    name, values = found
    numbers = find_actuator(name).doubtful
    if not all(p.lower <= values.get(p.name, p.null) <= p.upper
               for p in find_actuator(name).parameters):  # fmt: skip
        return None  # a machine of another size than its ranges
    kept = {k: v for k, v in model.actuator.values.items() if k == "spool_radius"}
    richer = replace(
        model,
        actuator=NamedValues(name=name, values={**values, **kept}),
        fit=(*(key for key in model.fit if key not in declared), *numbers),
        tolerances={k: v for k, v in model.tolerances.items() if k not in declared},
    )
    return RicherActuator(model=richer, numbers=numbers)


def servo_of(model: Model, benches: Mapping[str, Mechanism]) -> tuple[float, float]:
    """Return the greatest force [N] that the benches let their servos give, and a spool's radius.

    A shaft has a radius of 1 m.
    """
    tendons = [tendon for mechanism in benches.values() for tendon in mechanism.tendons]
    radius = model.actuator.values.get("spool_radius", tendons[0].spool_radius)
    radius = 1.0 if tendons[0].direct else float(radius)
    return min(tendon.force_limit for tendon in tendons), radius


def says_more(found: Diagnosis, richer: Diagnosis, gain: float, numbers: int) -> bool:
    """Tell whether a richer actuator is the answer: it explains more, by no more causes.

    Args:
        found: What was found with the actuator as it is stated.
        richer: What was found with the richer one.
        gain: By how much less the richer one leaves [nat per row], from `left_over`.
        numbers: How many numbers it has more.
    """
    fewer = len(richer.effects) <= len(found.effects)
    return gain > PRICE * numbers and (fewer or richer.verdict in LEAVE_NOTHING)


def left_over(study: Study, values: Mapping[int, float]) -> float:
    """Return the size of what a model leaves of each signal, in logarithms of noise [nat per row].

    Medians say it: rows of a jump must not decide.
    """
    total = 0.0
    residuals = study.residuals(*replacements([values]))
    signals = [[r.theta[0, r.trusted] for r in residuals], []]
    signals[1] = [r.force[0, r.trusted] for r in residuals if r.force is not None]
    for parts, noise in zip(signals, (study.noise.theta, study.noise.force), strict=True):
        if parts and noise:
            size = float(np.median(np.abs(np.concatenate(parts)))) / 0.6745
            total += float(np.log(max(size / noise, 1.0)))
    return total


def with_actuator(found: Diagnosis, richer: Diagnosis, numbers: Sequence[str]) -> Diagnosis:
    """Return the answer with a richer actuator, beside the model as it was given."""
    verdict = {"no_gap": "explained", "unexplained": "partly_explained"}
    return replace(
        richer,
        verdict=verdict.get(richer.verdict, richer.verdict),
        baseline=found.baseline,
        actuator=ActuatorFound(
            stated=found.model.actuator.name,
            kind=richer.model.actuator.name,
            parameters={name: richer.fitted[name] for name in numbers},
            without=found.extended,
        ),
    )
