"""Numbers of effects in coordinates in which a fit is nearly linear, and sizes to look at."""

import itertools

import numpy as np

from tendon_newton.data.parameters import Parameter
from tendon_newton.diagnosis.posterior import Coordinate
from tendon_newton.effects import law_of
from tendon_newton.identification.study import Study

SIZES = (0.5, 2.0)  # Typical values of a strength are multiplied by these for a survey [1]
SIGNED_SHARE = 0.1
"""Share of its range that is typical of a number that declares no typical value [1]."""
SHARES_OF_RANGE = (0.1, 0.4)
"""How far a survey moves a scale, as a share of the logarithm of its greatest value [1]."""
SHARES_OF_PEAK = (1.0, 0.85, 0.65)
"""Limits that a survey looks at, as shares of the greatest value that was measured [1]."""
SHARES_OF_TENSION = (1.3, 1.15, *SHARES_OF_PEAK)
"""Such limits of a motor's force [1]: it moves the gear's friction beside what a tendon shows, and
gears of hobby servos take 10 to 40 % of it (`load_dependent_friction`)."""
SHAPES = (0.3, 1.0, 3.0)
"""Times and speeds that shape an effect, as multiples of what is typical [1]."""
PLACES = (0.15, 0.35, 0.55, 0.75)
"""Places along the measured travel where a survey puts an obstacle [1]."""
REST_FACTOR = 2.0  # Breakaway force that a survey looks at, as a multiple of the sliding one [1]
PEAK = 0.995  # Share of the rows below what counts as the greatest measured value [1]


def coordinate_of(study: Study, column: int) -> Coordinate:
    """Return the coordinate of one column of a study's parameter vector."""
    parameter = study.parameter(column)
    null = parameter.null if np.isinf(parameter.null) else study.base_value(column)
    low, high = parameter.lower, parameter.upper
    if np.isinf(parameter.null):
        # beyond its range a limit of a command is met within a step: it acts as half a step's delay
        least = 0.0 if parameter.optional else parameter.nominal / high
        return Coordinate(
            kind="inverse", origin=parameter.nominal, unit=1.0,
            lower=least, upper=parameter.nominal / low,
        )  # fmt: skip
    if low > 0.0:
        origin = float(np.clip(null, low, high))
        unit = 0.25
        return Coordinate(
            kind="log", origin=origin, unit=unit,
            lower=float(np.log(low / origin)) / unit, upper=float(np.log(high / origin)) / unit,
        )  # fmt: skip
    unit = typical_size(parameter)
    return Coordinate(
        kind="linear", origin=null, unit=unit,
        lower=(low - null) / unit, upper=(high - null) / unit,
    )  # fmt: skip


def typical_size(parameter: Parameter) -> float:
    """Return what a number typically differs by from none [unit]."""
    if parameter.null == 1.0:
        return 1.0
    return abs(parameter.nominal) or SIGNED_SHARE * parameter.upper


def atoms(study: Study, effect: str) -> list[dict[int, float]]:
    """Return the values of an effect's numbers at which a survey looks, column -> value."""
    table = study.table
    columns = table.columns(effect)
    parameters = [study.parameter(c) for c in columns]
    further = {c: p.nominal for c, p in zip(columns, parameters, strict=True) if p.needs}
    if len(parameters) == 1 + len(further):
        return [{columns[0]: v, **further} for v in sizes(study, columns[0])]
    law = law_of(effect)
    named = {p.name: (c, p) for c, p in zip(columns, parameters, strict=True)}
    grids: list[list[float]] = []
    for parameter in parameters:
        if parameter.name == "position":
            grids.append(places(study, parameter))
        elif is_shape(parameter):
            grids.append([inside(parameter, f * parameter.nominal) for f in SHAPES])
        elif np.isinf(parameter.null) and not grids:
            grids.append([inside(parameter, x) for x in limits(study, parameter)])
        else:
            grids.append([parameter.nominal])
    out = []
    for values in itertools.product(*grids):
        atom = dict(zip(columns, values, strict=True))
        for name in law.dry:
            if name.startswith("static"):
                (first, _), (rest, p) = named[law.dry[0]], named[name]
                atom[rest] = inside(p, REST_FACTOR * atom[first])
        out.append(atom)
    return out


def is_shape(parameter: Parameter) -> bool:
    """Tell whether a number only shapes an effect whose strength is another."""
    return parameter.lower > 0.0 and np.isfinite(parameter.null)


def inside(parameter: Parameter, value: float) -> float:
    """Return a value within a number's range."""
    return float(np.clip(value, parameter.lower, parameter.upper))


def sizes(study: Study, column: int) -> list[float]:
    """Return the values at which a survey looks at an effect of one number."""
    parameter = study.parameter(column)
    base = study.base_value(column)
    if np.isinf(parameter.null):
        return [inside(parameter, x) for x in limits(study, parameter)]
    if parameter.null == 1.0:
        moves = [s * np.log(parameter.upper) for s in SHARES_OF_RANGE]
        found = [base * np.exp(m) for move in moves for m in (move, -move)]
    else:
        steps = [s * typical_size(parameter) for s in SIZES]
        found = [base + s for s in steps]
        found += [base - s for s in steps] if parameter.lower < base else []
    return list(dict.fromkeys(inside(parameter, x) for x in found))


def limits(study: Study, parameter: Parameter) -> list[float]:
    """Return values of a number that is infinite when absent."""
    if parameter.unit == "rad/s":
        peak, shares = greatest(study, "motor_velocity"), SHARES_OF_PEAK
    elif parameter.unit in ("N", "N m"):
        peak, shares = greatest(study, "force"), SHARES_OF_TENSION
    else:
        return [parameter.nominal * f for f in (3.0, 1.0, 0.4)]
    return [share * (peak or parameter.nominal) for share in shares]


def greatest(study: Study, signal: str) -> float:
    """Return the greatest size that recordings show of a signal, spikes left out."""
    measured = [v for r in study.recordings if (v := getattr(r, signal)) is not None]
    return max((float(np.quantile(np.abs(v[:, 0]), PEAK)) for v in measured), default=0.0)


def places(study: Study, parameter: Parameter) -> list[float]:
    """Return motor angles along the measured travel [rad]."""
    angles = np.concatenate([r.motor_position[:, 0] for r in study.recordings])
    low, high = np.quantile(angles, (1.0 - PEAK, PEAK))
    return [inside(parameter, low + share * (high - low)) for share in PLACES]
