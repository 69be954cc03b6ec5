"""Plain models that a reader would try first: an answer has to predict unseen parts better."""

from collections.abc import Collection, Mapping, Sequence

from tendon_newton.diagnosis.findings import PlainModel
from tendon_newton.diagnosis.search.fixed_set import FIRST_STEPS, with_effects
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits, values_of
from tendon_newton.diagnosis.search.small_sets import fit_small_sets
from tendon_newton.diagnosis.search.starts import starts_of_relative
from tendon_newton.effects import special_cases

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
    "Stribeck and viscous friction, and lag": (
        "stribeck_friction",
        "viscous_friction",
        "actuator_lag",
    ),
}
"""What it is called -> its effects. The four numbers of the second are those that servo models of
robot learning fit (Tan et al., Sim-to-real: learning agile locomotion, 2018). The frictions are
those of servo identification (Armstrong-Helouvry et al., A survey of models, 1994)."""
LAWS = (
    "command_delay", "actuator_lag", "deadband", "position_offset", "speed_limit", "gain_error",
    "coulomb_friction", "viscous_friction", "stribeck_friction", "load_dependent_friction",
)  # fmt: skip
"""Effects of these models and of data sheets: the best sets of three at most are plain models."""


def fit_plain_models(pool: Pool, names: Sequence[str]) -> dict[str, Fit]:
    """Fit plain models whose effects recordings can show, and keep them in a pool.

    Those of the table begin from the best set there that has some of their effects and no other, at
    best itself.

    Args:
        pool: Has the fits of all rows.
        names: Effects that may be named.

    Returns:
        What they are called -> their fits.
    """
    known, asked = pool.worlds.study.known, dict[frozenset[str], str]()
    small = fit_small_sets(pool, [name for name in LAWS if name in names and name not in known])
    for label, effects in PLAIN_MODELS.items():
        key = frozenset(e for e in effects if e in names and e not in known)
        if key not in asked:
            asked[key] = label
            fit_general_laws(pool, key)
            begin = min((f for k, f in pool.fits.items() if k <= key), key=lambda f: f.score)
            missing = [e for e in effects if e in key and e not in begin.names]
            pool.add([with_effects(pool.worlds, begin, missing, pool.floors)])
    for fit in small:
        asked.setdefault(frozenset(fit.names), ", ".join(fit.names).replace("_", " "))
    return {label: pool.fits[key] for key, label in asked.items() if key in pool.fits}


def fit_general_laws(pool: Pool, key: Collection[str]) -> None:
    """Fit the sets in which laws of a plain model begin where their special cases ended.

    A law that holds another then never explains less than that one.

    Args:
        pool: Has the fits of all rows.
        key: Effects of the plain model.
    """
    starts = [
        start
        for law in key
        for special in special_cases(law)
        for names, fit in pool.fits.items()
        if special in names and names - {special} < set(key)
        for start in starts_of_relative(pool, fit, special, law)
    ]
    found = start_fits(pool.worlds, starts, pool.floors, near=True)
    best = {frozenset(f.names): f for f in sorted(found, key=lambda f: -f.score)}
    pool.add(refit(pool.worlds, [*best.values()], pool.floors, iterations=FIRST_STEPS, coarse=0))


def compare_plain_models(pool: Pool, fits: Mapping[str, Fit]) -> tuple[PlainModel, ...]:
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
