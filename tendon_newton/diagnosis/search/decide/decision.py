"""May a cause be named? One rule, on all rows."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tendon_newton.diagnosis.findings import Found, PlainModel
from tendon_newton.diagnosis.search.choice import Chooser
from tendon_newton.diagnosis.search.coordinates import is_shape
from tendon_newton.diagnosis.search.decide.plain_models import (
    PLAIN_MODELS,
    compare_plain_models,
    fit_plain_models,
)
from tendon_newton.diagnosis.search.fixed_set import LAST_STEPS
from tendon_newton.diagnosis.search.floors import least_scales, usual_form
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.prune import (
    CLEAR,
    FAR,
    FOLLOWED,
    follow_near,
    leave_out,
    prune,
    settle,
    simplest,
)
from tendon_newton.diagnosis.search.refit import (
    Fit,
    offsets,
    refit,
    start_fits,
    values_of,
    without,
)
from tendon_newton.diagnosis.search.rule import LADDER, SURE
from tendon_newton.diagnosis.search.search_worlds import Floors
from tendon_newton.diagnosis.search.starts import Start, new_starts, starts_of_relative
from tendon_newton.diagnosis.search.strategy import follow, grow
from tendon_newton.diagnosis.search.survey import survey
from tendon_newton.diagnosis.search.unseen_parts import terms
from tendon_newton.effects import are_confused, are_one_friction, are_related, special_cases

FAMILY = 5.0
"""How much further behind than others a law of the same friction may stay and replace one [1]."""
PREDICTORS = 3
"""Sets of least score that are asked how they predict parts that no number has seen, plain models
aside."""
FURTHER = 6  # Causes by which the set that predicts best grows at most
LEAST_SHARED = 2
"""Stated numbers off by more than their tolerances from which one cause is tried in their place."""
FEW_RIVALS = 2
"""Most sets with another cause in the place of one that are refitted on all rows, or told as its
rivals."""


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """What kept a cause from being named that had been found."""

    gain: float  # What it was worth on parts that no number has seen [nat per row]
    at_bound: bool = False  # Whether a number of it ended at the edge of its range


@dataclass(frozen=True, kw_only=True)
class Decided:
    """The causes that may be named, and what each is worth."""

    fit: Fit
    losses: dict[str, float] = field(default_factory=dict[str, float])
    """Score lost without each [nat per row]."""
    held_out: dict[str, float] = field(default_factory=dict[str, float])
    """Score lost without each on parts that no number has seen [nat per row]."""
    rivals: dict[str, tuple[Fit, ...]] = field(default_factory=dict[str, tuple[Fit, ...]])
    """Fits with another cause in the place of each that explain the data as well."""
    refused: dict[str, Refusal] = field(default_factory=dict[str, Refusal])
    """Causes that were dropped."""
    plain: tuple[PlainModel, ...] = ()  # Plain models beside it, the best on unseen parts first
    predictor: Fit | None = None
    """The set that predicts parts best that no number has seen, its causes deserved or not; None
    where nobody asked."""
    predicts: float | None = None  # Negative log likelihood of that set per row of such parts [nat]
    told: Mapping[str, float] = field(default_factory=dict[str, float])
    """Causes of the fit that are stated numbers out of their tolerances, by how many of these."""
    undecided: tuple[str, ...] = ()
    """Causes whose worth on such parts was not known when the time was over: they are not named."""


def transfer(pool: Pool, fits: Sequence[Fit], decisive: Pool) -> list[Fit]:
    """Refit sets on all rows, from where they were on the beginnings.

    The first, which is to be named, is followed twice as far. Those that are far worse than the
    first there are left as they are.
    """
    starts = [(f.names, values_of(pool.worlds, f.columns, f.place)) for f in fits]
    found = start_fits(decisive.worlds, starts, decisive.floors, near=True)
    decisive.worlds.bench_slopes = {}
    found[:1] = refit(decisive.worlds, found[:1], decisive.floors, iterations=4, coarse=0)
    worst = found[0].score + FAR * decisive.price
    near = [i for i, f in enumerate(found[1:], start=1) if f.score < worst]
    again = refit(
        decisive.worlds, [found[i] for i in near], decisive.floors, iterations=2, coarse=0
    )
    for i, f in zip(near, again, strict=True):
        found[i] = f
    decisive.add(found)
    return found


def rivals_of(pool: Pool, fit: Fit, name: str, prices: float = 1.0) -> list[Fit]:
    """Return the best fits with another cause in the place of one, few prices behind at most.

    A special case of the cause is among them however many others are better.
    """
    rest = frozenset(fit.names) - {name}
    found = [
        f for f in pool.fits.values()
        if len(f.names) == len(fit.names) and rest < frozenset(f.names) and name not in f.names
    ]  # fmt: skip
    near = [f for f in found
            if pool.gain(fit, f) < prices * room(pool, name, new_name(fit, f))]  # fmt: skip
    near.sort(key=lambda f: pool.gain(fit, f))
    plainer = special_cases(name)
    return [f for i, f in enumerate(near) if i < FEW_RIVALS or new_name(fit, f) in plainer]


def decide(pool: Pool, fit: Fit, decisive: Pool, names: Sequence[str]) -> Decided:
    """Put causes found on beginnings to the test on all rows.

    What may be named of a plain model takes their place if that model predicts parts better that no
    number has seen.

    Args:
        pool: Sets fitted on the beginnings.
        fit: What was found there.
        decisive: Takes the fits of all rows; the same pool where sets were looked for there, too.
        names: Effects that may be named.
    """
    close = [r for name in fit.names for r in rivals_of(pool, fit, name, CLEAR)]
    if decisive is pool:
        pool.add(refit(pool.worlds, close, pool.floors, iterations=2, coarse=0))
    else:
        near = [*leave_out(pool, fit).values(), *close]
        near += [f for name in fit.names for f in with_special_case(pool, fit, name)]
        sets = {frozenset(f.names): f for f in near}
        decisive.rescore(fit, values_of(pool.worlds, fit.columns, fit.place))
        transfer(pool, [fit, *sets.values()], decisive)
    plain: dict[str, Fit] = {}
    if not pool.is_late and asks_plain_models(decisive, decisive.best()):
        plain = fit_plain_models(decisive, names)
    fit_shared(decisive, decisive.best(), names)
    best = followed_to_end(decisive, decisive.best())
    for name in best.names:
        fit_special_cases(decisive, best, name)
    decided = tested(decisive, prune(decisive, simplest(decisive, best)), names)
    if decided.undecided:
        return decided
    if asks_plain_models(decisive, decided.fit):
        plain = plain or fit_plain_models(decisive, names)
        decided = beside_plain_models(decisive, decided, plain, names)
    elif leaves_nothing_at_any_step(
        decisive, decided.fit, anywhere=True, usual=not decided.fit.names
    ):
        return decided
    grown = with_predictor(decisive, decided, plain, names)
    further = searched_further(decisive, grown, names)
    return grown if further is grown else with_predictor(decisive, further, plain, names)


def searched_further(decisive: Pool, decided: Decided, names: Sequence[str]) -> Decided:
    """Return what the search finds from the best set, where that is ahead of an answer by a price.

    Rivals, plain models and what predicts best lead to sets that no survey had promised. What they
    lead to, its numbers paid for, must predict parts no worse that no number has seen.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        names: Effects that may be named.
    """

    def ahead(fit: Fit) -> bool:
        return decisive.cost(decided.fit) - decisive.cost(fit) >= decisive.price

    def unseen(fit: Fit) -> float:
        return predicted(decisive, fit) + decisive.price * decisive.numbers(fit)

    best = decisive.best()
    known = {*decided.fit.names, *decided.refused}
    if decisive.is_late or known.issuperset(best.names) or not ahead(best):
        return decided
    found = tested(decisive, settle(decisive, grow(decisive, names, lambda _: None), names), names)
    if found.undecided or not ahead(found.fit):
        return decided
    if unseen(found.fit) > unseen(decided.fit):
        return decided
    return replace(found, refused={**decided.refused, **found.refused}, plain=decided.plain)


def leaves_nothing_at_any_step(
    pool: Pool, fit: Fit, *, anywhere: bool = False, usual: bool = True
) -> bool:
    """Tell whether a fit leaves nothing, at the search's step or at the finest one.

    Args:
        pool: Has the fits of all rows.
        fit: The fit.
        anywhere: As of `Pool.leaves_nothing`, like the next.
        usual: Whether all that laws usually miss counts as nothing.
    """
    if pool.leaves_nothing(fit, anywhere=anywhere, usual=usual):
        return True
    values = values_of(pool.worlds, fit.columns, fit.place)
    finest = replace(fit, residual=pool.worlds.finest(values))
    return pool.leaves_nothing(finest, anywhere=anywhere, usual=usual)


def beside_plain_models(
    decisive: Pool, decided: Decided, plain: Mapping[str, Fit], names: Sequence[str]
) -> Decided:
    """Return an answer with plain models beside it, or what may be named of one in its place.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        plain: What plain models are called -> their fits.
        names: Effects that may be named.
    """
    predicts = predicted(decisive, decided.fit)
    compared = compare_plain_models(decisive, plain)
    is_left = not decisive.leaves_nothing(decided.fit, usual=True)
    rivals = [m for m in compared if is_left or m.name in PLAIN_MODELS]
    if rivals and rivals[0].held_out < predicts:
        other = tested(decisive, prune(decisive, plain[rivals[0].name]), names)
        if not other.undecided:
            decided = replace(other, refused={**decided.refused, **other.refused})
    return replace(decided, plain=compared)


def with_predictor(
    decisive: Pool, decided: Decided, plain: Mapping[str, Fit], names: Sequence[str]
) -> Decided:
    """Return an answer with the set that predicts best, grown from it by one cause after the other.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        plain: What plain models are called -> their fits.
        names: Effects that may be named.
    """
    best, predicts = best_predictor(decisive, decided, plain)
    for _ in range(FURTHER):
        names = look_further(decisive, best, names)
        before = best
        best, predicts = best_predictor(decisive, decided, plain)
        if frozenset(best.names) == frozenset(before.names):
            break
    return replace(decided, predictor=best, predicts=predicts)


def look_further(decisive: Pool, fit: Fit, names: Sequence[str]) -> list[str]:
    """Fit the sets with one cause more than a set that promise most; return who promises its cost.

    Whoever promises less around one set is not looked at around the next.
    """
    if decisive.is_late:
        return []
    view = survey(decisive.worlds, fit, names, decisive.floors)
    chooser = Chooser(view, cost_of_choice(decisive, fit), len(names))
    bar, singles = chooser.cost(chooser.solve((), ())), chooser.singles(len(names))
    follow(decisive, view, new_starts(decisive, view, singles[:PREDICTORS]), coarse=0)
    return [view.columns[t.added[0]].name for t in singles if chooser.cost(t) < bar]


def fit_shared(decisive: Pool, fit: Fit, names: Sequence[str]) -> None:
    """Fit the sets in which one cause takes the place of what several stated numbers share.

    A gain that is wrong may be spread over the cell, the spool and the springs: all that is stated
    goes back, causes that are stated numbers go, and one cause begins where it means nothing.

    Args:
        decisive: Has the fits of all rows.
        fit: The set.
        names: Effects that may be named.
    """
    worlds, table = decisive.worlds, decisive.worlds.study.table
    stated = [n for n in fit.names if decisive.is_stated(n)]
    moved = np.count_nonzero(np.abs(offsets(worlds, fit)) > 1.0)
    if moved + len(stated) < LEAST_SHARED:
        return
    rest = tuple(n for n in fit.names if n not in stated)
    values = values_of(worlds, fit.columns, fit.place)
    back = {c: worlds.study.base_value(c) for c, spread
            in zip(fit.columns, worlds.spreads(fit.columns, rest), strict=True)
            if np.isfinite(spread)}  # fmt: skip
    starts = list[Start]()
    for name in names:
        own = table.columns(name)
        is_scale = len(own) == 1 and worlds.study.parameter(own[0]).null == 1.0
        if is_scale and not any(name == n or are_related(name, n) for n in rest):
            start = {**values, **back, **{c: worlds.study.base_value(c) for c in own}}
            starts.append(((*rest, name), start))
    found = start_fits(worlds, starts, decisive.floors, near=True)
    decisive.add(refit(worlds, found, decisive.floors, iterations=FOLLOWED, coarse=0))


def asks_plain_models(decisive: Pool, fit: Fit) -> bool:
    """Tell whether a plain model may predict better than an answer by more than chance.

    Where forces are measured, an answer that leaves nothing in rows or in their mean is taken.
    Angles alone leave more open, so a cause that was named from them is held against plain models.
    """
    if not fit.names:
        return not decisive.leaves_nothing(fit, usual=True)
    has_force = any(signal == "force" for signal, _ in decisive.worlds.where.signals)
    return not (has_force and decisive.leaves_nothing(fit, anywhere=True, usual=True))


def predicted(decisive: Pool, fit: Fit) -> float:
    """Return a set's score on parts that no number has seen [nat per row]."""
    found = decisive.unseen_terms(fit)
    assert found is not None  # without a limit of time
    return float(found.sum())


