"""Datasets of the second plant, with their truths."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lab.exams.exam_draws import are_alike
from lab.exams.other_plant import (
    COMMANDS,
    NULLS,
    SETTLING,
    STEP,
    Array,
    as_built,
    logged,
    side_by_side,
    simulate,
)
from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import write_model
from tendon_newton.data.recording import Recording
from tests.planted.generator import starting_model
from tests.planted.physics.sensors import ENCODER_STEP, FORCE_NOISE
from tests.planted.truth import THETA, WEAK, rms

TRAIN, TEST = 5, 3
OFF_DRAWING = 0.1  # Share by which benches are off their drawing [1]
DURATION = 13.0  # Of a recording [s]
BENCHES = (("finger",), ("spring_weak", "spring_strong"))
ON_FINGER = frozenset(("gravity_misalignment", "joint_stiffness_error"))
"""Causes that springs of a slider cannot tell from others."""

Logged = tuple[Array, Array, Array]  # Instants [s], angles [rad] and forces [N] of a log
Draw = Callable[[np.random.Generator], tuple[Mapping[str, float], Mapping[str, float]]]
"""Draws a cause: the effect's numbers, and the plant's."""


def one(parameter: str, cause: str, low: float, high: float, *, signed: bool = False) -> Draw:
    """Return a draw of one number that effect and plant share; scales are 1 more than drawn."""

    def draw(rng: np.random.Generator) -> tuple[Mapping[str, float], Mapping[str, float]]:
        value = float(rng.uniform(low, high)) * (float(rng.choice([-1.0, 1.0])) if signed else 1.0)
        value += NULLS[cause] if parameter == "scale" else 0.0
        return {parameter: value}, {cause: value}

    return draw


def stribeck(rng: np.random.Generator) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Draw a friction that falls with speed; the speed at which it does is no law's of ours."""
    sliding = float(rng.uniform(0.5, 0.9))
    static = sliding * float(rng.uniform(1.5, 2.2))
    speed = float(rng.uniform(1.0, 3.0))
    own = {"coulomb": sliding, "static": static - sliding, "stribeck_speed": speed}
    return {"coulomb_force": sliding, "static_force": static}, own


def viscoelastic(rng: np.random.Generator) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Draw a relaxing spring beside each spring."""
    ratio, time = float(rng.uniform(0.3, 0.65)), float(rng.uniform(0.2, 1.2))
    told = {"stiffness_ratio": ratio, "relaxation_time": time}
    return told, {"maxwell": ratio, "relaxation": time}


def obstruction(rng: np.random.Generator) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Draw a sphere in the way; its stiffness is no spring's."""
    position = float(rng.uniform(0.6, 1.2))
    own = {"obstruction": float(rng.uniform(300.0, 800.0)), "obstruction_at": position}
    return {"position": position}, own


DRAWS: Mapping[str, Draw] = {
    "gain_error": one("scale", "gain", 0.12, 0.3, signed=True),
    "gain_drift": one("rate", "drift", 0.008, 0.015, signed=True),
    "command_delay": one("delay", "delay", 0.015, 0.045),
    "actuator_lag": one("time_constant", "lag", 0.02, 0.08),
    "deadband": one("width", "deadband", 0.06, 0.25),
    "force_saturation": one("limit", "saturation", 6.0, 9.0),
    "coulomb_friction": one("force", "coulomb", 0.7, 1.5),
    "stribeck_friction": stribeck,
    "viscous_friction": one("coefficient", "viscous", 0.8, 1.8),
    "load_dependent_friction": one("coefficient", "load", 0.08, 0.2),
    "voltage_sag": one("sag", "sag", 0.02, 0.06),
    "routing_friction": one("exponent", "routing", 0.08, 0.25),
    "spool_radius_error": one("scale", "radius", 0.07, 0.2, signed=True),
    "joint_stiffness_error": one("scale", "stiffness", 0.12, 0.3, signed=True),
    "joint_damping_error": one("scale", "damping", 1.5, 5.0),
    "inertia_error": one("scale", "inertia", 1.5, 4.0),
    "spring_stiffening": one("beta", "stiffening", 0.3, 1.2),
    "viscoelastic_spring": viscoelastic,
    "obstruction": obstruction,
    "gravity_misalignment": one("angle", "tilt", 0.25, 0.6, signed=True),
    "position_offset": one("angle", "offset", 0.03, 0.15, signed=True),
    "load_cell_bias": one("offset", "cell_bias", 0.2, 1.0, signed=True),
    "load_cell_gain": one("scale", "cell_gain", 0.05, 0.2, signed=True),
    "load_cell_drift": one("rate", "cell_drift", 0.02, 0.06, signed=True),
    "load_cell_lag": one("time_constant", "cell_lag", 0.015, 0.07),
    "load_cell_delay": one("delay", "cell_delay", 0.02, 0.11),
}
"""Causes of the second plant, by the catalogue's names."""


@dataclass(frozen=True, kw_only=True)
class OtherRecipe:
    """What decides a dataset of the second plant."""

    effects: tuple[str, ...]
    seed: int
    benches: tuple[str, ...]


