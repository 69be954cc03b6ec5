"""Export to USD: the corrected bench as one file, for any program that reads USD physics."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from tendon_newton import __version__
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.result import SCHEMA
from tendon_newton.effects import EFFECTS, find_effect
from tendon_newton.errors import InvalidOutput
from tendon_newton.exports.base import Coverage, Exported, ExportTarget
from tendon_newton.mechanisms.authoring.correction import HOMES, correct
from tendon_newton.mechanisms.authoring.identified_layer import (
    FoundNumber,
    Provenance,
    write_identified_layer,
)
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.usd.stage_file import open_stage, usd_errors
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.hosts.rollout import Trajectory

BENCH_FILE = "bench.usda"
WAY = f"our solver on {BENCH_FILE}"

COVERAGE: dict[str, Coverage] = {name: "exact" if name in HOMES else "none" for name in EFFECTS}


def write_usd_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `bench.usda`, which refers to no other file.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    from pxr import Usd

    correction = correct(load_mechanism(mechanism.asset), model)
    path = folder / BENCH_FILE
    with tempfile.TemporaryDirectory() as draft:
        layer = Path(draft) / "layer.usda"
        write_identified_layer(layer, correction, provenance_of(model))
        with usd_errors(layer):
            flat = Usd.Stage.Open(str(layer)).Flatten(False).ExportToString()
    try:
        path.write_text(flat, encoding="utf-8")
    except OSError as error:
        raise InvalidOutput(f"{path}: {error.strerror or error}") from error
    open_stage(path)
    return Exported(
        files=(path,),
        loading=LOADING,
        replays={WAY: lambda run: replay_usd(path, model, run)},
        left_out={"other programs": correction.left},
    )


def provenance_of(model: Model) -> Provenance:
    """Return where the numbers of a model come from, as far as the model itself knows."""
    numbers = {
        effect.name: {
            parameter.name: FoundNumber(
                value=float(effect.values[parameter.name]), ci95=None, unit=parameter.unit
            )
            for parameter in find_effect(effect.name).parameters
        }
        for effect in model.effects
    }
    return Provenance(version=__version__, schema=SCHEMA, verdict="", dataset="", numbers=numbers)


def replay_usd(path: Path, model: Model, recording: Recording) -> Trajectory:
    """Replay a recording on the written bench, with what is left of the model."""
    effects = tuple(effect for effect in model.effects if effect.name not in HOMES)
    values = dict(model.actuator.values)
    if any(effect.name == "spool_radius_error" for effect in model.effects):
        del values["spool_radius"]  # the file has the true one
    rest = replace(
        model, actuator=replace(model.actuator, values=values), effects=effects, bench_overrides={}
    )
    rollout = rollout_of(load_mechanism(path), [recording], rest)
    return rollout.run(rollout.base_vectors(rest)[None])[0][0]


LOADING = """Open `bench.usda` in Isaac Sim, Newton (`ModelBuilder.add_usd`) or usdview.

Joints, links, springs, stops and tendons (`MjcTendon`) have the corrected numbers. The servo is not
in the file: its effects stand below, and in the file's `customLayerData`. Use the file in place of
the asset, and take out of the model those effects that stand in it already.
"""

USD = ExportTarget(
    summary="the corrected bench as one USD file",
    coverage=COVERAGE,
    write=write_usd_target,
)
