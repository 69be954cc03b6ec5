"""Sets of causes fitted jointly: Levenberg-Marquardt for many sets at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tendon_newton.data.recording import Array, Mask
from tendon_newton.diagnosis.search.floors import is_dry
from tendon_newton.diagnosis.search.search_worlds import Floors, SearchWorlds, trimmed_size
from tendon_newton.effects import law_of
from tendon_newton.identification.objective import loss_terms, loss_weights
from tendon_newton.identification.quadratic import bounded

DAMPING, BOLDER, FREE = 0.1, 0.03, 1.0e-4
"""First Marquardt factor of a fit, and the shares of its factor that are tried beside it [1]. A fit
goes on with the factor that led further; where none did, with a greater one. Hardly damped, a step
goes all the way along a valley in which one number does nearly what another does."""
SHARES = (1.0, BOLDER, FREE)
LEAST_DAMPING, MOST_DAMPING = 1.0e-3, 3.0  # Least and greatest factor [1]
STRIDES, STICKING = (0.01, 0.03), (0.02, 0.1)
"""The least and the first step of a finite difference, as shares of a coordinate and of a typical
size besides; and where something sticks. A short difference says where something happened to stick,
or to hit a stop, so differences are as long as the last step."""
SHORTER = 0.2  # A stride's share of the one before where that led no further
WAYS = tuple(side * 0.01 * 2.0**k for k in range(7) for side in (-1.0, 1.0))
"""How far the numbers at which a law switches are looked at, as logarithms of their ratios [1]."""
LEAST_GAIN, LEAST_NATS = 1.0e-3, 0.3
"""A step that lowers the loss per row, or that of all rows that tell something of their own, by
less is a fit's last [nat]: the price of a number is 12 nat where many rows tell."""
REACH = 2.0  # Typical sizes by which one step changes a number that is never zero


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A set of causes at one place."""

    names: tuple[str, ...]  # Effects whose numbers are free
    columns: tuple[int, ...]
    """Places of all free numbers, those of the model's own ``fit`` list first."""
    place: Array  # Coordinates of the numbers, shape (F,)
    residual: Array  # Measured minus simulated [rad, N], shape (M,)
    score: float  # Negative log likelihood per row [nat], see `SearchWorlds.score`
    scales: Array  # Most likely scale of each signal [rad, N], shape (S,)
    stride: Array  # Steps of the next finite differences, as shares of the coordinates, shape (F,)
    slopes: Mapping[int, Array] = field(default_factory=dict)
    """Derivatives of the residual by some columns' coordinates, taken nearby, shape (M,) each: the
    next step makes do with them."""
    damping: float = DAMPING  # Marquardt factor of the next step [1]
    settled: bool = False  # Whether no further step would lower its loss at these floors


@dataclass(frozen=True, kw_only=True)
class Weighing:
    """What rows of a residual are measured in, and how often each counts, shape (M,) each."""

    unit: Array  # What a residual is measured in [rad, N, m, A]
    weight: Array  # How often a row counts, 0 where a fit may not look [1]

    @property
    def size(self) -> Array:
        """Residual that tells as much as a unit does in a row that counts once."""
        return self.unit / np.sqrt(self.weight)


def values_of(worlds: SearchWorlds, columns: Sequence[int], place: Array) -> dict[int, float]:
    """Return column -> value of coordinates."""
    return {c: worlds.coordinate(c).value(float(u)) for c, u in zip(columns, place, strict=True)}


def bounds_of(
    worlds: SearchWorlds, columns: Sequence[int], names: Sequence[str]
) -> tuple[Array, Array]:
    """Return the least and greatest coordinates of columns, shape (F,) each.

    What is stated stays within its tolerance unless it is one of the causes.
    """
    low, high = np.empty(len(columns)), np.empty(len(columns))
    for f, column in enumerate(columns):
        own = worlds.coordinate(column)
        low[f], high[f] = own.lower, own.upper
        if column in worlds.stated and worlds.study.table.owners[column][0] not in names:
            low[f], high[f] = worlds.as_built(column)
    return low, high


