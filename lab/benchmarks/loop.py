"""Whole control steps: sensors, network, mechanics, readings; every engine at a sound step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from lab.benchmarks.engines_timed.network_engines import (
    LoopEngine,
    MujocoNetworkEngine,
    WarpMujocoNetworkEngine,
)
from lab.benchmarks.engines_timed.soundness import path
from lab.benchmarks.mechanics import FOREIGN_WORLDS, LEAST_CHECKED, REFERENCE_STEP, timed_when_sound
from lab.benchmarks.network import authors_network, fused, last_query
from lab.benchmarks.timing import Row
from tendon_newton.actuators.networks.torchscript import ForceQuery

OURS = "TendonSolver + fused kernel"
ENGINES: dict[str, tuple[Any, Callable[[Any], ForceQuery]]] = {
    OURS: (LoopEngine, fused),
    "SolverMuJoCo + TorchScript": (MujocoNetworkEngine, last_query),
    "mujoco_warp + TorchScript": (WarpMujocoNetworkEngine, last_query),
    "mujoco_warp + TorchScript, TF32": (
        WarpMujocoNetworkEngine,
        partial(last_query, arithmetic="TF32"),
    ),
}
"""Engines, and the form of their network; TorchScript computes the last query alone."""


def loop(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Check and time all engines; ours also at the longest step that others are sound at."""
    substeps: dict[str, int] = {}
    network = authors_network()
    for worlds in sorted(worlds_asked):
        checked = max(worlds, LEAST_CHECKED)
        reference = path(
            LoopEngine(checked, REFERENCE_STEP, query=fused(network), precision="float64")
        )
        for name, (kind, form) in ENGINES.items():
            if name == OURS or worlds <= FOREIGN_WORLDS:
                make = partial(kind, query=form(network))
                row = timed_when_sound(name, worlds, make, reference, substeps.get(name, 0))
                substeps[name] = row["substeps"]
                yield row
        if worlds <= FOREIGN_WORLDS:
            same = min(n for name, n in substeps.items() if name != OURS)
            make = partial(LoopEngine, query=fused(network))
            yield timed_when_sound(f"{OURS}, same step", worlds, make, reference, same)
