"""Datasets of the finger between two strings, each with a fault that has an owner, or with none."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import name_of
from tests.planted.physics.sensors import (
    Sensors,
    encoder,
    load_cell,
    speed_register,
)
from tests.planted.two_strings.finger import (
    GAIN,
    ROW_RATE,
    Array,
    Faults,
    Motion,
    Run,
    simulate,
)

DURATION = 4.0  # [s] of each recording
TRAIN, TEST = 3, 1
LEVELS = (
    (0.8, 3.0),
    (0.2, 1.0),
)  # [rad] of flexor and extensor: beyond 1.2 a finger may rest in two ways
HELD = (0.25, 0.7)  # [s] a level is held
BLEND = 0.08  # [s] in which a command moves on, so that the phalanges seldom hit their stops
SILENT = "nothing"


@dataclass(frozen=True, kw_only=True)
class Fault:
    """How large one kind of fault may be."""

    field: str
    """Of `Faults`."""
    parameter: str
    """Of the effect that it is."""
    sizes: tuple[tuple[float, float], ...]
    """Ranges from one of which it is drawn [the effect's unit]."""


OF_SERVO: Mapping[str, Fault] = MappingProxyType(
    {
        "gain_error": Fault(field="gain", parameter="scale", sizes=((0.6, 0.85), (1.2, 1.5))),
        "command_delay": Fault(field="delay", parameter="delay", sizes=((0.015, 0.045),)),
        "coulomb_friction": Fault(field="coulomb", parameter="force", sizes=((0.6, 1.2),)),
        "viscous_friction": Fault(field="viscous", parameter="coefficient", sizes=((0.15, 0.5),)),
        "tendon_slack": Fault(field="slack", parameter="length", sizes=((0.0015, 0.004),)),
        "actuator_lag": Fault(field="lag", parameter="time_constant", sizes=((0.015, 0.04),)),
        "load_cell_gain": Fault(
            field="cell_gain", parameter="scale", sizes=((0.7, 0.88), (1.15, 1.4))
        ),
        "load_cell_bias": Fault(
            field="cell_bias", parameter="offset", sizes=((-0.8, -0.3), (0.3, 0.8))
        ),
    }
)
SHARED = ("command_delay", "gain_error", "viscous_friction")
OF_MECHANISM: Mapping[str, Fault] = MappingProxyType(
    {
        "joint_stiffness_error": Fault(field="stiffness", parameter="scale", sizes=((1.4, 2.2),)),
        "joint_damping_error": Fault(field="damping", parameter="scale", sizes=((2.0, 4.0),)),
    }
)
KINDS: tuple[tuple[str, int | None], ...] = (
    *((name, servo) for name in OF_SERVO for servo in (0, 1)),
    *((name, None) for name in (*SHARED, *OF_MECHANISM, SILENT)),
)
"""Every fault with its owner, and none."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that decides a dataset."""

    fault: str
    """Name in `OF_SERVO` or `OF_MECHANISM`, or `SILENT`."""
    servo: int | None
    """Its owner; None for both servos, the mechanism, or nobody."""
    seed: int

    @property
    def cause(self) -> str | None:
        """What a diagnosis must name."""
        return None if self.fault == SILENT else name_of(self.fault, self.servo)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What was planted."""

    recipe: Recipe
    value: float | None
    """Of the fault's number [the effect's unit]."""


def recipes(cases: int, seed: int, faults: Sequence[str] = ()) -> list[Recipe]:
    """Draw so many recipes of some faults; every kind comes once before any comes again."""
    rng = np.random.default_rng(seed)
    kinds = [kind for kind in KINDS if not faults or kind[0] in faults]
    drawn = [kinds[i] for _ in range(-(-cases // len(kinds))) for i in rng.permutation(len(kinds))]
    return [
        Recipe(fault=fault, servo=servo, seed=1000 * seed + number)
        for number, (fault, servo) in enumerate(drawn[:cases])
    ]


def truth_of(recipe: Recipe) -> Truth:
    """Return what a recipe plants."""
    return draw(recipe, np.random.default_rng(recipe.seed))[0]


def make_datasets(folders: Sequence[Path], chosen: Sequence[Recipe]) -> None:
    """Write datasets with their starting models, simulated side by side."""
    rngs = [np.random.default_rng(recipe.seed) for recipe in chosen]
    drawn = [draw(recipe, rng) for recipe, rng in zip(chosen, rngs, strict=True)]
    runs = [
        Run(command=commands(rng), faults=faults)
        for rng, (_, faults) in zip(rngs, drawn, strict=True)
        for _ in range(TRAIN + TEST)
    ]
    motions = simulate(runs)
    for number, (folder, rng) in enumerate(zip(folders, rngs, strict=True)):
        own = slice(number * (TRAIN + TEST), (number + 1) * (TRAIN + TEST))
        recordings = [
            record(rng, f"run_{i}.csv", run, motion)
            for i, (run, motion) in enumerate(zip(runs[own], motions[own], strict=True))
        ]
        write_dataset(folder, recordings[:TRAIN], recordings[TRAIN:])
        source = NamedValues(name="ideal", values={"gain": GAIN})
        write_model(folder / "model.toml", Model(actuator=source))


def draw(recipe: Recipe, rng: np.random.Generator) -> tuple[Truth, Faults]:
    """Draw the size of a fault."""
    fault = {**OF_SERVO, **OF_MECHANISM}.get(recipe.fault)
    if fault is None:
        return Truth(recipe=recipe, value=None), Faults()
    value = float(rng.uniform(*fault.sizes[int(rng.integers(len(fault.sizes)))]))
    if recipe.fault in OF_MECHANISM:
        return Truth(recipe=recipe, value=value), replace(Faults(), **{fault.field: value})
    pair = list(getattr(Faults(), fault.field))
    for servo in (0, 1) if recipe.servo is None else (recipe.servo,):
        pair[servo] = value
    return Truth(recipe=recipe, value=value), replace(Faults(), **{fault.field: tuple(pair)})


def commands(rng: np.random.Generator) -> Array:
    """Draw levels of both servos, each on its own, with short ramps between them [rad]."""
    rows = round(DURATION * ROW_RATE)
    time = np.arange(rows) / ROW_RATE
    columns = []
    for low, high in LEVELS:
        starts, levels = [0.0], [rng.uniform(low, high)]
        while starts[-1] < DURATION:
            starts += [starts[-1] + rng.uniform(*HELD)]
            levels += [rng.uniform(low, high)]
        knots = np.ravel([(start, start + BLEND) for start in starts[1:]])
        columns.append(np.interp(time, knots, np.repeat(levels, 2)[1:-1]))
    return np.stack(columns, axis=1).round(6)


def record(rng: np.random.Generator, name: str, run: Run, motion: Motion) -> Recording:
    """Pass a motion through encoders and load cells."""
    speed = np.gradient(motion.angle, 1.0 / ROW_RATE, axis=0)
    signals: dict[str, Callable[[Array], Array]] = {
        "motor_position": lambda d: encoder(motion.angle[:, d]).round(6),
        "motor_velocity": lambda d: speed_register(rng, speed[:, d]).round(3),
        "force": lambda d: load_cell(rng, motion.force[:, d], Sensors()).round(4),
    }
    return Recording(
        name=name,
        bench="finger_antagonist",
        time=np.arange(len(run.command)) / ROW_RATE,
        command=run.command,
        **{key: np.stack([signal(d) for d in (0, 1)], axis=1) for key, signal in signals.items()},
    )
