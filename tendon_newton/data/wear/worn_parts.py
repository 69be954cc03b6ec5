r"""Which part of a servo wears: one trend that all its numbers share, against what days scatter.

.. math:: z_d = \mu + \beta\,t_d\,s + \epsilon_d, \qquad \epsilon_d \sim N(0, \Omega + C_d)

:math:`z_d` holds the numbers of a day over their means, :math:`s` how a part's wear moves them,
:math:`C_d` what the day's log leaves open and :math:`\Omega` how days scatter: temperature, load.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.importers.joint_faults import ANGLE_LIMIT
from tendon_newton.data.recording import Array
from tendon_newton.data.wear.day_fit import NUMBERS, DayFit

TRENDS = ("lag", "friction", "play", "load")
"""Numbers that a trend is sought in. A delay is the computer's."""
SCATTER, SCATTER_DAYS = 0.05, 5.0
"""Scatter of days that is expected beforehand [1], and how many days that is worth [1]."""
CHANCE = 5e-4
"""Chance that a servo that does not wear looks so worn, for a part and a look [1]: seven looks at
four parts, each of its own, would name one falsely on 1.4 % of the servos."""
LEAST_DAYS = 4  # From which a trend and its scatter can be told apart
TOLD = 0.7  # Share of the motion that the law must tell of a day [1]
SHOWN = 1.0  # Growth over all days that a log must be able to show, to say that nothing wears [1]
QUANTILES = (0.025, 0.975)
DRAWS, SEED = 100_000, 11  # From Student's distribution


@dataclass(frozen=True, kw_only=True)
class WornPart:
    """A part that wears."""

    words: str  # What wears, and what to do
    number: str  # What shows it best
    moves: Mapping[str, float]
    """By what share each number moves, over the growth of the part's effect [1]."""
    reason: str  # Why it is to be replaced from the limit on
    times: float = 2.0  # The limit against the first day's effect [1]
    ceiling: float | None = None  # The limit as a value of the number in its place [SI]


PARTS: Mapping[str, WornPart] = {
    "play": WornPart(
        words="the gear's play grows: tighten horn and screws, or replace the gear",
        number="play",
        moves={"play": 1.0},
        ceiling=ANGLE_LIMIT,
        reason="`doctor` fails a joint there; a sound SO-101 has up to 4.7 deg",
    ),
    "friction": WornPart(
        words="friction grows: clean and grease gear and guides, then replace the gear",
        number="friction",
        moves={"friction": 1.0},
        reason="the angle then stops twice as far from its command as on the first day",
    ),
    "string": WornPart(
        words="what holds the joint has softened: retension or replace the string, then the spring",
        number="load",
        moves={"load": -1.0},
        reason="the joint then gives way twice as far under the same force",
    ),
    "gain": WornPart(
        words="the servo pulls less for the same error: measure its supply, then replace the motor",
        number="lag",
        moves={"lag": 1.0, "friction": 1.0, "load": 1.0},
        reason="lag, sag and error by friction have then doubled",
    ),
}


@dataclass(frozen=True, kw_only=True)
class Trend:
    """How one part's effect grows."""

    part: str
    rate: float  # Growth a day over the mean of all days [1]
    ci95: tuple[float, float]
    wears: bool
    probability: float  # That it grows at all [1]
    seen_from: float  # Growth over all days that would have been named [1]
    ends: tuple[float, float, float] | None
    """Day at which it reaches its limit, and the day's 95 % interval; None where it does not."""

    @property
    def told(self) -> bool:
        """Whether the logs would have shown a part whose effect doubles."""
        return self.wears or self.seen_from < SHOWN


