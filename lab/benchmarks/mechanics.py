"""The mechanics alone: every engine at its largest sound step, under the ideal source."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import warp as wp

from lab.benchmarks.engines_timed.engines import (
    JOINT_FRICTION,
    FeatherstoneEngine,
    MujocoEngine,
    SwingingEngine,
    TendonEngine,
)
from lab.benchmarks.engines_timed.native_mujoco import (
    NativeMujocoEngine,
    PlainMujocoEngine,
    WarpMujocoEngine,
)
from lab.benchmarks.engines_timed.soundness import (
    CONTROL_STEP,
    Engine,
    finger_limits,
    largest_sound,
    path,
    refuse_escaped,
)
from lab.benchmarks.timing import Row, best_time, memory_in_use, say

REFERENCE_STEP = 5.0e-5  # s
OURS = "TendonSolver"
ENGINES: dict[str, type[SwingingEngine]] = {
    OURS: TendonEngine,
    "SolverMuJoCo": MujocoEngine,
    "SolverMuJoCo, native tendon": NativeMujocoEngine,
    "mujoco_warp, native tendon": WarpMujocoEngine,
    "SolverFeatherstone, no dry friction": FeatherstoneEngine,
}
CPU_ENGINES: dict[str, type[SwingingEngine]] = {
    OURS: TendonEngine,
    "SolverMuJoCo": MujocoEngine,
    "MuJoCo in C, native tendon": PlainMujocoEngine,
}
FOREIGN_WORLDS = 65536
"""Most worlds that other solvers are measured with: building them takes minutes."""
LEAST_CHECKED = 64  # Worlds of a check, where fewer are timed


def mechanics(
    worlds_asked: Sequence[int], engines: dict[str, type[SwingingEngine]] = ENGINES
) -> Iterator[Row]:
    """Check and time all engines; ours also at the longest step that others are sound at."""
    substeps: dict[str, int] = {}
    for worlds in sorted(worlds_asked):
        checked = max(worlds, LEAST_CHECKED)
        references = {
            rubs: path(TendonEngine(checked, REFERENCE_STEP, "float64", friction=friction))
            for rubs, friction in ((True, JOINT_FRICTION), (False, 0.0))
        }
        for name, kind in engines.items():
            if name != OURS and worlds > FOREIGN_WORLDS:
                continue
            make = partial(kind, friction=JOINT_FRICTION * kind.has_dry_friction)
            row = timed_when_sound(
                name, worlds, make, references[kind.has_dry_friction], substeps.get(name, 0)
            )
            substeps[name] = row["substeps"]
            yield row
        if worlds <= FOREIGN_WORLDS:
            same = min(n for name, n in substeps.items() if name != OURS)
            yield timed_when_sound(
                f"{OURS}, same step", worlds, TendonEngine, references[True], same
            )


def timed_when_sound(
    name: str, worlds: int, make: Callable[..., Engine], reference: np.ndarray, fewest: int = 0
) -> Row:
    """Return what one control step costs at the largest step at which an engine is sound.

    Args:
        name: What the engine is called.
        worlds: Number of worlds to be timed.
        make: Builds the engine with (worlds, step [s]).
        reference: Path of the reference [rad], shape (T, W, J), of at least as many worlds.
        fewest: Substeps of a control step to begin with.

    Raises:
        UnsoundEngine: It is sound at no step, or was no more when it had been timed.
    """
    before = memory_in_use()
    engine, substeps, verdict = largest_sound(
        name, partial(make, reference.shape[1]), reference, fewest=fewest
    )
    if worlds < reference.shape[1]:
        engine = make(worlds, CONTROL_STEP / substeps)
        engine.begin()
    seconds = best_time(engine.run, wp.get_device())
    refuse_escaped(name, engine.joints(), finger_limits())
    row: dict[str, Any] = {
        "engine": name,
        "worlds": worlds,
        "substeps": substeps,
        "step_milliseconds": 1.0e3 * CONTROL_STEP / substeps,
        "error_rad": verdict.error,
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": worlds / seconds,
        "bytes_per_world": (memory_in_use() - before) / worlds,
    }
    say(row)
    return row