def best_predictor(
    decisive: Pool, decided: Decided, plain: Mapping[str, Fit] | None = None
) -> tuple[Fit, float]:
    """Return the set that predicts parts best that no number has seen, and its score there.

    What helps there helps whoever simulates, though it is worth less than a name costs: to explain
    and to predict are two things. Each cause of the answer stays; it may have none. A number that
    comes to the answer, or to a published plain model, costs what choosing it out of the catalogue
    does (see `cost_of_choice`): nobody chose these for what they predict here.

    Args:
        decisive: Has the fits of all rows.
        decided: The causes that may be named.
        plain: What plain models are called -> their fits.
    """
    answer, plain = decided.fit, plain or {}
    choice = cost_of_choice(decisive, answer)
    given = [answer, *(plain[name] for name in PLAIN_MODELS if name in plain)]

    def cost(fit: Fit) -> float:
        added = [set(fit.names) - set(f.names) for f in given if set(f.names) <= set(fit.names)]
        return choice * min(sum(map(decisive.bar, names)) for names in added) / decisive.price

    beyond = {name for name, refusal in decided.refused.items() if refusal.at_bound}
    sets = [
        f for f in decisive.fits.values()
        if set(answer.names) < set(f.names) and not beyond & set(f.names)
        and not any(at_bound(decisive, f, n) or is_nothing(decisive, f, n) for n in f.names)
    ]  # fmt: skip
    sets.sort(key=lambda f: f.score + cost(f))
    known = {frozenset(f.names) for f in plain.values()}
    near = [followed(decisive, f) for f in sets[:PREDICTORS]]
    near = [f for f in near if not any(is_nothing(decisive, f, n) for n in f.names)]
    near += [f for f in sets[PREDICTORS:] if frozenset(f.names) in known]
    best, predicts = answer, predicted(decisive, answer)
    for fit in near:
        found = decisive.unseen_terms(fit, decisive.until)
        if found is not None and found.sum() + cost(fit) < predicts + cost(best):
            best, predicts = fit, float(found.sum())
    return best, predicts


