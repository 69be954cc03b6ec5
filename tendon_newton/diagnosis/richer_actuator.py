"""A servo that says more than a model's, tried where something is left, or is like a rotor.

Every servo has a rotor, and few data sheets state it; a firmware's damping is stated by none. So
the numbers that an actuator calls `doubtful` are fitted, and an actuator without them gives way to
its `richer` one. That is a cause as others are: it must bring a price for each number more.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import effect_of
from tendon_newton.diagnosis.result import ActuatorFound, Diagnosis
from tendon_newton.diagnosis.search.fixed_set import FIRST_STEPS, with_effects
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.refit import refit, start_fits, values_of
from tendon_newton.diagnosis.search.rule import PRICE
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.identification.study import Study, benches_of, replacements
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

LEAVE_NOTHING = ("no_gap", "explained")
ROTOR_LIKE = ("actuator_lag", "acceleration_limit", "inertia_error")
"""Effects that a rotor may imitate: it takes time to speed up. What back EMF takes is viscous."""


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


def is_doubted(found: Diagnosis) -> bool:
    """Tell whether a diagnosis leaves something, or names what a rotor may imitate."""
    if not (found.finished and found.candidates):
        return False
    leaves = found.verdict not in LEAVE_NOTHING
    return leaves or any(effect_of(cause.name) in ROTOR_LIKE for cause in found.effects)


def numbers_of(found: Diagnosis) -> int:
    """Return how many numbers the named causes have."""
    return sum(len(cause.parameters) for cause in found.effects)


def promises(richer: RicherActuator, found: Diagnosis, left: float, study: Study) -> bool:
    """Tell whether a richer actuator may explain more, before causes are looked for beside it.

    It is fitted with the causes that were found, but for those that a rotor may imitate.

    Args:
        richer: The model.
        found: What was found with the actuator as it is stated.
        left: What that leaves [nat per row], from `left_over`.
        study: Training recordings with the richer actuator.
    """
    causes = [cause.name for cause in (*found.effects, *found.suspected)]
    kept = [name for name in causes if effect_of(name) not in ROTOR_LIKE]
    worlds = SearchWorlds(study)
    floors = floors_of(worlds, kept)
    columns = (*study.fit_columns(richer.model), *worlds.built_columns)
    start = start_fits(worlds, [((), {c: study.base_value(c) for c in columns})], floors)
    (fit,) = refit(worlds, start, floors, iterations=FIRST_STEPS)
    fit = with_effects(worlds, fit, kept, floors)
    return left - left_over(study, values_of(worlds, fit.columns, fit.place)) > PRICE


def says_more(found: Diagnosis, richer: Diagnosis, gain: float, numbers: int) -> bool:
    """Tell whether a richer actuator is the answer: it brings a price for each number more.

    Args:
        found: What was found with the actuator as it is stated.
        richer: What was found with the richer one.
        gain: By how much less the richer one leaves [nat per row], from `left_over`.
        numbers: How many numbers of the actuator it fits more.
    """
    more = numbers + numbers_of(richer) - numbers_of(found)
    return gain > PRICE * max(1, more)


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
