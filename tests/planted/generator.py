"""Datasets with a planted cause: ``python -m tests.planted.generator OUT --effect NAME --seed 3``.

The truth is returned, never written into the folder; the command writes it beside, as
``OUT.truth.json``.
"""

import argparse
import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.errors import unknown_name
from tests.planted.physics.bench import BENCHES, GAIN, SPOOL_RADIUS, as_built
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import DURATION
from tests.planted.physics.plant import Motion, Run, simulate
from tests.planted.physics.sensors import ENCODER_STEP, FORCE_NOISE, Sensors
from tests.planted.physics.servo import DcServo
from tests.planted.recordings import (
    MIXES,
    TEST_COUNT,
    TRAIN_COUNT,
    Slot,
    draw_run,
    draw_slots,
    record,
)
from tests.planted.sets.draws import (
    COULOMB_KNOWN,
    EFFECTS,
    FURTHER_SENSORS,
    OUTSIDE,
    VISCOUS_KNOWN,
    base_causes,
)
from tests.planted.truth import Truth, changes, errors, totals

DRAWS = {**EFFECTS, **FURTHER_SENSORS, **OUTSIDE}  # What can be planted, by name
SMALL = 0.1  # Size of an imperfection that has the form of an effect [1]


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that decides a dataset: the same recipe gives the same files."""

    effects: tuple[str, ...] = ()  # Names in `DRAWS`; none plants nothing
    seed: int = 0
    mix: str = "A"  # Benches, a key of ``MIXES``
    duration: tuple[float, float] = DURATION  # Shortest and longest recording [s]
    size: float = 1.0  # Size of the causes [1]: 1 is well above the noise, a tenth is hard to see
    force_noise: float = FORCE_NOISE  # Standard deviation of the load cell's noise [N]
    noise_colour: float = 0.0  # Correlation of the load cell's noise between rows [1]
    known_friction: bool = False  # Whether plant and model share a viscous and a dry friction
    cell_rate: float | None = None  # Readings of the load cell per second [Hz]; None is one per row
    gaps: bool = False  # Whether the log loses rows; their commands were given all the same
    imperfection: float = 0.0  # Size of unlisted faults of the plant [1]
    small: tuple[str, ...] = ()  # Names in ``EFFECTS`` of further ones, a tenth of their size
    # Share by which masses, lengths and a moment arm may differ from the model's [1]
    off_nominal: float = 0.0
    # Whether the plant's bristles, knees and contacts have its other laws
    second_form: bool = False
    without_force: bool = False  # Whether the bench has no load cell
    on_joint: bool = False  # Whether joints have encoders of their own
    servo: DcServo | None = None  # A motor whose current is logged; None is the ideal source
    supply: float | None = None  # Voltage of its supply without a load, where that is logged [V]


def make_dataset(out: Path, recipe: Recipe) -> Truth:
    """Write recordings, ``dataset.toml`` and ``model.toml`` of a plant with a hidden cause."""
    for name in recipe.effects:
        if name not in DRAWS:
            raise unknown_name("cause", name, DRAWS)
    rng = np.random.default_rng([recipe.seed, zlib.crc32("+".join(recipe.effects).encode())])
    base = base_causes(
        rng,
        known_friction=recipe.known_friction,
        imperfection=recipe.imperfection,
        second_form=recipe.second_form,
    )
    small = {name: DRAWS[name](rng, SMALL) for name in recipe.small}
    for cause in small.values():
        base = cause.built_on(base)
    planted = {name: DRAWS[name](rng, recipe.size) for name in recipe.effects}
    causes = base
    for cause in planted.values():
        causes = cause.built_on(causes)
    benches = as_built(rng, recipe.off_nominal) if recipe.off_nominal else BENCHES
    slots = draw_slots(rng, MIXES[recipe.mix])
    runs = [draw_run(rng, slot, causes, benches, recipe.duration, recipe.servo) for slot in slots]
    motions = simulate([*runs, *twins(recipe, base, slots[TRAIN_COUNT:], runs[TRAIN_COUNT:])])
    true, spared, modelled = held_out_motions(motions)
    sensors = Sensors(
        force_noise=recipe.force_noise,
        noise_colour=recipe.noise_colour,
        cell_rate=recipe.cell_rate,
        supply=recipe.supply,
        on_joint=recipe.on_joint or any(n.startswith("joint_encoder") for n in recipe.effects),
    )
    recordings = tuple(
        record(rng, slot, run, motion, sensors, gaps=recipe.gaps)
        for slot, run, motion in zip(slots, runs, motions[: len(runs)], strict=True)
    )
    written = [replace(r, force=None) for r in recordings] if recipe.without_force else recordings
    write_dataset(out, written[:TRAIN_COUNT], written[TRAIN_COUNT:])
    model = starting_model(known_friction=recipe.known_friction, mix=recipe.mix, servo=recipe.servo)
    write_model(out / "model.toml", model)
    force, theta = changes(true, spared)
    return Truth(
        effects=recipe.effects,
        parameters=totals({**small, **planted}, causes),
        strength=force / recipe.force_noise,
        strength_theta=float(theta / (ENCODER_STEP / np.sqrt(12.0))),
        nominal=errors(recordings[TRAIN_COUNT:], modelled),
        true=errors(recordings[TRAIN_COUNT:], true),
        bristle=causes.bristle,
    )


def twins(
    recipe: Recipe, base: Causes, slots: Sequence[Slot], held_out: Sequence[Run]
) -> list[Run]:
    """Build the held-out recordings without the planted causes; and, if that differs, as modelled.

    The model knows neither unlisted faults nor that a bench was not built to its drawing.
    """
    spared = [
        Run(bench=run.bench, causes=base, time=run.time, command=run.command, servo=run.servo)
        for run in held_out
    ]
    if not recipe.imperfection and not recipe.off_nominal and not recipe.small:
        return spared
    listed = Causes(
        viscous=base.viscous, coulomb=base.coulomb, bristle=base.bristle,
        second_form=base.second_form,
    )  # fmt: skip
    return spared + [
        Run(
            bench=BENCHES[slot.bench],
            causes=listed,
            time=run.time,
            command=run.command,
            servo=run.servo,
        )
        for slot, run in zip(slots, held_out, strict=True)
    ]


def held_out_motions(motions: Sequence[Motion]) -> tuple[Sequence[Motion], ...]:
    """Split off the held-out motions: as they were, without the causes, and as modelled."""
    true, rest = motions[TRAIN_COUNT:][:TEST_COUNT], motions[TRAIN_COUNT + TEST_COUNT :]
    return true, rest[:TEST_COUNT], rest[-TEST_COUNT:]


def starting_model(*, known_friction: bool, mix: str = "A", servo: DcServo | None = None) -> Model:
    """Build the model that a diagnosis starts from."""
    known = (
        NamedValues(name="viscous_friction", values={"coefficient": VISCOUS_KNOWN}),
        NamedValues(name="coulomb_friction", values={"force": COULOMB_KNOWN}),
    )
    source = NamedValues(name="ideal", values={"gain": GAIN, "spool_radius": SPOOL_RADIUS})
    if servo is not None:
        source = NamedValues(name="pwm_servo", values={
            "duty_per_rad": servo.duty_per_rad, "max_duty": servo.greatest_duty,
            "supply_voltage": servo.supply, "torque_constant": servo.torque_constant,
            "resistance": servo.resistance, "armature": servo.inertia,
            "spool_radius": SPOOL_RADIUS,
        })  # fmt: skip
    told = {
        name: BenchOverrides(damping=(BENCHES[name].damping[0],))
        for name in MIXES[mix]
        if BENCHES[name].direct
    }
    return Model(
        actuator=source, effects=known if known_friction else (), bench_overrides=told, fit=()
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Make one dataset from the command line."""
    parser = argparse.ArgumentParser(description="Make a dataset with planted causes.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--effect", dest="effects", nargs="+", choices=[*DRAWS], default=())
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    out: Path = chosen.out
    truth = make_dataset(out, Recipe(effects=tuple(chosen.effects), seed=chosen.seed))
    beside = out.with_name(f"{out.name}.truth.json")
    beside.write_text(json.dumps({"id": out.name, **truth.to_json()}, indent=1) + "\n")


if __name__ == "__main__":
    main()
