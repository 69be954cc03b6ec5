"""``identified.usda``: what a diagnosis found about a mechanism, for any program that reads USD."""

from dataclasses import replace
from pathlib import Path

from tendon_newton import __version__
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.result import SCHEMA, Diagnosis
from tendon_newton.effects import find_effect
from tendon_newton.mechanisms.authoring.correction import correct
from tendon_newton.mechanisms.authoring.identified_layer import (
    FoundNumber,
    Provenance,
    write_identified_layer,
)
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism

NAME = "identified"


def write_identified(out: Path, diagnosis: Diagnosis, dataset: Dataset) -> tuple[Path, ...]:
    """Write a layer of overrides for every bench of a dataset, and return the files.

    One bench gives ``identified.usda``, several ``identified_<bench>.usda``. A number that a
    diagnosis leaves alone is not overridden: a layer without overrides says that the asset fits.
    """
    benches = dict.fromkeys(r.bench for r in (*dataset.train, *dataset.test))
    provenance = Provenance(
        version=__version__,
        schema=SCHEMA,
        verdict=diagnosis.verdict,
        dataset=dataset.sha256,
        numbers=found_numbers(diagnosis),
    )
    files = []
    for bench in benches:
        name = NAME if len(benches) == 1 else f"{NAME}_{bench}"
        files.append(out / f"{name}.usda")
        mechanism = load_mechanism(bench)
        own = replace(provenance, lengths=link_lengths(mechanism, diagnosis.model))
        write_identified_layer(files[-1], correct(mechanism, diagnosis.model), own)
    return tuple(files)


def link_lengths(mechanism: Mechanism, model: Model) -> dict[str, FoundNumber]:
    """Return the lengths of links that a model states, by joint."""
    stated = model.bench_overrides.get(mechanism.name, BenchOverrides()).length or ()
    return {
        joint.name: FoundNumber(value=value, ci95=None, unit="m")
        for joint, value in zip(mechanism.joints, stated, strict=False)
    }


def found_numbers(diagnosis: Diagnosis) -> dict[str, dict[str, FoundNumber]]:
    """Return the numbers of all effects of the extended model, with intervals where it has them."""
    estimates = {effect.name: effect.parameters for effect in diagnosis.effects}
    table: dict[str, dict[str, FoundNumber]] = {}
    for effect in diagnosis.model.effects:
        own = estimates.get(effect.cause, {})
        units = {p.name: p.unit for p in find_effect(effect.name).parameters}
        table[effect.cause] = {
            name: FoundNumber(
                value=float(value), ci95=own[name].ci95 if name in own else None, unit=units[name]
            )
            for name, value in effect.values.items()
        }
    return table