def cost_of_choice(decisive: Pool, fit: Fit) -> float:
    """Return what a number costs that is chosen for what it predicts [nat per row].

    The best of n causes that are nothing gains about log(n) nat of what the rows tell together.

    Source: Foster and George, The risk inflation criterion for multiple regression (1994).
    """
    alone = decisive.worlds.rows_alone(fit.residual, decisive.floors)
    return float(np.log(len(decisive.worlds.study.table.effects))) / alone


def tested(decisive: Pool, final: Fit, names: Sequence[str]) -> Decided:
    """Return what is left of a set once causes are gone that do not help on unseen parts.

    Args:
        decisive: Has the fits of all rows.
        final: The set.
        names: Effects that may be named.
    """
    refused: dict[str, Refusal] = {}
    undecided: list[str] = []
    while final.names:
        ended = [n for n in final.names if at_bound(decisive, final, n)]
        gains = held_out_gains(decisive, final, ended or final.names)
        if not gains:
            undecided += final.names
            final = decisive.fits[frozenset()]
            break
        worths = {n: gain / decisive.bar(n) for n, gain in gains.items()}
        worst = min(worths, key=lambda n: worths[n])
        refusal = Refusal(gain=gains[worst], at_bound=worst in ended)
        if not ended and worths[worst] >= 1.0:
            if undone := [n for n in final.names if n not in gains]:
                undecided += undone
                final = prune(decisive, less_of(decisive, final, undone))
                continue
            found = Decided(fit=final, refused=refused, undecided=tuple(undecided))
            return with_worths(found, decisive, gains, names)
        refused[worst] = refusal
        rest = special_case_or_without(decisive, final, worst)
        final = prune(decisive, best_without(decisive, rest, refused))
    return Decided(fit=final, refused=refused, undecided=tuple(undecided))


