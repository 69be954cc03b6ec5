"""Every effect of the catalogue looked at once, around one fit: secants, slopes and removals."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.refit import Fit, bounds_of, linearise, values_of, without
from tendon_newton.diagnosis.search.search_worlds import Floors, SearchWorlds, trimmed_size
from tendon_newton.identification.objective import loss_weights

TRUST = 0.7  # Share of a coordinate, and of a typical size besides, by which a slope is trusted [1]
NEARLY_ALL = 0.99  # Share of the residuals whose size decides which rows count less [1]
STRETCH = (0.15, 2.0)  # Multiples of a secant's own size within which it is trusted [1]


@dataclass(frozen=True, kw_only=True)
class Column:
    """One direction in which residuals change."""

    name: str  # Effect that it belongs to; empty for the model's own unknown numbers
    kind: str  # ``atom``: the effect appears; ``slope``: a number of it moves; ``removal``: it goes
    values: dict[int, float]
    """Column -> value at one unit of an atom; column -> coordinate step of a slope."""
    low: float  # Least coefficient
    high: float  # Greatest one


@dataclass(frozen=True, kw_only=True)
class Survey:
    """Residuals around one fit, as a quadratic in many directions."""

    fit: Fit
    columns: tuple[Column, ...]
    gram: Array  # Products of all directions, for each signal, shape (S, C, C)
    slope: Array  # Products of the directions with the residual, shape (S, C)
    square: Array  # Squared residual, shape (S,)
    rows: Array  # Rows that count, by weight, shape (S,)
    floors: Array  # Least scale of each signal, shape (S,)
    directions: Array  # Changes of the residual, shape (C, M)

    @property
    def slopes(self) -> dict[int, Array]:
        """Derivatives of the residual by the fit's own columns, shape (M,) each."""
        return {
            next(iter(column.values)): direction
            for column, direction in zip(self.columns, self.directions, strict=True)
            if column.kind == "slope"
        }


def survey(
    worlds: SearchWorlds,
    fit: Fit,
    names: Sequence[str],
    floors: Floors,
    *,
    coarse: bool = False,
) -> Survey:
    """Look at every effect around a fit.

    What was simulated around the same place before is not simulated again.

    Args:
        worlds: Simulates candidates.
        fit: Where to look.
        names: Effects that may be added.
        floors: Least scale of each signal.
        coarse: Whether rows at a jump tell, too, how large residuals are.
    """
    place = (fit.names, fit.columns, fit.place.tobytes(), tuple(names))
    if worlds.last_surveyed is None or worlds.last_surveyed[0] != place:
        worlds.last_surveyed = (place, look_around(worlds, fit, names))
    found, directions = worlds.last_surveyed[1]
    return assemble(worlds, fit, found, directions, floors, share=1.0 if coarse else NEARLY_ALL)


def look_around(
    worlds: SearchWorlds, fit: Fit, names: Sequence[str]
) -> tuple[tuple[Column, ...], Array]:
    """Return the directions around a fit, and how residuals change along each, shape (C, M).

    An effect of all servos is not simulated: its direction is the sum of those of each servo, just
    as that of any set is the sum of its members.
    """
    worlds.last_surveyed = None  # large, and of another place
    values = values_of(worlds, fit.columns, fit.place)
    found = [
        Column(name=name, kind="atom", values=atom, low=STRETCH[0], high=STRETCH[1])
        for name in names
        if name not in fit.names
        for atom in atoms(worlds.study, name)
    ]
    parts = parts_of(worlds, found)
    models = [{**values, **found[i].values} for i, own in enumerate(parts) if own == [i]]
    for name in fit.names:
        parts.append([len(found)])
        found.append(Column(name=name, kind="removal", values={}, low=1.0, high=1.0))
        models.append(without(fit, name, worlds)[1])
    directions = np.empty((len(parts) + len(fit.columns), len(fit.residual)))
    if models:
        simulated = (i for i, own in enumerate(parts) if own == [i])
        for i, residual in zip(simulated, worlds.residuals(models), strict=True):
            directions[i] = residual - fit.residual
        for i, own in enumerate(parts):
            if own != [i]:
                directions[i] = sum(directions[part] for part in own)
    worlds.bench_slopes = {}
    directions[len(parts) :] = linearise(worlds, [replace(fit, slopes={})])[0].T
    low, high = bounds_of(worlds, fit.columns, fit.names)
    for f, column in enumerate(fit.columns):
        owner = worlds.study.table.owners[column][0]
        reach = TRUST * (1.0 + abs(fit.place[f]))
        found.append(
            Column(
                name=owner if owner in fit.names else "",
                kind="slope",
                values={column: 1.0},
                low=max(-reach, low[f] - fit.place[f]),
                high=min(reach, high[f] - fit.place[f]),
            )
        )
    return tuple(found), directions


def parts_of(worlds: SearchWorlds, found: Sequence[Column]) -> list[list[int]]:
    """Return for each atom the places of those whose sum it is: its own, or those of each servo."""
    place = {(a.name, *a.values.values()): i for i, a in enumerate(found)}
    parts = []
    for i, atom in enumerate(found):
        causes = worlds.study.table.causes(atom.name)
        keys = [(cause, *atom.values.values()) for cause in causes]
        parts.append([place[key] for key in keys] if all(key in place for key in keys) else [i])
    return parts


def assemble(
    worlds: SearchWorlds, fit: Fit, columns: tuple[Column, ...], directions: Array, floors: Floors,
    *, share: float,
) -> Survey:  # fmt: skip
    """Reduce directions to the products that a choice needs."""
    gram, slope, square, rows = [], [], [], []
    least = np.array([floors.of(signal) for signal, _ in worlds.where.signals])
    for (_, chosen), floor in zip(worlds.where.signals, least, strict=True):
        residual = fit.residual[chosen]
        weight = loss_weights(residual / max(floor, trimmed_size(residual, share)))
        weight = weight * worlds.weights(floors)[chosen]
        part = directions[:, chosen]
        gram.append((part * weight) @ part.T)
        slope.append(part @ (weight * residual))
        square.append(float(residual @ (weight * residual)))
        rows.append(float(weight.sum()))
    return Survey(
        fit=fit, columns=columns, gram=np.array(gram), slope=np.array(slope),
        square=np.array(square), rows=np.array(rows), floors=least, directions=directions,
    )  # fmt: skip
