"""What can be planted, and how strong: one function per cause, drawn by seed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from tests.planted.bench import Causes, Knock

VISCOUS_KNOWN = 1.5  # [N s/rad] of a servo whose friction the model knows
COULOMB_KNOWN = 0.8  # [N]
BRISTLES = (5e-6, 40e-6)  # [m] range of pre-sliding travels, drawn evenly in the logarithm

Values = Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Planted:
    """One hidden cause: as the contract names it, and as the plant has it."""

    parameters: Values = field(default_factory=lambda: MappingProxyType({}))
    """Parameters of the effect in its own words and units."""
    causes: Values = field(default_factory=lambda: MappingProxyType({}))
    """The fields of ``Causes`` that it changes."""
    knocks_per_second: float = 0.0
    """Hands in the way [1/s]."""
    knock_peak: float = 0.0
    """Their typical force [N]."""

    def built_on(self, base: Causes) -> Causes:
        """Add this cause to a plant; frictions add up."""
        sums = {name: getattr(base, name) + self.causes.get(name, 0.0) for name in FRICTIONS}
        return Causes(**{**vars(base), **self.causes, **sums})


FRICTIONS = ("viscous", "coulomb", "load")


def _single(effect_parameter: str, cause: str, value: float) -> Planted:
    return Planted(
        parameters=MappingProxyType({effect_parameter: value}),
        causes=MappingProxyType({cause: value}),
    )


def _either(rng: np.random.Generator, low: tuple[float, float], high: tuple[float, float]) -> float:
    return float(rng.uniform(*(low if rng.random() < 0.5 else high)))


def viscous_friction(rng: np.random.Generator) -> Planted:
    """Viscous friction of 0.8 to 1.8 N s/rad."""
    return _single("coefficient", "viscous", float(rng.uniform(0.8, 1.8)))


def coulomb_friction(rng: np.random.Generator) -> Planted:
    """Dry friction of 0.7 to 1.5 N."""
    return _single("force", "coulomb", float(rng.uniform(0.7, 1.5)))


def load_dependent_friction(rng: np.random.Generator) -> Planted:
    """Dry friction of 8 to 20 % of the tension."""
    return _single("coefficient", "load", float(rng.uniform(0.08, 0.20)))


def command_delay(rng: np.random.Generator) -> Planted:
    """A command 15 to 45 ms late."""
    return _single("delay", "delay", float(rng.uniform(0.015, 0.045)))


def gain_error(rng: np.random.Generator) -> Planted:
    """A servo 12 to 30 % too soft or too hard."""
    return _single("scale", "gain_scale", _either(rng, (0.70, 0.88), (1.12, 1.30)))


def joint_stiffness_error(rng: np.random.Generator) -> Planted:
    """Return springs 12 to 30 % too soft or too hard."""
    return _single("scale", "stiffness_scale", _either(rng, (0.70, 0.88), (1.12, 1.30)))


def position_offset(rng: np.random.Generator) -> Planted:
    """An encoder's zero 0.03 to 0.15 rad off, either way."""
    return _single("angle", "offset", _either(rng, (-0.15, -0.03), (0.03, 0.15)))


def periodic_cogging(rng: np.random.Generator) -> Planted:
    """A ripple of the motor force of 0.4 to 0.8 N, eight times a turn."""
    amplitude, phase = float(rng.uniform(0.4, 0.8)), float(rng.uniform(0.0, 2.0 * np.pi))
    return Planted(
        parameters=MappingProxyType({"amplitude": amplitude, "per_radian": 8.0, "phase": phase}),
        causes=MappingProxyType({"cogging": amplitude, "cogging_phase": phase}),
    )


def command_quantisation(rng: np.random.Generator) -> Planted:
    """A servo that hears its command in steps of 0.1 to 0.2 rad."""
    return _single("lsb", "command_step", float(rng.uniform(0.1, 0.2)))


def hand_knocks(rng: np.random.Generator) -> Planted:
    """Pushes of about 4 to 7 N, about once a second."""
    peak, rate = float(rng.uniform(4.0, 7.0)), float(rng.uniform(0.7, 1.2))
    return Planted(
        parameters=MappingProxyType({"peak": peak, "per_second": rate}),
        knocks_per_second=rate,
        knock_peak=peak,
    )


Draw = Callable[[np.random.Generator], Planted]

EFFECTS: Mapping[str, Draw] = MappingProxyType(
    {
        "viscous_friction": viscous_friction,
        "coulomb_friction": coulomb_friction,
        "load_dependent_friction": load_dependent_friction,
        "command_delay": command_delay,
        "gain_error": gain_error,
        "joint_stiffness_error": joint_stiffness_error,
        "position_offset": position_offset,
    }
)

# causes that no effect of the catalogue describes: naming one for them is an error
OUTSIDE: Mapping[str, Draw] = MappingProxyType(
    {
        "periodic_cogging": periodic_cogging,
        "command_quantisation": command_quantisation,
        "hand_knocks": hand_knocks,
    }
)


def base_causes(rng: np.random.Generator, *, known_friction: bool, imperfection: float) -> Causes:
    """Draw the servo and the bench under the planted cause.

    Args:
        rng: Source of chance.
        known_friction: Whether the servo has the friction that its model lists.
        imperfection: Size of unlisted faults [1]: 1 is about 0.3 % of the masses, 1 % of the
            damping, 3 % of curvature in the viscous friction and a ripple of 5 mN.
    """
    faults = imperfection * rng.uniform(-1.0, 1.0, size=3)
    return Causes(
        viscous=VISCOUS_KNOWN if known_friction else 0.0,
        coulomb=COULOMB_KNOWN if known_friction else 0.0,
        bristle=float(np.exp(rng.uniform(*np.log(BRISTLES)))),
        mass_scale=1.0 + 0.003 * float(faults[0]),
        damping_scale=1.0 + 0.01 * float(faults[1]),
        viscous_curvature=0.03 * float(faults[2]),
        cogging=0.005 * imperfection,
    )


def draw_knocks(rng: np.random.Generator, planted: Planted, duration: float) -> tuple[Knock, ...]:
    """Draw when and how hard the hand knocks, 30 to 80 ms each, either way."""
    knocks: list[Knock] = []
    if planted.knocks_per_second == 0.0:
        return ()
    start = float(rng.exponential(1.0 / planted.knocks_per_second))
    while start < duration:
        width = float(rng.uniform(0.03, 0.08))
        peak = planted.knock_peak * float(rng.uniform(0.6, 1.2) * rng.choice([-1.0, 1.0]))
        knocks.append(Knock(start=start, width=width, peak=peak))
        start += width + float(rng.exponential(1.0 / planted.knocks_per_second))
    return tuple(knocks)