def with_worths(
    decided: Decided, decisive: Pool, gains: Mapping[str, float], names: Sequence[str]
) -> Decided:
    """Return causes that may be named with what each is worth, and with its rivals.

    Args:
        decided: The causes.
        decisive: Has the fits of all rows.
        gains: Worth of each on parts that no number has seen [nat per row].
        names: Effects that may be named.
    """
    fit = decided.fit
    less = leave_out(decisive, fit)
    fit_replacements(decisive, fit, names)
    return replace(
        decided,
        losses={n: decisive.gain(fit, f) for n, f in less.items()},
        held_out=dict(gains),
        rivals={n: close_rivals(decisive, fit, n) for n in fit.names},
    )


def fit_replacements(decisive: Pool, fit: Fit, names: Sequence[str]) -> None:
    """Fit the sets in which a cause that replaced one elsewhere takes its place here.

    So are causes that are easily confused, and forms of one friction where something is left. Each
    set is followed while it may come as close as a rival.

    Args:
        decisive: Has the fits of all rows.
        fit: The set.
        names: Effects that may be named.
    """
    starts, table = list[Start](), decisive.worlds.study.table
    is_left = not decisive.leaves_nothing(fit, usual=True)
    for name in fit.names:
        rest, values = without(fit, name, decisive.worlds)
        for other, (behind, source) in replacing(decisive, fit, name).items():
            known = decisive.fits.get(frozenset((*rest, other)))
            if known is None or decisive.gain(fit, known) > behind + decisive.price:
                found = values_of(decisive.worlds, source.columns, source.place)
                own = {c: found[c] for c in table.columns(other)}
                starts.append(((*rest, other), {**values, **own}))
        for other in names:
            is_asked = are_confused(name, other) or (is_left and are_one_friction(name, other))
            is_known = frozenset((*rest, other)) in decisive.fits
            if is_asked and not is_known and not any(are_related(other, n) for n in rest):
                starts += starts_of_relative(decisive, fit, name, other)
    begun = start_fits(decisive.worlds, starts, decisive.floors, near=True)
    best = [*{frozenset(f.names): f for f in sorted(begun, key=lambda f: -f.score)}.values()]
    found = refit(decisive.worlds, best, decisive.floors, iterations=2, coarse=0)
    limits = [fit.score + room(decisive, new_name(f, fit), new_name(fit, f)) for f in found]
    decisive.add(follow_near(decisive, found, np.array(limits), FOLLOWED))


