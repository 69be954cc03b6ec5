"""Datasets of a bench of several servos, each with a fault that has an owner, or with none."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import name_of
from tests.planted.owners.plant import GAIN, ROW_RATE, Faults, Finger, Motion, Run, simulate
from tests.planted.owners.strings import Array
from tests.planted.physics.sensors import Sensors, encoder, load_cell, speed_register

TRAIN, TEST = 3, 1
HELD = (0.25, 0.7)  # [s] a level is held
BLEND = 0.08  # [s] in which a command moves on, so that the phalanges seldom hit their stops
SILENT = "nothing"


@dataclass(frozen=True, kw_only=True)
class Fault:
    """How large one kind of fault may be."""

    field: str  # Of `Faults`
    parameter: str  # Of the effect that it is
    # Ranges from one of which it is drawn [the effect's unit]
    sizes: tuple[tuple[float, float], ...]


OF_SERVO: Mapping[str, Fault] = {
    "gain_error": Fault(field="gain", parameter="scale", sizes=((0.6, 0.85), (1.2, 1.5))),
    "command_delay": Fault(field="delay", parameter="delay", sizes=((0.015, 0.045),)),
    "coulomb_friction": Fault(field="coulomb", parameter="force", sizes=((0.6, 1.2),)),
    "viscous_friction": Fault(field="viscous", parameter="coefficient", sizes=((0.15, 0.5),)),
    "tendon_slack": Fault(field="slack", parameter="length", sizes=((0.0015, 0.004),)),
    "actuator_lag": Fault(field="lag", parameter="time_constant", sizes=((0.015, 0.04),)),
    "load_cell_gain": Fault(field="cell_gain", parameter="scale", sizes=((0.7, 0.88), (1.15, 1.4))),
    "load_cell_bias": Fault(
        field="cell_bias", parameter="offset", sizes=((-0.8, -0.3), (0.3, 0.8))
    ),
}
OF_MECHANISM: Mapping[str, Fault] = {
    "joint_stiffness_error": Fault(field="stiffness", parameter="scale", sizes=((1.4, 2.2),)),
    "joint_damping_error": Fault(field="damping", parameter="scale", sizes=((2.0, 4.0),)),
    "joint_dry_friction": Fault(field="rubbing", parameter="fraction", sizes=((0.1, 0.25),)),
}
FAULTS = {**OF_SERVO, **OF_MECHANISM}
ANY = -1  # An owner that is drawn
Kind = tuple[str, int | None]
"""A fault and its owner; None for all servos, the whole mechanism, or nobody."""


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A bench of several servos, and what may be wrong with it."""

    name: str  # Its asset
    finger: Finger  # What each of its fingers is like
    # Least and greatest command of each servo [rad], shape (D, 2)
    levels: tuple[tuple[float, float], ...]
    kinds: tuple[Kind, ...]  # Every kind of set, each as often as it shall come

    @property
    def servos(self) -> int:
        """Servos D."""
        return len(self.levels)

    @property
    def fingers(self) -> int:
        """Fingers, which share nothing."""
        return self.servos // self.finger.string_count


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that decides a dataset."""

    bench: Bench
    fault: str  # Name in `FAULTS`, or `SILENT`
    servo: int | None  # Its owner; None for all servos, the mechanism, or nobody
    seed: int
    duration: float = 4.0  # Length of each recording [s]

    @property
    def cause(self) -> str | None:
        """What a diagnosis must name."""
        return None if self.fault == SILENT else name_of(self.fault, self.servo)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What was planted."""

    recipe: Recipe
    value: float | None  # Of the fault's number [the effect's unit]


