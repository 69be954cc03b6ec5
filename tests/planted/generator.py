"""Datasets with a planted cause: ``python -m tests.planted.generator OUT --effect NAME --seed 3``.

The truth is returned, never written into the folder; the command writes it beside, as
``OUT.truth.json``.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from tendon_newton.dataset import write_dataset
from tendon_newton.errors import unknown_name
from tendon_newton.model_file import Model, NamedValues, write_model
from tests.planted.bench import GAIN, SPOOL_RADIUS, Causes
from tests.planted.draws import (
    COULOMB_KNOWN,
    EFFECTS,
    OUTSIDE,
    VISCOUS_KNOWN,
    Planted,
    base_causes,
)
from tests.planted.plant import Motion, Run, simulate
from tests.planted.recordings import MIXES, TRAIN_COUNT, draw_run, draw_slots, record
from tests.planted.sensors import ENCODER_STEP, FORCE_NOISE, Sensors


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is hidden in a dataset; never part of its folder."""

    effect: str | None
    """The planted cause; None if nothing is."""
    outside: bool
    """Whether the cause is one that no effect of the catalogue describes."""
    parameters: Mapping[str, float]
    """Its parameters, as totals where the model already knows part of it."""
    strength: float
    """RMS change of the held-out force, in noise floors [1]."""
    strength_theta: float
    """RMS change of the held-out motor angle, in noise floors [1]."""
    bristle: float
    """Travel over which the plant's friction builds up to 63 % [m]."""


def make_dataset(
    out: Path,
    *,
    effect: str | None,
    seed: int,
    mix: str = "A",
    noise_colour: float = 0.0,
    known_friction: bool = False,
    cell_rate: float | None = None,
    gaps: bool = False,
    imperfection: float = 0.0,
) -> Truth:
    """Write recordings, ``dataset.toml`` and ``model.toml`` of a plant with a hidden cause.

    Args:
        out: Folder to make.
        effect: Name in ``EFFECTS`` or ``OUTSIDE``; None plants nothing.
        seed: The same seed gives the same files.
        mix: Benches, a key of ``MIXES``.
        noise_colour: Correlation of the load cell's noise between rows [1].
        known_friction: Whether plant and model share a viscous and a dry friction.
        cell_rate: Readings of the load cell per second [Hz]; None is one per row.
        gaps: Whether the log loses rows; their commands were given all the same.
        imperfection: Size of unlisted faults of the plant [1].
    """
    draws = {**EFFECTS, **OUTSIDE}
    if effect is not None and effect not in draws:
        raise unknown_name("cause", effect, draws)
    rng = np.random.default_rng([seed, 0 if effect is None else 1 + list(draws).index(effect)])
    base = base_causes(rng, known_friction=known_friction, imperfection=imperfection)
    planted = Planted() if effect is None else draws[effect](rng)
    causes = planted.built_on(base)
    slots = draw_slots(rng, MIXES[mix])
    runs = [draw_run(rng, slot, causes, planted) for slot in slots]
    spared = [nominal_twin(run, base) for run in runs[TRAIN_COUNT:]]
    motions = simulate([*runs, *spared])
    sensors = Sensors(noise_colour=noise_colour, cell_rate=cell_rate)
    recordings = tuple(
        record(rng, slot, run, motion, sensors, gaps=gaps)
        for slot, run, motion in zip(slots, runs, motions[: len(runs)], strict=True)
    )
    write_dataset(out, recordings[:TRAIN_COUNT], recordings[TRAIN_COUNT:])
    write_model(out / "model.toml", starting_model(known_friction=known_friction))
    force, theta = changes(motions[TRAIN_COUNT : len(runs)], motions[len(runs) :])
    return Truth(
        effect=effect,
        outside=effect in OUTSIDE,
        parameters=totals(effect, planted, causes),
        strength=force / FORCE_NOISE,
        strength_theta=theta / (ENCODER_STEP / np.sqrt(12.0)),
        bristle=causes.bristle,
    )


def nominal_twin(run: Run, base: Causes) -> Run:
    """Build the same recording without the planted cause."""
    return Run(bench=run.bench, causes=base, time=run.time, command=run.command)


def starting_model(*, known_friction: bool) -> Model:
    """Build the model that a diagnosis starts from."""
    known = (
        NamedValues(name="viscous_friction", values={"coefficient": VISCOUS_KNOWN}),
        NamedValues(name="coulomb_friction", values={"force": COULOMB_KNOWN}),
    )
    source = NamedValues(name="ideal", values={"gain": GAIN, "spool_radius": SPOOL_RADIUS})
    return Model(
        actuator=source, effects=known if known_friction else (), bench_overrides={}, fit=()
    )


def totals(effect: str | None, planted: Planted, causes: Causes) -> Mapping[str, float]:
    """Name the parameters; of a friction that the model knows in part, the new total."""
    values = dict(planted.parameters)
    if effect == "viscous_friction":
        values["coefficient"] = causes.viscous
    if effect == "coulomb_friction":
        values["force"] = causes.coulomb
    return MappingProxyType(values)


def changes(with_cause: Sequence[Motion], without: Sequence[Motion]) -> tuple[float, float]:
    """RMS change of force [N] and motor angle [rad] over all rows."""
    pairs = list(zip(with_cause, without, strict=True))
    force = np.concatenate([a.force - b.force for a, b in pairs])
    theta = np.concatenate([a.angle - b.angle for a, b in pairs])
    return float(np.sqrt(np.mean(force**2))), float(np.sqrt(np.mean(theta**2)))


def main(arguments: Sequence[str] | None = None) -> None:
    """Make one dataset from the command line."""
    parser = argparse.ArgumentParser(description="Make a dataset with a planted cause.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--effect", choices=[*EFFECTS, *OUTSIDE], default=None)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mix", choices=list(MIXES), default="A")
    parser.add_argument("--noise", type=float, default=0.0, help="colour of the force noise [1]")
    parser.add_argument("--known-friction", action="store_true")
    parser.add_argument("--cell-rate", type=float, default=None, help="[Hz]")
    parser.add_argument("--gaps", action="store_true")
    parser.add_argument("--imperfection", type=float, default=0.0)
    chosen = vars(parser.parse_args(arguments))
    out: Path = chosen.pop("out")
    truth = make_dataset(out, noise_colour=chosen.pop("noise"), **chosen)
    beside = out.with_name(f"{out.name}.truth.json")
    beside.write_text(
        json.dumps({**vars(truth), "parameters": dict(truth.parameters)}, indent=1) + "\n"
    )


if __name__ == "__main__":
    main()