def replacing(decisive: Pool, fit: Fit, name: str) -> dict[str, tuple[float, Fit]]:
    """Return the causes that replace one in some set at little cost [nat per row], and that set.

    The set holds the other causes of the fit, and perhaps more.
    """
    rest, found = frozenset(fit.names) - {name}, dict[str, tuple[float, Fit]]()
    for key, other in decisive.fits.items():
        for rival in key - rest if rest < key and name not in key else ():
            own = decisive.fits.get((key - {rival}) | {name})
            if own is None or any(are_related(rival, kept) for kept in rest):
                continue
            behind = decisive.gain(own, other)
            if behind < room(decisive, name, rival) and behind < found.get(rival, (np.inf,))[0]:
                found[rival] = (behind, other)
    return found


def room(pool: Pool, name: str, rival: str) -> float:
    """Return by how much a set may be behind with a rival in a cause's place [nat per row].

    Laws of one friction differ by less than real friction does from either.
    """
    return (FAMILY if are_one_friction(name, rival) else 1.0) * pool.dearest


def best_without(decisive: Pool, rest: Fit, refused: Collection[str]) -> Fit:
    """Return the best set that holds no refused cause: another may take the place of one.

    Args:
        decisive: Has the fits of all rows.
        rest: What is left of the set whose cause was refused last.
        refused: Causes that may not be named.
    """
    free = [f for f in decisive.fits.values() if not set(f.names) & set(refused)]
    return followed(decisive, min([rest, *free], key=decisive.cost))


