"""From a survey to a set of causes: choose, refit jointly, look again from there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tendon_newton.diagnosis.search.choice import Chooser, Trial, choose
from tendon_newton.diagnosis.search.coordinates import is_shape
from tendon_newton.diagnosis.search.refit import (
    Fit,
    refit,
    rescored,
    start_fits,
    values_of,
    without,
)
from tendon_newton.diagnosis.search.survey import Survey, survey
from tendon_newton.diagnosis.search.worlds import Worlds
from tendon_newton.effects import find_effect
from tendon_newton.identification.objective import Scales

ROUGH_STEP, FINE_STEP = 1.0e-3, 5.0e-4
"""Simulation steps [s] while sets are chosen, and while they are compared."""
SETS = 6
SINGLES = 6
MOST_CAUSES = 7
ROUNDS = 5
RIVALS = 2
FORM_THETA, FORM_FORCE = 3.0e-3, 0.1
LEAST_THETA, LEAST_FORCE = 1.0e-3, 0.03


@dataclass
class Pool:
    """All sets that were fitted, the best place of each."""

    worlds: Worlds
    known: tuple[str, ...]
    fits: dict[frozenset[str], Fit] = field(default_factory=dict)
    log: Callable[[str], None] = lambda _: None

    def add(self, fits: Sequence[Fit]) -> None:
        """Keep fits that are better than those of the same causes."""
        for fit in fits:
            key = frozenset(fit.names)
            if key not in self.fits or fit.score < self.fits[key].score:
                self.fits[key] = fit

    def rescore(self, floors: Scales) -> None:
        """Score all sets at other floors."""
        keys = list(self.fits)
        for key, fit in zip(
            keys, rescored(self.worlds, list(self.fits.values()), floors), strict=True
        ):
            self.fits[key] = fit

    def best(self, price: float) -> Fit:
        """Return the best fit, its causes paid for."""
        return min(self.fits.values(), key=lambda f: f.score + price * len(f.names))


def is_dry(names: Sequence[str]) -> bool:
    """Tell whether some effects make a tendon stick."""
    return any(find_effect(n).dry or n == "joint_dry_friction" for n in names)


def floors_of(worlds: Worlds, names: Sequence[str]) -> Scales:
    """Return what noise and form errors leave with some effects in the model."""
    noise, scale = worlds.study.noise, worlds.study.scale
    theta, force = (FORM_THETA, FORM_FORCE) if is_dry(names) else (LEAST_THETA, LEAST_FORCE)
    return Scales(
        theta=float(np.hypot(noise.theta, theta * scale.turn)),
        force=float(np.hypot(noise.force or 0.0, force * scale.force)),
    )


def start_of(
    worlds: Worlds, view: Survey, trial: Trial
) -> tuple[tuple[str, ...], dict[int, float]]:
    """Return a set's causes and the values to start its fit from, column -> value."""
    fit = view.fit
    table = worlds.study.table
    place = dict(zip(fit.columns, fit.place, strict=True))
    gone = {c for name in trial.removed for c in table.columns(name)}
    for i, x in trial.coefficients.items():
        column = view.columns[i]
        if column.kind == "slope":
            for c in column.values:
                place[c] = place[c] + x
    values = {c: worlds.coordinate(c).value(float(u)) for c, u in place.items() if c not in gone}
    names = [n for n in fit.names if n not in trial.removed]
    for i in trial.added:
        column = view.columns[i]
        names.append(column.name)
        x = trial.coefficients[i]
        for c, value in column.values.items():
            coordinate = worlds.coordinate(c)
            if not is_shape(worlds.study.parameter(c)) or len(column.values) == 1:
                if worlds.study.parameter(c).name != "position":
                    u = np.clip(x * coordinate.place(value), coordinate.lower, coordinate.upper)
                    value = coordinate.value(float(u))
            values[c] = value
    return tuple(names), values


def halve(
    worlds: Worlds, fits: list[Fit], floors: Scales, price: float, *, coarse: int, keep: int = 2
) -> list[Fit]:
    """Refit sets jointly, following fewer the longer it takes, best first."""
    fits = refit(worlds, fits, floors, iterations=2, coarse=coarse)
    fits.sort(key=lambda f: f.score + price * len(f.names))
    for count in (2 * keep, keep):
        fits[:count] = refit(worlds, fits[:count], floors, iterations=2, coarse=0)
        fits.sort(key=lambda f: f.score + price * len(f.names))
    return fits


