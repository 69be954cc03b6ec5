"""Plain models that a reader would try first: an answer has to predict unseen parts better."""

from collections.abc import Sequence

from tendon_newton.diagnosis.findings import PlainModel
from tendon_newton.diagnosis.search.fixed_set import with_effects
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, values_of

PLAIN_MODELS: dict[str, tuple[str, ...]] = {
    "nothing but the motor's own numbers": (),
    "lag, delay, deadband and offset": (
        "actuator_lag",
        "command_delay",
        "deadband",
        "position_offset",
    ),
    "Coulomb and viscous friction": ("coulomb_friction", "viscous_friction"),
    "friction by load and viscous": ("load_dependent_friction", "viscous_friction"),
    "gear friction by load, viscous, and a sagging supply": (
        "gear_load_friction",
        "viscous_friction",
        "voltage_sag",
    ),
    "Stribeck and viscous friction, and lag": (
        "stribeck_friction",
        "viscous_friction",
        "actuator_lag",
    ),
}
"""What it is called -> its effects. The four numbers of the second are those that servo models of
robot learning fit; the frictions are those of published servo identifications."""


def fit_plain_models(pool: Pool, names: Sequence[str]) -> dict[str, Fit]:
    """Fit the plain models whose effects recordings can show, and keep them in a pool.

    Each begins from the best set there that has some of its effects and no other, at best itself.

    Args:
        pool: Has the fits of all rows.
        names: Effects that may be named.
    """
    known, fitted = pool.worlds.study.known, dict[str, frozenset[str]]()
    for label, effects in PLAIN_MODELS.items():
        asked = [e for e in effects if e in names and e not in known]
        key = frozenset(asked)
        if key in fitted.values():
            continue
        fitted[label] = key
        begin = min((f for k, f in pool.fits.items() if k <= key), key=lambda f: f.score)
        missing = [e for e in asked if e not in begin.names]
        pool.add([with_effects(pool.worlds, begin, missing, pool.floors)])
    return {label: pool.fits[key] for label, key in fitted.items() if key in pool.fits}


def compare_plain_models(pool: Pool, fits: dict[str, Fit]) -> tuple[PlainModel, ...]:
    """Score plain models on parts that no number has seen, the best first.

    Args:
        pool: Has the fits of all rows, and the instant at which the time is over.
        fits: What they are called -> their fits.
    """
    out = []
    for label, fit in fits.items():
        terms = pool.unseen_terms(fit, pool.until)
        if terms is not None:
            values = values_of(pool.worlds, fit.columns, fit.place)
            held_out = float(terms.sum())
            out.append(PlainModel(name=label, effects=fit.names, values=values, held_out=held_out))
    return tuple(sorted(out, key=lambda model: model.held_out))
