"""Numbers that differ between the worlds of a training, drawn anew for each episode."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import torch
from torch import Tensor

from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.diagnosed_bench import recorded_benches
from tendon_newton.effects import EFFECTS, find_effect
from tendon_newton.errors import InvalidParameter, listed, unknown_name
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.policy.config.environment_config import FINGERS, EnvironmentConfig
from tendon_train.policy.worlds.world_draws import WorldDraws

BENCH = "bench"  # Owner of the numbers of the mechanism
BENCH_NUMBERS: dict[str, tuple[str, ...]] = {
    "joint_friction": ("friction",),
    "link_mass": ("mass", "inertia"),
    "spool_radius": ("spool_radius",),
    "joint_spring": ("stiffness",),
}
"""Names of what can be randomised, and the arrays of the mechanism that they multiply."""
NONE = "none"
FRICTION_EFFECT = ("joint_dry_friction", "fraction")
NO_END = 1.0e6  # A range of a joint that ends beyond has no end [rad, m]


@dataclass(frozen=True, kw_only=True)
class NumberRange:
    """A number that differs between worlds, and between which ends."""

    owner: str  # An effect, or the bench
    name: str  # Parameter of the effect, or a name of `BENCH_NUMBERS`
    low: float  # Least value; a factor for a number of the bench
    high: float

    @property
    def label(self) -> str:
        """Name of the number on a card."""
        return self.name if self.owner == BENCH else f"{self.owner}.{self.name}"


def ranges_of(config: EnvironmentConfig, model: Model) -> tuple[NumberRange, ...]:
    """Return what a config randomises.

    Args:
        model: Force model; effects are drawn about its own numbers.

    Raises:
        UnknownName: A word that is no number and no effect.
        InvalidParameter: There is nothing that an effect could be drawn about.
    """
    ranges = list[NumberRange]()
    for word in config.randomise:
        if word in BENCH_NUMBERS:
            low, high = 1.0 - config.spread, 1.0 + config.spread
            ranges.append(NumberRange(owner=BENCH, name=word, low=low, high=high))
        elif word in EFFECTS:
            ranges += effect_ranges(word, model, config.spread)
        elif word != NONE:
            raise unknown_name("number to randomise", word, [*BENCH_NUMBERS, NONE, *EFFECTS])
    return tuple(ranges)


def effects_of(ranges: Sequence[NumberRange]) -> tuple[str, ...]:
    """Return the effects that a simulation must hold for its numbers to differ."""
    return tuple(dict.fromkeys(each.owner for each in ranges if each.owner != BENCH))


def on_diagnosed_finger(config: EnvironmentConfig) -> EnvironmentConfig:
    """Return settings on the finger of their diagnosis, where nobody names another one.

    Raises:
        InvalidParameter: The diagnosis is of several fingers.
    """
    if config.finger != FINGERS["tip"]:
        return config
    force = Path(config.force)
    benches = {*(recorded_benches(force) if force.exists() else ())} - {config.finger}
    fingers = sorted(bench for bench in benches if load_mechanism(bench).tip is not None)
    if len(fingers) > 1:
        raise InvalidParameter(f"--finger must name one of the diagnosis's: {listed(fingers)}")
    return replace(config, finger=fingers[0]) if fingers else config


def effect_ranges(effect: str, model: Model, spread: float) -> list[NumberRange]:
    """Return ranges about an effect's numbers in a model; a scale that it lacks is drawn about 1.

    Args:
        spread: Most that a number differs, as a share of it.
    """
    own = next((e.values for e in model.effects if e.cause == effect), {})
    ranges = []
    for known in find_effect(effect).parameters:
        if own and known.optional and known.name not in own:
            continue  # a form of the law that the model does not have
        middle = float(own.get(known.name, known.null))
        if not isfinite(middle) or middle == 0.0:
            raise InvalidParameter(
                f"{effect} is drawn about the model's own {known.name}; the model has none: put it "
                "into the model file"
            )
        ends = (middle * (1.0 - spread), middle * (1.0 + spread))
        least, most = known.widest
        low, high = (min(max(end, least), most) for end in sorted(ends))
        ranges.append(NumberRange(owner=effect, name=known.name, low=low, high=high))
    return ranges


class Randomiser:
    """Draws the numbers of worlds.

    A number of the bench has a factor per world and joint, a spool's radius one per world and
    tendon; a link's inertia goes with its mass.
    Joint friction is a torque of its own here, so that a stiffer spring brings no more of it.

    Args:
        ranges: Numbers that differ.
        joint_friction: Dry friction that `joint_friction` is drawn about [1], where the model has
            none of its own.
    """

    def __init__(
        self,
        loop: ControlLoop,
        ranges: Sequence[NumberRange],
        *,
        joint_friction: float,
        draws: WorldDraws,
    ) -> None:
        self.ranges = tuple(ranges)
        self._draws = draws
        self._loop = loop
        if any(r.owner == BENCH and r.name == "joint_friction" for r in self.ranges):
            make_friction_own(loop, joint_friction)
        self._nominal = {
            array: loop.bench_numbers(array).clone()
            for r in self.ranges
            if r.owner == BENCH
            for array in BENCH_NUMBERS[r.name]
        }

    @property
    def told(self) -> dict[str, tuple[float, float]]:
        """Ends of what each number is drawn from, for a card."""
        return {r.label: (r.low, r.high) for r in self.ranges}

    def draw(self, worlds: Tensor) -> None:
        """Give new numbers to some worlds, a mask of shape (W,)."""
        for number in self.ranges:
            if number.owner == BENCH:
                self._draw_bench(number, worlds)
            else:
                values = self._loop.numbers(number.owner, number.name)
                chosen = worlds.reshape(-1, *[1] * (values.ndim - 1))
                values.copy_(torch.where(chosen, self._uniform(number, values, worlds), values))

    def _draw_bench(self, number: NumberRange, worlds: Tensor) -> None:
        """Multiply nominal numbers of the mechanism, shape (W, J, ...) or (W, D)."""
        factor: Tensor | None = None
        for array in BENCH_NUMBERS[number.name]:
            values, nominal = self._loop.bench_numbers(array), self._nominal[array]
            factor = self._uniform(number, nominal, worlds) if factor is None else factor
            spread = factor.reshape(*factor.shape, *[1] * (nominal.ndim - factor.ndim))
            chosen = worlds.reshape(-1, *[1] * (nominal.ndim - 1))
            values.copy_(torch.where(chosen, nominal * spread, values))

    def _uniform(self, number: NumberRange, like: Tensor, worlds: Tensor) -> Tensor:
        """Return numbers of a range with the shape and kind of others."""
        share = self._draws.uniform(*like.shape[1:], worlds=worlds).to(like.dtype)
        return number.low + (number.high - number.low) * share


def make_friction_own(loop: ControlLoop, fraction: float) -> None:
    """Turn the dry friction of joints into torques of the mechanism [N m], to be multiplied.

    Args:
        fraction: Share of the torque of a joint's spring at the end of its range [1]; the model's
            own `joint_dry_friction` counts instead, and is at null afterwards.
    """
    share = torch.full((loop.world_count, 1), fraction, dtype=torch.float64)
    if FRICTION_EFFECT[0] in loop.solver.table.effects:
        own = loop.numbers(*FRICTION_EFFECT)
        share = own.clone().reshape(loop.world_count, -1)
        share = share.repeat_interleave(loop.joint_count // share.shape[1], dim=1)
        own.fill_(0.0)
    stiffness, upper, rest, friction = (
        loop.bench_numbers(name) for name in ("stiffness", "upper", "rest", "friction")
    )
    reach = torch.where(upper < NO_END, upper - rest, 0.0)
    friction.add_(share.to(stiffness) * stiffness * reach)