def start_fits(
    worlds: SearchWorlds,
    starts: Sequence[tuple[tuple[str, ...], Mapping[int, float]]],
    floors: Floors,
    *,
    near: bool = False,
    slopes: Mapping[int, Array] | None = None,
) -> list[Fit]:
    """Evaluate sets of causes at given values, column -> value.

    Args:
        worlds: Simulates candidates.
        starts: Names of causes, and the values of all free numbers.
        floors: Least scale of each signal.
        near: Whether the starts are near their optima.
        slopes: Derivatives by some columns' coordinates near all starts, shape (M,) each.
    """
    if not starts:
        return []
    rows = [(names, worlds.with_stated(values, names)) for names, values in starts]
    places = []
    for names, values in rows:
        place = [worlds.coordinate(c).place(v) for c, v in values.items()]
        places.append(np.clip(place, *bounds_of(worlds, tuple(values), names)))
    residuals = worlds.residuals(
        [values_of(worlds, tuple(v), u) for (_, v), u in zip(rows, places, strict=True)]
    )
    score = worlds.score(residuals, floors)
    out = []
    for n, (names, values) in enumerate(rows):
        columns = tuple(values)
        out.append(
            Fit(
                names=names,
                columns=columns,
                place=places[n],
                residual=residuals[n],
                score=float(score.value[n]),
                scales=score.scales[n],
                stride=np.full(len(columns), strides(worlds, names)[0 if near else 1]),
                slopes={c: s for c, s in (slopes or {}).items() if c in columns},
            )
        )
    return out


def refit(
    worlds: SearchWorlds,
    fits: Sequence[Fit],
    floors: Floors,
    *,
    iterations: int,
    rows: Mask | None = None,
    coarse: int = 1,
    jacobians: Sequence[Array] | None = None,
    holds: Sequence[Array] | None = None,
) -> list[Fit]:
    """Descend from each fit's place; all its numbers move together.

    Derivatives cost most, so every second step makes do with those before, corrected by what that
    step did to the residuals (Broyden 1965). Such a step is not the last.

    Args:
        worlds: Simulates candidates.
        fits: Where to start.
        floors: Least scale of each signal.
        iterations: Steps at most. Before several of them switches are set, see `switched`.
        rows: Rows that the fit may see, shape (M,); all by default.
        coarse: Steps at the scale of all residuals before those of nearly all.
        jacobians: Derivatives near the fits' places, of which each step then makes do, shape (M, F)
            each; by default every step takes its own.
        holds: Curvatures besides, which hold numbers where they are, shape (F, F) each.
    """
    current = list(fits)
    if iterations > 1 and rows is None and jacobians is None:
        current = [switched(worlds, fit, floors) for fit in current]
    active = [bool(f.columns) and (rows is not None or not f.settled) for f in current]
    for step in range(iterations):
        chosen = [i for i, on in enumerate(active) if on]
        if not chosen:
            break
        own = [current[i] for i in chosen]
        slopes = linearise(worlds, own) if jacobians is None else [jacobians[i] for i in chosen]
        counted = [rows_of(worlds, f, floors, seen=rows, coarse=step < coarse) for f in own]
        together = [worlds.rows_together(f.residual, floors) for f in own]
        trials = [
            (fit.names, values_of(worlds, fit.columns, damped(
                worlds, fit, slopes[k], counted[k], part * fit.damping, together[k],
                hold=0.0 if holds is None else holds[i],
            )))
            for k, (i, fit) in enumerate(zip(chosen, own, strict=True)) for part in SHARES
        ]  # fmt: skip
        moved = start_fits(worlds, trials, floors)
        for k, (i, fit) in enumerate(zip(chosen, own, strict=True)):
            tried = moved[k * len(SHARES) : (k + 1) * len(SHARES)]
            losses = [mean_loss(worlds, f, counted[k], together[k]) for f in (fit, *tried)]
            gain = losses[0] - min(losses[1:])
            is_rough = jacobians is None and (bool(fit.slopes) or is_long(worlds, fit))
            may_shorten = gain <= 0.0 and fit.damping < MOST_DAMPING
            least = min(LEAST_GAIN, LEAST_NATS * together[k] / counted[k].weight.sum())
            active[i] = gain > least or step < coarse or is_rough or may_shorten
            current[i] = further(worlds, fit, tried, losses, slopes[k])
            if not active[i] and rows is None:
                current[i] = replace(current[i], settled=True)
    return current


def further(
    worlds: SearchWorlds, fit: Fit, trials: Sequence[Fit], losses: Sequence[float], jacobian: Array
) -> Fit:
    """Return a fit after a step, with the factor of the next one.

    Args:
        worlds: Simulates candidates.
        fit: Where the step began.
        trials: Where it leads with the fit's own factor, and with shares of it.
        losses: Mean losses of the fit and of these [nat].
        jacobian: Derivatives that the step was taken by, shape (M, F).
    """
    best = int(np.argmin(losses[1:]))
    is_better = losses[1 + best] < losses[0]
    new = stepped(worlds, fit, trials[best], jacobian) if is_better else shorter(worlds, fit)
    change = (1.0 if best == 0 else BOLDER) if is_better else 1.0 / BOLDER
    return replace(new, damping=float(np.clip(change * fit.damping, LEAST_DAMPING, MOST_DAMPING)))


