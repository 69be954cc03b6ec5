"""What an exam asks: cases of every family, each with its own circumstances."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from tests.planted.generator import Recipe
from tests.planted.physics.sensors import FORCE_NOISE
from tests.planted.sets.draws import ALONE, MIX_OF, NEEDS_FINGER, OUTSIDE, SIDES

FAMILIES = ("single", "pair", "clean", "outside")
"""Asked by default; ``many``, three to five causes at once, is asked by name."""
SHARES = {"single": 0.55, "pair": 0.15, "clean": 0.15, "outside": 0.15, "many": 0.15}
MANY = (3, 4, 5)
MIX_SHARES = {"A": 0.65, "F": 0.19, "S": 0.08, "W": 0.08}
# what a pendulum on a servo's shaft, without string, spring or stops, can show beside its play
ON_SHAFT = frozenset(
    {
        "backlash",
        "gain_error",
        "command_delay",
        "actuator_lag",
        "position_offset",
        "load_cell_bias",
        "load_cell_gain",
        "load_cell_lag",
        "load_cell_delay",
        "joint_damping_error",
        "inertia_error",
    }
)
WEAK_SIZE = 0.1
REALISTIC_NOISE = (0.05, 0.09)  # [N] of the load cell where the friction is known

# what imitates what, at any strength: two of a set are a pair that is hard to find again
ALIKE = (
    frozenset(
        {
            "coulomb_friction",
            "stribeck_friction",
            "load_dependent_friction",
            "gear_load_friction",
            "load_stribeck_friction",
            "holding_friction",
        }
    ),
    frozenset({"spool_radius_error", "joint_stiffness_error", "tendon_compliance", "obstruction"}),
    frozenset({"gravity_misalignment", "tendon_slack", "joint_stiffness_error"}),
    frozenset({"joint_damping_error", "viscoelastic_spring"}),
    frozenset({"command_delay", "actuator_lag", "viscous_friction", "sample_period_error"}),
    frozenset({"load_cell_lag", "load_cell_delay", "command_delay", "actuator_lag"}),
    frozenset({"spring_stiffening", "obstruction", "joint_stiffness_error"}),
    frozenset({"routing_friction", "joint_dry_friction", "coulomb_friction"}),
    frozenset({"routing_friction", "stribeck_friction", "load_dependent_friction"}),
    frozenset({"routing_friction", "gear_load_friction", "holding_friction"}),
    frozenset({"routing_friction", "load_stribeck_friction"}),
    frozenset({"gain_error", "gain_drift", "deadband", "force_saturation", "voltage_sag"}),
    frozenset({"gain_error", "gain_drift", "voltage_sag", "torque_fade"}),
    frozenset({"load_cell_bias", "load_cell_gain", "load_cell_drift"}),
    # the plant limits the speed of the tendon, and so of the motor only if the tendon is stiff
    frozenset({"speed_limit", "tendon_compliance", "tendon_slack"}),
)

# a law and its special case: no answer has both
ONE_LAW = (
    frozenset({"coulomb_friction", "stribeck_friction"}),
    frozenset({"coulomb_friction", "asymmetric_friction"}),
    frozenset({"coulomb_friction", "hysteresis"}),
    frozenset({"gear_load_friction", "load_stribeck_friction"}),
    frozenset({"command_rate_limit", "acceleration_limit"}),
)


@dataclass(frozen=True, kw_only=True)
class ExamPlan:
    """What an exam is made of."""

    cases: int = 60
    seed: int = 1000
    families: tuple[str, ...] = FAMILIES
    effects: tuple[str, ...] = ALONE  # Causes of the catalogue that are asked for
    mixes: tuple[str, ...] = tuple(MIX_SHARES)
    colours: tuple[float, ...] = (0.0, 0.6, 0.9)
    """Correlations of the force noise, each as likely [1]."""
    known_friction: float = 0.25  # Share of the cases with a friction that the model knows [1]
    cell_rate_share: float = 0.3  # Share of those with a slow load cell [1]
    gaps_share: float = 0.3  # Share of those with gaps in the log [1]
    off_nominal: float = 0.0  # Share by which the benches may differ from the model's [1]
    imperfection: float = 0.0
    second_form: bool = False
    """Whether the plant has its other laws of bristles, knees and contacts."""
    without_force: bool = False  # Whether the bench has no load cell
    alike_share: float = 0.25  # Share of the pairs whose causes imitate each other [1]
    weak_share: float = 0.0  # Share of the cases with a cause too weak to be expected [1]


def recipes(plan: ExamPlan) -> Iterator[Recipe]:
    """Draw the cases; each cause comes up as often as any other of its family."""
    rng = np.random.default_rng(plan.seed)
    families = _in_shares(rng, plan)
    singles = cycle(rng.permutation(plan.effects))
    outside = cycle(rng.permutation(list(OUTSIDE)))
    for number, family in enumerate(families):
        effects: tuple[str, ...] = ()
        if family == "single":
            effects = (str(next(singles)),)
        elif family == "pair":
            effects = draw_pair(rng, plan.effects, alike=bool(rng.random() < plan.alike_share))
        elif family == "many":
            effects = draw_many(rng, plan.effects, int(rng.choice(MANY)))
        elif family == "outside":
            effects = (str(next(outside)),)
        yield _circumstances(rng, plan, effects, number)


def _in_shares(rng: np.random.Generator, plan: ExamPlan) -> Sequence[str]:
    shares = np.array([SHARES[family] for family in plan.families])
    ends = np.cumsum(shares / shares.sum()) * plan.cases
    places = np.searchsorted(ends, np.arange(plan.cases) + 0.5)
    return [plan.families[i] for i in rng.permutation(places)]


def draw_pair(
    rng: np.random.Generator, effects: Sequence[str], *, alike: bool = False
) -> tuple[str, str]:
    """Draw two causes that one bench shows, alike or not, mostly from different sides."""
    pairs = [(a, b) for i, a in enumerate(effects) for b in effects[i + 1 :] if on_one_bench(a, b)]
    pairs = [pair for pair in pairs if are_alike(pair) == alike]
    if not pairs:
        kind = "imitate each other" if alike else "can be told apart"
        raise ValueError(f"no two of {', '.join(effects)} {kind}.")
    weights = np.array([1.0 if _side(a) != _side(b) else 0.25 for a, b in pairs])
    return pairs[int(rng.choice(len(pairs), p=weights / weights.sum()))]


def draw_many(rng: np.random.Generator, effects: Sequence[str], count: int) -> tuple[str, ...]:
    """Draw several causes that one bench shows, no two of which imitate each other."""
    chosen: list[str] = []
    for name in map(str, rng.permutation([e for e in effects if e not in MIX_OF])):
        fits = all(on_one_bench(name, o) and not are_alike((name, o)) for o in chosen)
        if len(chosen) < count and fits:
            chosen.append(name)
    if len(chosen) < count:
        raise ValueError(f"no {count} of {', '.join(effects)} can be told apart.")
    return tuple(chosen)


def are_alike(pair: Collection[str]) -> bool:
    """Tell whether two causes imitate each other."""
    return any(set(pair) <= alike for alike in ALIKE)


def on_one_bench(first: str, second: str) -> bool:
    """Tell whether a bench can show both: play needs a shaft, most else a string or a spring.

    A law beside its own special case is one law.
    """
    both = {first, second}
    return both not in ONE_LAW and (not both & set(MIX_OF) or both <= ON_SHAFT)


def _side(effect: str) -> str:
    return next(side for side, draws in SIDES.items() if effect in draws)


def _circumstances(
    rng: np.random.Generator, plan: ExamPlan, effects: tuple[str, ...], number: int
) -> Recipe:
    on_shaft = bool(set(effects) & set(MIX_OF))
    # the friction that a servo on a spool has would hold a pendulum where it is
    known = bool(rng.random() < plan.known_friction) and not on_shaft
    slow, gaps, weak = (
        bool(draw < share)
        for draw, share in zip(
            rng.random(3), (plan.cell_rate_share, plan.gaps_share, plan.weak_share), strict=True
        )
    )
    return Recipe(
        effects=effects,
        seed=plan.seed + number,
        mix=draw_mix(rng, plan.mixes, effects),
        size=WEAK_SIZE if weak else 1.0,
        force_noise=round(float(rng.uniform(*REALISTIC_NOISE)), 4) if known else FORCE_NOISE,
        noise_colour=float(rng.choice(plan.colours)),
        known_friction=known,
        cell_rate=20.0 if known and slow else None,
        gaps=known and gaps,
        imperfection=plan.imperfection,
        second_form=plan.second_form,
        without_force=plan.without_force,
        off_nominal=plan.off_nominal,
    )


def draw_mix(rng: np.random.Generator, mixes: Sequence[str], effects: Sequence[str]) -> str:
    """Draw the benches: play gets a shaft, what needs the finger gets it in five of six cases."""
    for name in set(effects) & set(MIX_OF):
        return MIX_OF[name]
    mixes = [mix for mix in mixes if mix in MIX_SHARES]
    weights = np.array([MIX_SHARES[mix] for mix in mixes])
    if NEEDS_FINGER & set(effects) and rng.random() < 5.0 / 6.0:
        with_finger = np.array([mix in ("A", "F") for mix in mixes])
        weights = weights * with_finger if with_finger.any() else weights
    return str(rng.choice(mixes, p=weights / weights.sum()))