def other_recipes(seed: int, singles: int, pairs: int, clean: int) -> list[OtherRecipe]:
    """Draw causes in turn, pairs that do not imitate each other, and sets without a cause."""
    rng = np.random.default_rng(seed)
    order = list(map(str, rng.permutation(list(DRAWS))))
    drawn = [(order[k % len(order)],) for k in range(singles)]
    while len(drawn) < singles + pairs:
        two = tuple(map(str, rng.choice(list(DRAWS), size=2, replace=False)))
        drawn += [] if are_alike(two) else [two]
    drawn += [()] * clean
    return [
        OtherRecipe(
            effects=effects,
            seed=seed + k,
            benches=BENCHES[0 if ON_FINGER & set(effects) else k % 2],
        )
        for k, effects in enumerate(drawn)
    ]


def make_other(out: Path, recipe: OtherRecipe) -> dict[str, Any]:
    """Write a dataset of the second plant; return its truth."""
    rng = np.random.default_rng(recipe.seed)
    told, own = drawn(rng, {name: DRAWS[name] for name in recipe.effects})
    ((force, theta),) = write_set(out, rng, recipe, own, without=[tuple(recipe.effects)])
    ratio, ratio_theta = force / FORCE_NOISE, float(theta / (ENCODER_STEP / np.sqrt(12.0)))
    return {
        "family": ("clean", "single", "pair")[len(recipe.effects)],
        "effects": [{"name": name, "parameters": told[name]} for name in recipe.effects],
        "weak": bool(recipe.effects) and max(ratio, ratio_theta / THETA) < WEAK,
        "strength": {"ratio": ratio, "ratio_theta": ratio_theta},
        "seed": recipe.seed,
    }


def drawn(
    rng: np.random.Generator, draws: Mapping[str, Draw]
) -> tuple[dict[str, Mapping[str, float]], dict[str, Mapping[str, float]]]:
    """Draw causes; return the effects' numbers and the plant's, by cause."""
    both = {name: draw(rng) for name, draw in draws.items()}
    return {n: told for n, (told, _) in both.items()}, {n: own for n, (_, own) in both.items()}


def write_set(
    out: Path,
    rng: np.random.Generator,
    recipe: OtherRecipe,
    own: Mapping[str, Mapping[str, float]],
    *,
    without: Sequence[Sequence[str]],
    off: float = OFF_DRAWING,
) -> list[tuple[float, float]]:
    """Write recordings and the starting model of a plant with causes.

    Args:
        out: Folder of the dataset.
        rng: Source of commands and of how the benches were built.
        recipe: Seed and benches.
        own: The plant's numbers, by cause.
        without: Sets of causes that are mended, each in a copy of the tested runs.
        off: Share by which benches are off their drawing [1].

    Returns:
        What each mending changes in the tested runs: RMS force [N] and angle [rad].
    """
    benches = [recipe.benches[k % len(recipe.benches)] for k in range(TRAIN + TEST)]
    again = [*range(TRAIN + TEST), *(list(range(TRAIN, TRAIN + TEST)) * len(without))]
    numbers = [mended(own, ())] * (TRAIN + TEST)
    numbers += [mended(own, names) for names in without for _ in range(TEST)]
    time = np.arange(0.0, SETTLING + DURATION, STEP)
    goals = [COMMANDS[k % 3](rng, np.maximum(time - SETTLING, 0.0)) for k in range(TRAIN + TEST)]
    goal = np.round(np.stack([goals[k] for k in again], axis=1), 6)
    causes = {n: np.array([each[n] for each in numbers]) for n in NULLS}
    built = {name: as_built(rng, name, off) for name in recipe.benches}
    bench = side_by_side([built[benches[k]] for k in again])
    angles, tensions = simulate(bench, causes, held(goal))
    rows = [
        logged(np.random.default_rng([recipe.seed, k]), each, angles[:, place], tensions[:, place])
        for place, (k, each) in enumerate(zip(again, numbers, strict=True))
    ]
    logs = [recording(benches[k], k, rows[k], goal[:, k]) for k in range(TRAIN + TEST)]
    write_dataset(out, logs[:TRAIN], logs[TRAIN:])
    write_model(out / "model.toml", starting_model(known_friction=False))
    tested = rows[TRAIN : TRAIN + TEST]
    spared = [rows[first : first + TEST] for first in range(TRAIN + TEST, len(rows), TEST)]
    return [(moved(tested, each, 2), moved(tested, each, 1)) for each in spared]


def mended(own: Mapping[str, Mapping[str, float]], names: Sequence[str]) -> dict[str, float]:
    """Return the plant's numbers where some of its causes are mended."""
    left = [numbers for name, numbers in own.items() if name not in names]
    return {**NULLS, **{k: v for numbers in left for k, v in numbers.items()}}


def moved(tested: Sequence[Logged], spared: Sequence[Logged], place: int) -> float:
    """Return by how much a signal differs between runs, RMS."""
    return rms([a[place] - b[place] for a, b in zip(tested, spared, strict=True)])


def held(goals: Array) -> Array:
    """Return goals as a servo hears them: one each row, held until the next."""
    rows = round(1e-2 / STEP)
    places = np.arange(goals.shape[0])
    first = round(SETTLING / STEP) % rows
    return goals[np.maximum((places - first) // rows * rows + first, 0)]


def recording(bench: str, number: int, rows: Sequence[Array], goals: Array) -> Recording:
    """Return what was logged."""
    time, angle, force = rows
    at = round(SETTLING / STEP) + np.round(time / STEP).astype(np.intp)
    return Recording(
        name=f"{bench}_{number}.csv",
        bench=bench,
        time=time.round(6),
        command=goals[at, None],
        motor_position=angle.round(6)[:, None],
        motor_velocity=np.gradient(angle, time)[:, None],
        force=force[:, None],
    )