def switched(worlds: SearchWorlds, fit: Fit, floors: Floors) -> Fit:
    """Return a fit where the numbers at which its laws switch are best, others as they stand.

    Slopes tell nothing of them: what switches a row earlier or later jumps.
    """
    table = worlds.study.table
    for name in () if fit.settled else fit.names:
        for c in (
            c for c in table.columns(name) if table.owners[c][1].name in law_of(name).switches
        ):
            values = values_of(worlds, fit.columns, fit.place)
            tried = [(fit.names, {**values, c: values[c] * np.exp(way)}) for way in WAYS]
            best = min(start_fits(worlds, tried, floors), key=lambda f: f.score)
            if best.score < fit.score:
                fit = replace(fit, place=best.place, residual=best.residual, score=best.score,
                              scales=best.scales)  # fmt: skip
    return fit


def strides(worlds: SearchWorlds, names: Sequence[str]) -> tuple[float, float]:
    """Return the least and the first stride of differences with some causes in the model."""
    return STICKING if is_dry((*worlds.study.known, *names)) else STRIDES


def is_long(worlds: SearchWorlds, fit: Fit) -> bool:
    """Tell whether a fit's differences may still become shorter."""
    return bool(np.any(fit.stride > strides(worlds, fit.names)[0]))


def shorter(worlds: SearchWorlds, fit: Fit) -> Fit:
    """Return a fit that a step did not better: other derivatives may lead further."""
    if fit.slopes:
        return replace(fit, slopes={})
    least, _ = strides(worlds, fit.names)
    return replace(fit, stride=np.maximum(least, SHORTER * fit.stride))


def stepped(worlds: SearchWorlds, before: Fit, after: Fit, jacobian: Array) -> Fit:
    """Return where a step led, with its length for differences or what is known of them."""
    step = after.place - before.place
    share = np.abs(step) / (1.0 + np.abs(after.place))
    least, most = strides(worlds, before.names)
    stride = np.clip(share, np.maximum(least, SHORTER * before.stride), most)
    if before.slopes:
        return replace(after, stride=stride)
    missed = after.residual - before.residual - jacobian @ step
    better = jacobian + np.outer(missed, step / max(1.0e-30, float(step @ step)))
    return replace(after, stride=stride, slopes=dict(zip(before.columns, better.T, strict=True)))


def mean_loss(worlds: SearchWorlds, fit: Fit, rows: Weighing, together: float) -> float:
    """Return the loss per row that counts.

    What is stated counts as a row does that tells something of its own, and of which so many are
    together.
    """
    stated = together * surprise(worlds, fit)
    terms = rows.weight @ loss_terms(fit.residual / rows.unit)
    return float((terms + stated) / rows.weight.sum())


def surprise(worlds: SearchWorlds, fit: Fit) -> float:
    """Return how unlikely it is that what is stated is as far off as a fit says [nat].

    A tolerance is the standard deviation of a normal error. What is further off than that lets be
    is cheaper as a cause, whose price is in the same nats.
    """
    return float(0.5 * np.square(offsets(worlds, fit)).sum())


def offsets(worlds: SearchWorlds, fit: Fit) -> Array:
    """Return how far numbers are from what is stated [tolerances], 0 for a cause, shape (F,)."""
    stated = np.array([worlds.stated_at(c)[0] for c in fit.columns])
    return (fit.place - stated) / worlds.spreads(fit.columns, fit.names)


def rows_of(
    worlds: SearchWorlds,
    fit: Fit,
    floors: Floors,
    *,
    seen: Mask | None = None,
    coarse: bool = False,
) -> Weighing:
    """Return the unit and the weight of each row, as the score has them.

    Args:
        worlds: Say which rows are whose.
        fit: Tells the units: its scales, or the root mean squares of all its residuals.
        floors: Least unit of each signal.
        seen: Rows that the fit may see, shape (M,); all by default.
        coarse: Whether rows at a jump tell how large residuals are: what acts at times must be seen
            before they are left out.
    """
    chosen = np.ones(len(fit.residual), dtype=bool) if seen is None else seen
    scales = worlds.score(fit.residual[None], floors, chosen).scales[0]
    counts, unit, weight = worlds.weights(floors), np.ones(len(chosen)), np.zeros(len(chosen))
    for (signal, every), scale in zip(worlds.where.signals, scales, strict=True):
        own = every & chosen
        if own.any():
            whole = trimmed_size(fit.residual[own], 1.0) if coarse else scale
            unit[own] = max(floors.of(signal), whole)
            weight[own] = counts[own] / counts[own].sum()
    return Weighing(unit=unit, weight=weight * chosen.sum() / weight.sum())


