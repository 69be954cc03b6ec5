"""Numbers of the plant: the benches as built, and the causes that can be hidden in one."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Pair = tuple[float, float]

SPOOL_RADIUS = 0.0125  # [m]
GAIN = 4.2  # [N/rad]
FORCE_LIMIT = 21.0  # [N] the most the servo can produce, either way
GRAVITY = 9.81  # [m/s^2]


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Numbers of one bench; pairs are [PIP, DIP], a slider uses the first of each pair."""

    kind: Literal["finger", "slider"]
    mass: Pair
    """Masses [kg]."""
    length: Pair = (0.0, 0.0)
    """Lengths of the phalanges [m], centre of mass at half length."""
    stiffness: Pair
    """Return springs [N m/rad], slider [N/m]; at rest where the coordinate is 0."""
    damping: Pair
    """Joint damping [N m s/rad], slider [N s/m]."""
    upper: Pair
    """Upper end of the range [rad], slider [m]; the lower end is 0."""
    stop_stiffness: Pair
    """End stops [N m/rad], slider [N/m]."""
    stop_damping: Pair
    """End stops [N m s/rad], slider [N s/m]."""
    moment_arm: Pair
    """Tendon excursion per coordinate [m], slider [1]."""


def _slider(stiffness: float) -> Bench:
    return Bench(
        kind="slider",
        mass=(0.05, 0.0),
        stiffness=(stiffness, 0.0),
        damping=(5.0, 0.0),
        upper=(0.08, 0.0),
        stop_stiffness=(1.5e5, 0.0),
        stop_damping=(80.0, 0.0),
        moment_arm=(1.0, 0.0),
    )


BENCHES: Mapping[str, Bench] = MappingProxyType(
    {
        "finger": Bench(
            kind="finger",
            mass=(0.012, 0.008),
            length=(0.030, 0.025),
            stiffness=(0.045, 0.030),
            damping=(5e-4, 3e-4),
            upper=(1.75, 1.40),
            stop_stiffness=(30.0, 30.0),
            stop_damping=(0.02, 0.004),
            moment_arm=(0.0080, 0.0055),
        ),
        "spring_weak": _slider(200.0),
        "spring_strong": _slider(800.0),
    }
)


@dataclass(frozen=True, kw_only=True)
class Causes:
    """What makes the plant differ from its nominal self; the defaults hide nothing."""

    viscous: float = 0.0
    """Viscous friction of the motor [N s/rad]."""
    viscous_curvature: float = 0.0
    """Share by which the viscous friction has grown at 20 rad/s [1]."""
    coulomb: float = 0.0
    """Force at which the motor's bristles give way [N]."""
    load: float = 0.0
    """The same, per newton of tendon tension [1]."""
    bristle: float = 7e-6
    """Tendon travel over which friction builds up to 63 % [m]; to 95 % over three times that."""
    delay: float = 0.0
    """Age of the command that the servo acts on [s]."""
    gain_scale: float = 1.0
    """Force per radian against nominal [1]."""
    stiffness_scale: float = 1.0
    """Return springs against nominal [1]."""
    offset: float = 0.0
    """Encoder's zero against the mechanism's [rad]: measured angle = l / r + offset."""
    cogging: float = 0.0
    """Amplitude of the motor force's ripple [N], in sin(cogging_rate * angle + phase)."""
    cogging_rate: float = 8.0
    """Ripples per radian [1/rad]: 8 means 8 per turn."""
    cogging_phase: float = 0.0
    """[rad]."""
    command_step: float = 0.0
    """Resolution of the command inside the servo [rad]; 0 is exact."""
    mass_scale: float = 1.0
    """Unlisted imperfection of the masses [1]."""
    damping_scale: float = 1.0
    """Unlisted imperfection of the joint damping [1]."""


@dataclass(frozen=True, kw_only=True)
class Knock:
    """A hand that pushes along the tendon's path: half a sine of force."""

    start: float
    """[s]."""
    width: float
    """[s]."""
    peak: float
    """[N], positive closes."""