def special_case_or_without(decisive: Pool, fit: Fit, name: str) -> Fit:
    """Return a set with a special case in the place of a law; where it has none, without it.

    It is followed to its optimum.
    """
    fit_special_cases(decisive, fit, name)
    known = with_special_case(decisive, fit, name)
    return followed(
        decisive, min(known, key=decisive.cost) if known else leave_out(decisive, fit)[name]
    )


def fit_special_cases(decisive: Pool, fit: Fit, name: str) -> None:
    """Fit the special cases of a law in its place, from where it stands.

    One that was fitted before starts anew where the law leads to a better place.
    """
    starts = [start for special in special_cases(name)
              for start in starts_of_relative(decisive, fit, name, special)]  # fmt: skip
    begun = start_fits(decisive.worlds, starts, decisive.floors, near=True)
    best = {frozenset(f.names): f for f in sorted(begun, key=lambda f: -f.score)}
    new = [f for key, f in best.items()
           if key not in decisive.fits or f.score < decisive.fits[key].score]  # fmt: skip
    decisive.add(refit(decisive.worlds, new, decisive.floors, iterations=2, coarse=0))


def with_special_case(pool: Pool, fit: Fit, name: str) -> list[Fit]:
    """Return the known sets in which a special case stands in the place of a law."""
    rest = frozenset(fit.names) - {name}
    sets = [rest | {special} for special in special_cases(name)]
    return [pool.fits[key] for key in sets if key in pool.fits]


def special_case_left_open(pool: Pool, fit: Fit, found: Found, name: str) -> list[Fit]:
    """Return the known sets with a law's special case in its place that its form does not exclude.

    Dry friction whose bristles bend over the shortest travel that the law has is dry friction: an
    interval that holds that end leaves both.

    Args:
        pool: Has the fits of all rows.
        fit: The set.
        found: Numbers of the set with their intervals.
        name: The law.
    """
    study = pool.worlds.study
    forms = [(c, p) for c in study.table.columns(name)
             if is_shape(p := study.parameter(c)) and not p.optional]  # fmt: skip
    is_open = any(found.intervals[column][0] <= form.lower for column, form in forms)
    return with_special_case(pool, fit, name) if is_open else []


def less_of(decisive: Pool, fit: Fit, names: Sequence[str]) -> Fit:
    """Return a set refitted without several of its causes."""
    for name in names:
        rest, values = without(fit, name, decisive.worlds)
        (fit,) = start_fits(decisive.worlds, [(rest, values)], decisive.floors, near=True)
    return followed(decisive, fit)


def followed(decisive: Pool, fit: Fit) -> Fit:
    """Return a set at its optimum: while it was clearly worse it was left where it began."""
    decisive.add(refit(decisive.worlds, [fit], decisive.floors, iterations=FOLLOWED, coarse=0))
    return decisive.fits[frozenset(fit.names)]


