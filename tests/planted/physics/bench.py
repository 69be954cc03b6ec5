"""Numbers of the plant: the benches as drawn, and as somebody may have built them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

Pair = tuple[float, float]

SPOOL_RADIUS = 0.0125  # [m]
GAIN = 4.2  # [N/rad]
FORCE_LIMIT = 21.0  # [N] the most the servo can produce, either way
GRAVITY = 9.81  # [m/s^2]
PENDULUM_DAMPING = 0.1  # [N m s/rad] told to the model; the drawing has none


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Numbers of one bench; pairs are [PIP, DIP], the others use the first of each pair."""

    kind: Literal["finger", "slider", "pendulum"]
    mass: Pair  # Masses [kg]
    # Lengths of the phalanges [m], centre of mass at half length; pendulum: of the arm
    length: Pair = (0.0, 0.0)
    stiffness: Pair  # Return springs [N m/rad], slider [N/m]; at rest where the coordinate is 0
    damping: Pair  # Joint damping [N m s/rad], slider [N s/m]
    upper: Pair  # Upper end of the range [rad], slider [m]; the lower end is 0
    stop_stiffness: Pair  # End stops [N m/rad], slider [N/m]
    stop_damping: Pair  # End stops [N m s/rad], slider [N s/m]
    moment_arm: Pair  # Tendon excursion per coordinate [m], slider and pendulum [1]

    @property
    def direct(self) -> bool:
        """Whether the shaft itself is the joint: it pushes as well as pulls, and l is an angle."""
        return self.kind == "pendulum"

    @property
    def spool_radius(self) -> float:
        """Excursion per radian of the motor [m], pendulum [1]."""
        return 1.0 if self.direct else SPOOL_RADIUS


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


BENCHES: Mapping[str, Bench] = {
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
    "pendulum": Bench(
        kind="pendulum",
        mass=(0.49, 0.0),
        length=(0.10, 0.0),
        stiffness=(0.0, 0.0),
        damping=(PENDULUM_DAMPING, 0.0),
        upper=(2.0 * np.pi, 0.0),  # without effect: no spring, no stops
        stop_stiffness=(0.0, 0.0),
        stop_damping=(0.0, 0.0),
        moment_arm=(1.0, 0.0),
    ),
}


def as_built(rng: np.random.Generator, share: float) -> Mapping[str, Bench]:
    """Draw benches whose masses, link lengths and one moment arm are off by up to a share [1]."""
    built: dict[str, Bench] = dict(BENCHES)
    for name, bench in BENCHES.items():
        if bench.direct:
            continue  # one mass on one arm: both are told with the recording
        off = 1.0 + share * rng.uniform(-1.0, 1.0, size=5)
        arm = list(bench.moment_arm)
        if bench.kind == "finger":
            arm[int(rng.integers(2))] *= off[4]
        built[name] = replace(
            bench,
            mass=(bench.mass[0] * off[0], bench.mass[1] * off[1]),
            length=(bench.length[0] * off[2], bench.length[1] * off[3]),
            moment_arm=(arm[0], arm[1]),
        )
    return built