def trends_of(days: Array, fits: Sequence[DayFit]) -> list[Trend]:
    """Return the trend of every part, those that wear first, the soonest at its limit ahead.

    Args:
        days: When each log was taken [days], shape (D,), at least `LEAST_DAYS`.
        fits: What each tells.
    """
    places = [NUMBERS.index(name) for name in TRENDS]
    values = np.exp([fit.logs[places] for fit in fits])
    mean = values.mean(axis=0)
    share = values / mean
    open_ = np.array([fit.covariance[np.ix_(places, places)] for fit in fits])
    open_ = open_ * share[:, :, None] * share[:, None, :]
    time = days - days.mean()
    weights = inverse(scatter_of(time, share, open_)[None] + open_)
    freedom = SCATTER_DAYS + len(days) - 2.0
    draws = np.random.default_rng(SEED).standard_t(freedom, DRAWS)
    bar = float(np.quantile(draws, 1.0 - CHANCE))
    chosen: list[str] = []
    while len(chosen) < len(PARTS):
        rest = [part for part in PARTS if part not in chosen]
        grown = {part: growth(time, share, weights, [*chosen, part]) for part in rest}
        scores = {part: rate / spread for part, (rate, spread) in grown.items()}
        best = max(rest, key=lambda part: scores[part])
        if scores[best] < bar:
            break
        chosen.append(best)
    told: list[Trend] = []
    for part in PARTS:
        several = [one for one in chosen if one != part]
        rate, spread = growth(time, share, weights, [*several, part])
        mids = Mids(days=float(days.mean()), first=float(time[0]), draws=draws, mean=mean)
        told.append(trend(part, (rate, spread), bar, part in chosen, float(np.ptp(days)), mids))
    return sorted(told, key=lambda one: (not one.wears, one.ends[0] if one.ends else np.inf))


def scatter_of(time: Array, share: Array, open_: Array) -> Array:
    """Return by how much days scatter about straight trends beyond what logs leave open, (4, 4)."""
    slopes = time @ share / (time @ time)
    left = share - share.mean(axis=0) - time[:, None] * slopes
    usual = SCATTER_DAYS * (SCATTER**2 * np.eye(len(TRENDS)) + open_.mean(axis=0))
    whole = (usual + left.T @ left) / (SCATTER_DAYS + len(time) - 2.0)
    sizes, directions = np.linalg.eigh(whole - np.median(open_, axis=0))
    return (directions * np.maximum(sizes, 1e-6)) @ directions.T


def growth(time: Array, share: Array, weights: Array, parts: Sequence[str]) -> tuple[float, float]:
    """Return by how much the effect of the last of parts grows a day, and its deviation [1]."""
    count, size = share.shape
    moves = np.array([[PARTS[part].moves.get(name, 0.0) for name in TRENDS] for part in parts])
    design = np.concatenate(
        [np.tile(np.eye(size), (count, 1, 1)), time[:, None, None] * moves.T[None]], axis=2
    )
    pull = np.einsum("dij,dik->djk", design, weights)
    known = inverse(np.einsum("dji,dik->jk", pull, design))
    found = known @ np.einsum("dji,di->j", pull, share)
    return float(found[-1]), float(np.sqrt(known[-1, -1]))


def inverse(matrices: Array) -> Array:
    """Return the inverses of matrices, shape (..., N, N)."""
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Mids:
    """Where trends have their middle."""

    days: float  # Mean day [days]
    first: float  # First day after that [days]
    draws: Array  # From Student's distribution, of how far a rate is off [1]
    mean: Array  # Of the numbers


def trend(
    part: str, grows: tuple[float, float], bar: float, wears: bool, span: float, mids: Mids
) -> Trend:
    """Return a part's trend and when it ends."""
    rate, spread = grows
    rates = rate + spread * mids.draws
    low, high = map(float, np.quantile(rates, QUANTILES))
    # the faster, the sooner
    end, late, early = (day_of_limit(PARTS[part], one, mids) for one in (rate, low, high))
    return Trend(
        part=part,
        rate=rate,
        ci95=(low, high),
        wears=wears,
        probability=float(np.mean(rates > 0.0)),
        seen_from=bar * spread * span,
        ends=(end, early, late) if wears else None,
    )


def day_of_limit(part: WornPart, rate: float, mids: Mids) -> float:
    """Return the day at which a part that grows at a rate [1/day] is to be replaced."""
    if rate <= 0.0:
        return np.inf
    limit = part.times * (1.0 + rate * mids.first)
    if part.ceiling is not None:
        limit = part.ceiling / float(mids.mean[TRENDS.index(part.number)])
    return mids.days + max((limit - 1.0) / rate, mids.first)