def recipes(bench: Bench, cases: int, seed: int, faults: Sequence[str] = ()) -> list[Recipe]:
    """Draw so many recipes of some faults; every kind comes once before any comes again."""
    rng = np.random.default_rng(seed)
    kinds = [kind for kind in bench.kinds if not faults or kind[0] in faults]
    drawn = [kinds[i] for _ in range(-(-cases // len(kinds))) for i in rng.permutation(len(kinds))]
    return [
        Recipe(
            bench=bench,
            fault=fault,
            servo=int(rng.integers(bench.servos)) if servo == ANY else servo,
            seed=1000 * seed + number,
        )
        for number, (fault, servo) in enumerate(drawn[:cases])
    ]


def truth_of(recipe: Recipe) -> Truth:
    """Return what a recipe plants."""
    return draw(recipe, np.random.default_rng(recipe.seed))[0]


def make_datasets(folders: Sequence[Path], chosen: Sequence[Recipe]) -> None:
    """Write datasets of one bench with their starting models, simulated side by side."""
    bench = chosen[0].bench
    rngs = [np.random.default_rng(recipe.seed) for recipe in chosen]
    drawn = [draw(recipe, rng) for recipe, rng in zip(chosen, rngs, strict=True)]
    runs = [
        Run(command=commands(rng, bench.levels, recipe.duration), faults=faults)
        for recipe, rng, (_, faults) in zip(chosen, rngs, drawn, strict=True)
        for _ in range(TRAIN + TEST)
    ]
    motions = simulate(bench.finger, runs)
    for number, (folder, rng) in enumerate(zip(folders, rngs, strict=True)):
        own = slice(number * (TRAIN + TEST), (number + 1) * (TRAIN + TEST))
        recordings = [
            record(rng, bench, f"run_{i}.csv", run, motion)
            for i, (run, motion) in enumerate(zip(runs[own], motions[own], strict=True))
        ]
        write_dataset(folder, recordings[:TRAIN], recordings[TRAIN:])
        source = NamedValues(name="ideal", values={"gain": GAIN})
        write_model(folder / "model.toml", Model(actuator=source))


def draw(recipe: Recipe, rng: np.random.Generator) -> tuple[Truth, Faults]:
    """Draw the size of a fault."""
    fault = FAULTS.get(recipe.fault)
    if fault is None:
        return Truth(recipe=recipe, value=None), Faults()
    value = float(rng.uniform(*fault.sizes[int(rng.integers(len(fault.sizes)))]))
    each = (value,)
    if recipe.servo is not None:
        each = recipe.bench.servos * getattr(Faults(), fault.field)
        each = (*each[: recipe.servo], value, *each[recipe.servo + 1 :])
    return Truth(recipe=recipe, value=value), replace(Faults(), **{fault.field: each})


def commands(
    rng: np.random.Generator, levels: Sequence[tuple[float, float]], duration: float
) -> Array:
    """Draw levels of all servos, each on its own, with short ramps between them [rad]."""
    rows = round(duration * ROW_RATE)
    time = np.arange(rows) / ROW_RATE
    columns = []
    for low, high in levels:
        starts, held = [0.0], [rng.uniform(low, high)]
        while starts[-1] < duration:
            starts += [starts[-1] + rng.uniform(*HELD)]
            held += [rng.uniform(low, high)]
        knots = np.ravel([(start, start + BLEND) for start in starts[1:]])
        columns.append(np.interp(time, knots, np.repeat(held, 2)[1:-1]))
    return np.stack(columns, axis=1).round(6)


def record(
    rng: np.random.Generator, bench: Bench, name: str, run: Run, motion: Motion
) -> Recording:
    """Pass a motion through encoders and load cells."""
    speed = np.gradient(motion.angle, 1.0 / ROW_RATE, axis=0)
    signals: dict[str, Callable[[Array], Array]] = {
        "motor_position": lambda d: encoder(motion.angle[:, d]).round(6),
        "motor_velocity": lambda d: speed_register(rng, speed[:, d]).round(3),
        "force": lambda d: load_cell(rng, motion.force[:, d], Sensors()).round(4),
    }
    return Recording(
        name=name,
        bench=bench.name,
        time=np.arange(len(run.command)) / ROW_RATE,
        command=run.command,
        **{
            key: np.stack([signal(d) for d in range(bench.servos)], axis=1)
            for key, signal in signals.items()
        },
    )
