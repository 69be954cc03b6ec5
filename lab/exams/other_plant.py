"""A second plant, by other laws than the first: so that not all exams are of one family.

Plain NumPy; no law, command, sensor or number is shared with the simulator or with
``tests.planted``, but for the benches' drawings. Against the first plant:

- friction is that of LuGre, whose bristles bend by 150 um before they slide;
- end stops and obstructions are spheres (Hertz), which rebound (Hunt and Crossley);
- a motor nears its limit by a power law, and friction falls with speed as 1 / (1 + v);
- masses and lengths are up to 10 % off their drawing, one moment arm up to 5 %: further off, an arm
  is a cause of its own by what is stated of drawings, and so is a damper;
- rows come 100 times a second with a jitter of 0.2 ms, from an encoder that is not quite round and
  truncates to 14 bit, and a load cell with hum and counts of 10 mN.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]

STEP, ROW = 1e-4, 1e-2  # Steps of the plant and of its log [s]
SETTLING = 1.5  # Time under the first command before the log begins [s]
RADIUS, GAIN, LIMIT, GRAVITY = 0.0125, 4.2, 21.0, 9.81
BRISTLE = 150e-6  # Travel in which friction builds up to 63 % [m]
SPHERE = 1.5  # Exponent of a contact of spheres
OBSTACLE_DEPTH, OBSTACLE_REBOUND = 2e-3, 0.4
"""Depth at which an obstacle's contact is as stiff as stated [m], and its damping [s/m]."""
NULLS: Mapping[str, float] = {
    "gain": 1.0, "drift": 0.0, "delay": 0.0, "lag": 0.0, "deadband": 0.0, "saturation": 0.0,
    "coulomb": 0.0, "static": 0.0, "stribeck_speed": 1.0, "viscous": 0.0, "load": 0.0, "sag": 0.0,
    "routing": 0.0, "radius": 1.0, "stiffness": 1.0, "damping": 1.0, "inertia": 1.0,
    "stiffening": 0.0, "maxwell": 0.0, "relaxation": 1.0, "obstruction": 0.0, "obstruction_at": 1.0,
    "tilt": 0.0, "offset": 0.0, "cell_bias": 0.0, "cell_gain": 1.0, "cell_drift": 0.0,
    "cell_lag": 0.0, "cell_delay": 0.0,
}  # fmt: skip
"""What hides nothing; units are those of the catalogue's effects."""


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """A bench: two joints of a finger, or a slider, whose second joint stays where it is."""

    mass: Array  # [kg]
    length: Array  # Of the links [m]; 0 on a slider
    stiffness: Array  # [N m/rad], slider [N/m]
    damping: Array  # [N m s/rad], slider [N s/m]
    upper: Array  # End of the range [rad], slider [m]; it begins at 0
    stop: Array  # Stiffness of the ends [N m/rad], slider [N/m]
    depth: float
    """Depth at which they are as stiff as that [rad], slider [m]: that of a few newtons."""
    rebound: float  # Damping of the ends over their force [s/rad], slider [s/m]
    arm: Array  # Excursion per coordinate [m], slider [1]


def pair(*values: float) -> Array:
    """Return numbers of both joints, to be spread over runs."""
    return np.array(values)[:, None]


def slider(stiffness: float) -> Drawing:
    """Return a slider's drawing; its second joint is locked."""
    return Drawing(
        mass=pair(0.05, 1.0), length=pair(0.0, 0.0), stiffness=pair(stiffness, 0.0),
        damping=pair(5.0, 0.0), upper=pair(0.08, 1.0), stop=pair(1.5e5, 0.0), arm=pair(1.0, 0.0),
        depth=1e-4, rebound=0.4,
    )  # fmt: skip


DRAWINGS: Mapping[str, Drawing] = {
    "spring_weak": slider(200.0),
    "spring_strong": slider(800.0),
    "finger": Drawing(
        mass=pair(0.012, 0.008), length=pair(0.030, 0.025), stiffness=pair(0.045, 0.030),
        damping=pair(5e-4, 3e-4), upper=pair(1.75, 1.40), stop=pair(30.0, 30.0),
        arm=pair(0.0080, 0.0055), depth=4e-3, rebound=0.02,
    ),
}  # fmt: skip