def linearise(worlds: SearchWorlds, fits: Sequence[Fit]) -> list[Array]:
    """Return the derivatives of fits' residuals by their coordinates, shape (M, F) each.

    They are differences over each fit's own strides, but for those that a fit brings with it, and
    for those of benches that `SearchWorlds.bench_slopes` has.
    """
    jacobians = [np.empty((len(fit.residual), len(fit.columns))) for fit in fits]
    models, steps, places = [], [], []
    for n, fit in enumerate(fits):
        ahead = {**worlds.bench_slopes, **fit.slopes}
        low, high = bounds_of(worlds, fit.columns, fit.names)
        for f, column in enumerate(fit.columns):
            if column in ahead:
                jacobians[n][:, f] = ahead[column]
                continue
            step = fit.stride[f] * (1.0 + abs(fit.place[f]))
            step = step if low[f] <= fit.place[f] + step <= high[f] else -step
            moved = fit.place.copy()
            moved[f] += step
            models.append(values_of(worlds, fit.columns, moved))
            steps.append(step)
            places.append((n, f))
    if models:
        residuals = worlds.residuals(models)
        for (n, f), residual, step in zip(places, residuals, steps, strict=True):
            jacobians[n][:, f] = (residual - fits[n].residual) / step
    for fit, jacobian in zip(fits, jacobians, strict=True):
        new = {c: jacobian[:, f].copy() for f, c in enumerate(fit.columns)
               if c in worlds.built_columns and c not in worlds.bench_slopes}  # fmt: skip
        worlds.bench_slopes = {**worlds.bench_slopes, **new}
    return jacobians


def damped(
    worlds: SearchWorlds, fit: Fit, jacobian: Array, rows: Weighing, damping: float,
    together: float, *, hold: Array | float = 0.0,
) -> Array:  # fmt: skip
    """Return where one Marquardt step leads, inside the bounds, shape (F,).

    Args:
        worlds: Say what is stated of the numbers.
        fit: Where to start.
        jacobian: Derivatives of the residual, shape (M, F).
        rows: How each row counts.
        damping: Marquardt factor [1].
        together: Rows that tell as much as one alone would [1].
        hold: Curvature besides, which holds numbers where they are, shape (F, F).
    """
    scaled = fit.residual / rows.unit
    weight = rows.weight * loss_weights(scaled)
    slopes = jacobian / rows.unit[:, None]
    hessian = slopes.T @ (weight[:, None] * slopes)
    gradient = slopes.T @ (weight * scaled)
    if fit.columns:
        pull = together / worlds.spreads(fit.columns, fit.names)
        hessian += np.diag(pull**2 / together)
        gradient += pull * offsets(worlds, fit)
    low, high = bounds_of(worlds, fit.columns, fit.names)
    size = np.diag(hessian)
    size = np.maximum(size, 1.0e-9 * max(1.0e-30, float(size.max(initial=0.0))))
    reach = REACH * (1.0 + np.abs(fit.place))
    step = bounded(
        hessian + np.diag(damping * size) + hold,
        -gradient,
        np.maximum(low - fit.place, -reach),
        np.minimum(high - fit.place, reach),
    )
    return np.clip(fit.place + step, low, high)


def without(fit: Fit, name: str, worlds: SearchWorlds) -> tuple[tuple[str, ...], dict[int, float]]:
    """Return a fit's names and values less one effect.

    What is stated goes back within its tolerance.
    """
    own = worlds.study.table.columns(name)
    values = values_of(worlds, fit.columns, fit.place)
    rest = {c: v for c, v in values.items() if c not in own}
    for c in worlds.stated.intersection(own):
        number = worlds.coordinate(c)
        rest[c] = number.value(float(np.clip(number.place(values[c]), *worlds.as_built(c))))
    return tuple(n for n in fit.names if n != name), rest


def rescored(worlds: SearchWorlds, fits: Sequence[Fit], floors: Floors) -> list[Fit]:
    """Return fits with their scores at other floors."""
    score = worlds.score(np.stack([f.residual for f in fits]), floors)
    return [
        replace(
            f, score=float(score.value[n]), scales=score.scales[n], settled=False,
        )
        for n, f in enumerate(fits)
    ]  # fmt: skip
