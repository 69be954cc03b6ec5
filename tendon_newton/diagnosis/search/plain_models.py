"""Plain models that a reader would try first: an answer has to predict unseen parts better."""

from collections.abc import Sequence

from tendon_newton.diagnosis.findings import PlainModel
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits, values_of

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
STEPS = 6  # Steps of a plain model's fit at most


def fit_plain_models(pool: Pool, names: Sequence[str]) -> dict[str, Fit]:
    """Fit the plain models whose effects recordings can show, and keep them in a pool.

    Args:
        pool: Has the fits of all rows.
        names: Effects that may be named.
    """
    start, study = pool.fits[frozenset()], pool.worlds.study
    base = values_of(pool.worlds, start.columns, start.place)
    asked = {label: tuple(e for e in effects if e in names and e not in study.known)
             for label, effects in PLAIN_MODELS.items()}  # fmt: skip
    new = [e for e in dict.fromkeys(asked.values()) if frozenset(e) not in pool.fits]
    starts = [
        (effects, {**base, **{c: v for e in effects for c, v in atoms(study, e)[0].items()}})
        for effects in new
    ]
    found = start_fits(pool.worlds, starts, pool.floors)
    pool.add(refit(pool.worlds, found, pool.floors, iterations=STEPS, coarse=1))
    sets = {label: frozenset(effects) for label, effects in asked.items()}
    first = {key: label for label, key in reversed(sets.items())}
    return {label: pool.fits[key] for key, label in first.items() if key in pool.fits}


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