def as_built(rng: np.random.Generator, name: str, share: float = 0.1) -> Drawing:
    """Return a bench that is off its drawing by up to a share, one moment arm by half of that."""
    drawn = DRAWINGS[name]
    off = 1.0 + share * rng.uniform(-1.0, 1.0, size=(3, 2, 1))
    arm = drawn.arm.copy()
    if name == "finger":
        arm[int(rng.integers(2))] *= 0.5 * (1.0 + off[2, 0])
    return replace(drawn, mass=drawn.mass * off[0], length=drawn.length * off[1], arm=arm)


def side_by_side(benches: Sequence[Drawing]) -> Drawing:
    """Return benches of one kind as one, whose numbers have a column for each."""
    numbers = ("mass", "length", "stiffness", "damping", "upper", "stop", "arm")
    columns = {n: np.concatenate([getattr(b, n) for b in benches], axis=1) for n in numbers}
    return replace(benches[0], **columns)


def simulate(bench: Drawing, causes: Mapping[str, Array], command: Array) -> tuple[Array, Array]:
    """Run a bench from rest; return its shaft's angle [rad] and its tension [N] at every step.

    Args:
        bench: As it was built.
        causes: Numbers of ``NULLS``, shape (R,) each.
        command: Goals at every step [rad], shape (T, R); they begin with the settling.
    """
    steps, runs = command.shape
    c = causes
    radius = RADIUS * c["radius"]
    acceleration = finger if bench.length[0, 0] > 0.0 else slide
    late = np.round(c["delay"] / STEP).astype(np.intp)
    columns = np.arange(runs)
    q, v, held = (np.zeros((2, runs)) for _ in range(3))
    bend, motor, tension = (np.zeros(runs) for _ in range(3))
    guide = np.zeros(runs)
    lagging = np.where(c["lag"] > 0.0, 1.0 - np.exp(-STEP / np.maximum(c["lag"], STEP)), 1.0)
    relaxing = np.exp(-STEP / c["relaxation"])
    limit = np.where(c["saturation"] > 0.0, c["saturation"], np.inf)
    angles, tensions = np.empty((2, steps, runs))
    for n in range(steps):
        excursion, speed = (bench.arm * q).sum(axis=0), (bench.arm * v).sum(axis=0)
        angle = excursion / radius + c["offset"]
        error = command[np.maximum(n - late, 0), columns] - angle
        error = np.sign(error) * np.maximum(np.abs(error) - c["deadband"], 0.0)
        wanted = GAIN * c["gain"] * (1.0 - c["drift"] * max(0.0, n * STEP - SETTLING)) * error
        wanted = np.clip(wanted, -LIMIT, LIMIT)
        wanted = wanted / (1.0 + np.abs(wanted / limit) ** 8) ** 0.125
        wanted = wanted / (1.0 + c["sag"] * np.abs(wanted))
        motor = motor + lagging * (wanted - motor)
        sliding = c["coulomb"] + c["load"] * tension
        most = sliding + c["static"] / (1.0 + np.abs(speed) / (RADIUS * c["stribeck_speed"]))
        # LuGre: bristles of stiffness sliding / BRISTLE bend until they carry `most`
        share = np.where(most > 0.0, sliding / np.maximum(most, 1e-9), 1.0)
        bend = np.clip(bend + STEP * (speed - share * np.abs(speed) * bend) / BRISTLE, -4.0, 4.0)
        tension = np.maximum(0.0, motor - c["viscous"] * speed / radius - sliding * bend)
        guide = guide + STEP * (speed - np.abs(speed) * guide) / BRISTLE
        pull = tension * np.exp(-c["routing"] * guide)
        pull -= hertz(
            excursion - c["obstruction_at"] * RADIUS, speed, c["obstruction"],
            OBSTACLE_DEPTH, OBSTACLE_REBOUND,
        )  # fmt: skip
        spring = c["stiffness"] * bench.stiffness
        force = bench.arm * pull - held - c["damping"] * bench.damping * v
        force -= spring * q * (1.0 + c["stiffening"] * (q / bench.upper) ** 2)
        for side, depth in ((1.0, -q), (-1.0, q - bench.upper)):
            force += side * hertz(depth, -side * v, bench.stop, bench.depth, bench.rebound)
        v = v + STEP * acceleration(bench, q, v, force, c["tilt"], c["inertia"])
        q = q + STEP * v
        held = held * relaxing + c["maxwell"] * bench.stiffness * STEP * v
        angles[n], tensions[n] = angle, tension
    return angles, tensions