def followed_to_end(decisive: Pool, fit: Fit) -> Fit:
    """Return the best set once one was followed from long differences, as at a first look.

    Short differences say where something happened to stick, so a descent by them may end early.
    """
    start = fit.names, values_of(decisive.worlds, fit.columns, fit.place)
    begun = start_fits(decisive.worlds, [start], decisive.floors)
    decisive.add(refit(decisive.worlds, begun, decisive.floors, iterations=LAST_STEPS, coarse=0))
    return decisive.best()


def held_out_gains(decisive: Pool, fit: Fit, names: Sequence[str]) -> dict[str, float]:
    """Return what causes are worth on parts that no number has seen [nat per row].

    What is stated counts as on all rows. A set that saw a part does better there than one that did
    not. Where the set without a cause is far behind even on parts that it saw, it is not refitted
    without each part. The gain that is returned is then a lower bound. The others are refitted in
    the order of that bound. The first one that is not worth its price ends this, since the set is
    not named then. The end of the time does so too; the set itself is not subject to it.

    Args:
        decisive: Has the fits of all rows.
        fit: The set.
        names: Causes of it that are asked for.

    Returns:
        Cause -> gain [nat per row]; only those that were found out.
    """
    worlds, floors = decisive.worlds, decisive.floors
    less = {n: f for n, f in leave_out(decisive, fit).items() if n in names}
    own = decisive.unseen_terms(fit)
    assert own is not None  # without a limit of time
    residuals = np.stack([f.residual for f in less.values()])
    score = worlds.score(residuals, floors)
    rows = dict(zip(less, terms(worlds, residuals, score.scales, floors), strict=True))
    stated = {n: decisive.surprise(f) - decisive.surprise(fit) for n, f in less.items()}
    least = {n: float((t - own).sum()) + stated[n] for n, t in rows.items()}
    bounds = {n: gain / decisive.bar(n) for n, gain in least.items()}
    gains = {n: least[n] for n in rows if bounds[n] >= SURE}
    for name in sorted((n for n in rows if n not in gains), key=lambda n: bounds[n]):
        found = decisive.unseen_terms(less[name], decisive.until)
        if found is None:
            break
        gains[name] = float((found - own).sum()) + stated[name]
        if gains[name] < decisive.bar(name):
            break
    return gains


def at_bound(pool: Pool, fit: Fit, name: str) -> bool:
    """Tell whether a number of a cause ended at the edge of its range, its null aside.

    A number that a model may leave out only gives a law its form; the edges are forms as well.
    """
    values = values_of(pool.worlds, fit.columns, fit.place)
    study = pool.worlds.study
    ends = [(values[c], study.parameter(c)) for c in study.table.columns(name)]
    return any(np.isclose(v, (p.lower, p.upper), rtol=1e-6, atol=0.0).any() and v != p.null
               for v, p in ends if not p.optional)  # fmt: skip


def is_nothing(pool: Pool, fit: Fit, name: str) -> bool:
    """Tell whether a cause ended as nothing: its first number vanished, or limits no more."""
    column = pool.worlds.study.table.columns(name)[0]
    return pool.worlds.coordinate(column).is_nothing(fit.place[fit.columns.index(column)])


def close_rivals(pool: Pool, fit: Fit, name: str) -> tuple[Fit, ...]:
    """Return the fits that the data cannot tell from one, another cause in a cause's place."""
    found = rivals_of(pool, fit, name)
    if not found:
        return ()
    floors = sharp(pool)
    residuals = np.stack([f.residual for f in (fit, *found)])
    score = pool.worlds.score(residuals, floors).value
    behind = (score[1:] - score[0]).tolist()
    return tuple(rival for rival, lost in zip(found, behind, strict=True)
                 if lost <= room(pool, name, new_name(fit, rival)))  # fmt: skip


def new_name(fit: Fit, rival: Fit) -> str:
    """Return the cause that a rival has and a fit has not."""
    return next(name for name in rival.names if name not in fit.names)


def sharp(pool: Pool) -> Floors:
    """Return the floors at which rivals are compared: noise, and little else."""
    study = pool.worlds.study
    return least_scales(study, usual_form(study), 1.0 / LADDER**2, pool.floors.rest)
