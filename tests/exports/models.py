"""Models that the tests of exports carry into other programs."""

from pathlib import Path

import numpy as np

from examples.studies.exports import model_of
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import Departure, command_range, departure, replayed
from tendon_newton.simulation.hosts.replay import bench_of, replay
from tendon_newton.simulation.model.parameter_table import spool_radius_of
from tests.physics.runs import run_of

ANGLE = 1.5e-3  # rad: one count of a servo's encoder
FORCE = 0.05  # N: below a load cell's noise


def short_run(bench: str, model: Model, rows: int = 60) -> Recording:
    """Return a step up, a step down and a ramp, inside the range of a bench."""
    mechanism = bench_of(bench, model)
    low, high = command_range(mechanism, spool_radius_of(model))
    index = np.arange(rows)
    share = np.where(index < 36, (index // 12) % 2, (index - 36) / 24)
    command = low + (high - low) * share
    return run_of(np.repeat(command[:, None], len(mechanism.tendons), axis=1), bench=bench)


def strays(
    folder: Path, target: str, way: str, bench: str, actuator: str, *effects: str
) -> Departure:
    """Return how far an exported model strays from our own simulation on a short run."""
    return strays_of(folder, target, way, bench, model_of(bench, actuator, *effects))


def strays_of(folder: Path, target: str, way: str, bench: str, model: Model) -> Departure:
    """Return the same of a model of one's own."""
    mechanism = bench_of(bench, model)
    run = short_run(bench, model)
    exported = EXPORTS[target].write(folder, mechanism, model)
    theirs = replayed(EXPORTS[target], exported, way, model, [run])
    return departure(mechanism, theirs, replay([run], model))