def find(
    worlds: Worlds,
    fit_columns: Sequence[int],
    names: Sequence[str],
    known: Sequence[str],
    price: float,
    log: Callable[[str], None] = lambda _: None,
) -> tuple[Pool, Fit]:
    """Find the set of causes that a study asks for.

    Args:
        worlds: Simulates candidates.
        fit_columns: The model's own unknown numbers.
        names: Effects that may be named.
        known: Effects of the starting model.
        price: Gain in score [nat per row] that a cause must bring.
        log: Told what is done.
    """
    pool = Pool(worlds=worlds, known=tuple(known), log=log)
    wet = floors_of(worlds, known)
    base = {c: worlds.study.base_value(c) for c in fit_columns}
    baseline = start_fits(worlds, [((), base)], wet, ROUGH_STEP)
    baseline = refit(worlds, baseline, wet, iterations=8)
    pool.add(baseline)
    current = baseline[0]
    for step in range(ROUNDS):
        share = 1.0 if step == 0 else 0.99
        log(f"round {step}: {describe(worlds, current)} worlds {worlds.count}")
        view = survey(worlds, current, names, wet, share)
        trials = choose(view, price, MOST_CAUSES, SETS)
        trials += Chooser(view, price, MOST_CAUSES).singles(SINGLES if step == 0 else 2)
        starts = {}
        for trial in trials:
            found, values = start_of(worlds, view, trial)
            if frozenset(found) not in pool.fits:
                starts.setdefault(frozenset(found), (found, values))
        if not starts:
            break
        fits = start_fits(worlds, list(starts.values()), wet, ROUGH_STEP)
        fits = halve(worlds, fits, wet, price, coarse=2 if step == 0 else 1)
        for f in fits:
            log(f"    fit {describe(worlds, f)}")
        pool.add(fits)
        best = pool.best(price)
        if best is current:
            break
        gain = current.score + price * len(current.names) - best.score - price * len(best.names)
        current = best
        if is_dry((*known, *current.names)) and wet != floors_of(worlds, (*known, *current.names)):
            wet = floors_of(worlds, (*known, *current.names))
            pool.rescore(wet)
            current = pool.best(price)
        if gain < 0.5 * price:
            break
    return pool, current


def prune(
    worlds: Worlds, pool: Pool, fit: Fit, floors: Scales, price: float
) -> tuple[Fit, dict[str, float]]:
    """Drop causes that do not pay, by real refits of all others.

    Returns:
        What stays, and for each of its causes the score lost without it [nat per row].
    """
    while fit.names:
        starts = [without(fit, name, worlds) for name in fit.names]
        less = start_fits(worlds, starts, floors, fit.time_step)
        less = refit(worlds, less, floors, iterations=2, coarse=0)
        open_ = [i for i, f in enumerate(less) if f.score - fit.score < 6.0 * price]
        again = refit(worlds, [less[i] for i in open_], floors, iterations=3, coarse=0)
        for i, f in zip(open_, again, strict=True):
            less[i] = f
        pool.add(less)
        losses = {n: f.score - fit.score for n, f in zip(fit.names, less, strict=True)}
        pool.log("    losses " + " ".join(f"{n}={v:.3f}" for n, v in losses.items()))
        name = min(losses, key=lambda n: losses[n])
        if losses[name] >= price:
            return fit, losses
        fit = less[fit.names.index(name)]
    return fit, {}


def exchange(
    worlds: Worlds, pool: Pool, fit: Fit, names: Sequence[str], floors: Scales, price: float
) -> list[Fit]:
    """Refit sets in which another cause stands in the place of each."""
    view = survey(worlds, fit, names, floors, 0.99)
    chooser = Chooser(view, price, MOST_CAUSES)
    starts = {}
    for name in fit.names:
        ranked: dict[str, Trial] = {}
        for atom in chooser.atoms:
            trial = chooser.solve([atom], [name])
            rival = view.columns[atom].name
            if rival not in ranked or trial.score < ranked[rival].score:
                ranked[rival] = trial
        for trial in sorted(ranked.values(), key=lambda t: t.score)[:RIVALS]:
            found, values = start_of(worlds, view, trial)
            if frozenset(found) not in pool.fits:
                starts.setdefault(frozenset(found), (found, values))
    fits = start_fits(worlds, list(starts.values()), floors, fit.time_step)
    fits = halve(worlds, fits, floors, price, coarse=0, keep=3)
    pool.add(fits)
    return fits


def search(worlds, fit_columns, names, known, price, log):
    pool, fit = find(worlds, fit_columns, names, known, price, log)
    for turn in range(3):
        floors = floors_of(worlds, (*known, *fit.names))
        pool.rescore(floors)
        fit = pool.fits[frozenset(fit.names)]
        fit, losses = prune(worlds, pool, fit, floors, price)
        log(f"pruned {describe(worlds, fit)} worlds {worlds.count}")
        if not fit.names:
            break
        rivals = exchange(worlds, pool, fit, names, floors, price)
        for f in rivals[:5]:
            log(f"    rival {describe(worlds, f)}")
        best = pool.best(price)
        if (
            best is fit
            or best.score + price * len(best.names) > fit.score + price * len(fit.names) - 0.01
        ):
            break
        fit = best
    return pool, fit, losses


def describe(worlds: Worlds, fit: Fit) -> str:
    """Say a fit in one line."""
    values = values_of(worlds, fit.columns, fit.place)
    owners = worlds.study.table.owners
    text = " ".join(f"{owners[c][0]}.{owners[c][1].name}={v:.4g}" for c, v in values.items())
    return f"{fit.score:.3f} th {1e3 * fit.scales.theta:.2f} F {fit.scales.force:.3f} | {text}"
