"""Export to USD: the corrected bench as one file, for any program that reads USD physics."""

from dataclasses import replace
from pathlib import Path

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.exports.bench_file import write_bench
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.model_numbers import coverage_of, refuse_damaged
from tendon_newton.mechanisms.authoring.correction import HOMES, correct
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.hosts.rollout import Trajectory

BENCH_FILE = "bench.usda"
WAY = f"our solver on {BENCH_FILE}"

# A mechanism has a servo's greatest force, and not the knee below it
COVERAGE = coverage_of(tuple(HOMES), ("force_saturation",))


def write_usd_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `bench.usda`, which refers to no other file.

    Raises:
        InvalidModelFile: A number is out of range, or has no place in USD.
        InvalidOutput: The file cannot be written.
    """
    refuse_damaged(model)
    correction = correct(mechanism, replace(model, bench_overrides={}))
    path = folder / BENCH_FILE
    write_bench(path, replace(correction, asset=load_mechanism(mechanism.asset)), model)
    return Exported(
        files=(path,),
        loading=LOADING,
        replays={WAY: lambda run: replay_usd(path, model, run)},
        left_out={"other programs": correction.left},
    )


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

USD = ExportTarget(coverage=COVERAGE, write=write_usd_target)