def hertz(depth: Array, speed: Array, stiffness: Array, at: float, rebound: float) -> Array:
    """Return the force of a contact of spheres that is as stiff as a spring at one depth.

    Its damping takes or adds all of that force at most: more would need shorter steps.
    """
    inside = np.maximum(depth, 0.0)
    force = stiffness / at ** (SPHERE - 1.0) * inside**SPHERE
    return force * np.clip(1.0 + rebound * speed, 0.0, 2.0)


def slide(b: Drawing, q: Array, v: Array, force: Array, tilt: Array, inertia: Array) -> Array:
    """Return the acceleration of a slider."""
    out = (force + b.mass * GRAVITY * np.sin(tilt)) / (inertia * b.mass)
    out[1] = 0.0
    return out


def finger(b: Drawing, q: Array, v: Array, force: Array, tilt: Array, inertia: Array) -> Array:
    """Return the accelerations of two links in a plane (Lagrange)."""
    (m1, m2), (l1, l2) = b.mass, b.length
    both = q[0] + q[1]
    far = m2 * l2**2 / 3.0
    mixed = 0.5 * m2 * l1 * l2
    near = m1 * l1**2 / 3.0 + m2 * l1**2 + far + 2.0 * mixed * np.cos(q[1])
    cross = far + mixed * np.cos(q[1])
    swing = inertia * mixed * np.sin(q[1])
    weight = 0.5 * m2 * GRAVITY * l2 * np.cos(both + tilt)
    first = force[0] + swing * v[1] * (2.0 * v[0] + v[1]) + weight
    first = first + (0.5 * m1 + m2) * GRAVITY * l1 * np.cos(q[0] + tilt)
    second = force[1] - swing * v[0] ** 2 + weight
    det = inertia * (near * far - cross**2)
    return np.stack([(far * first - cross * second) / det, (near * second - cross * first) / det])


def logged(
    rng: np.random.Generator, causes: Mapping[str, float], angle: Array, tension: Array
) -> tuple[Array, Array, Array]:
    """Return instants [s], angle [rad] and force [N] as the log has them.

    Args:
        rng: Source of noise.
        causes: Numbers of ``NULLS``.
        angle: Angle of the shaft at every step [rad].
        tension: Tension at every step [N].
    """
    first = round(SETTLING / STEP)
    time = np.arange(0.0, (angle.size - first) * STEP - 2 * ROW, ROW)
    late = np.abs(rng.normal(0.0, 2e-4, time.size))
    rows = first + np.round((time + late) / STEP).astype(np.intp)
    turned = angle + 0.5e-3 * np.sin(2.0 * angle)
    count = 2.0 * np.pi / 2**14
    cell = low_passed(tension, causes["cell_lag"]) if causes["cell_lag"] > 0.0 else tension
    at = np.maximum(rows - round(causes["cell_delay"] / STEP), 0)
    force = causes["cell_gain"] * cell[at] + causes["cell_bias"] + causes["cell_drift"] * time
    force += 0.02 * np.sin(2.0 * np.pi * 50.2 * time) + rng.normal(0.0, 0.04, time.size)
    return time, np.floor(turned[rows] / count) * count, np.round(force, 2)


def low_passed(signal: Array, time_constant: float) -> Array:
    """Return a signal through a low pass of first order."""
    kept = float(np.exp(-STEP / time_constant))
    filtered, _ = lfilter([1.0 - kept], [1.0, -kept], signal, zi=[kept * signal[0]])
    return filtered


def chirp(rng: np.random.Generator, time: Array) -> Array:
    """Return a sinusoid that quickens [rad]."""
    pace = rng.uniform(0.3, 0.6) * time + 0.5 * rng.uniform(0.05, 0.15) * time**2
    return rng.uniform(2.2, 3.4) - rng.uniform(1.2, 2.0) * np.cos(2.0 * np.pi * pace)


def trapezes(rng: np.random.Generator, time: Array) -> Array:
    """Return slopes between levels that are held [rad]."""
    knots = np.cumsum(rng.uniform(0.4, 1.4, size=60))
    levels = np.repeat(rng.uniform(0.0, 6.0, size=30), 2)
    return np.interp(time, knots, levels)


def jumps(rng: np.random.Generator, time: Array) -> Array:
    """Return levels that change at once [rad]."""
    knots = np.cumsum(rng.uniform(0.6, 2.0, size=40))
    return rng.uniform(0.0, 6.0, size=41)[np.searchsorted(knots, time)]


COMMANDS: tuple[Callable[[np.random.Generator, Array], Array], ...] = (chirp, trapezes, jumps)
