"""What a force network costs in the loop: its module, its last query alone, its compiled twin.

Run from the root of the repository::

    python -m tests.benchmarks.network

It writes ``tests/benchmarks/results/network_cpu.json`` (or ``_cuda``): milliseconds per query of W
worlds, the best of several spans, by the time that the process itself computed (on CUDA by the
clock), and control steps per second of a finger at 20 Hz in steps of 1 ms.
"""

import json
import platform
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch
import warp as wp

from tendon_newton.actuators.networks.artifact import torchscript
from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.torchscript import ForceQuery, TorchScriptQuery
from tendon_newton.actuators.networks.twin_query import TwinQuery, forces_of
from tendon_newton.mechanisms.mechanism import load_mechanism
from tendon_newton.simulation.control_loop import ControlLoop
from tests.benchmarks.engines import MujocoNetworkEngine
from tests.benchmarks.speed import commit
from tests.physics.networks import LIMIT, RATE, WINDOW, force_network, learned_model
from tests.physics.runs import ideal_model

RESULTS = Path(__file__).parent / "results"
WORLDS = (1, 64, 1024)
SPANS = 7
SPAN = 0.2  # s
STEP = 1.0e-3  # s


class WholeNetwork(torch.nn.Module):
    """The network without its shorter form: every sample goes through both layers."""

    def __init__(self, network: torch.nn.Module) -> None:
        super().__init__()
        self.network = network

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """Return the forces [N]."""
        return self.network(window)


def queries(device: Any, *, of_set: str = "paper") -> dict[str, ForceQuery]:
    """Return the same Transformer in its forms."""
    network = force_network(of_set=of_set).to(wp.device_to_torch(device))
    options = {"window": WINDOW, "rate": RATE, "limit": LIMIT}
    with torchscript():
        whole = torch.jit.script(WholeNetwork(network))
        last = torch.jit.script(network)
    return {
        "torchscript_whole": TorchScriptQuery(whole, **options),
        "torchscript": TorchScriptQuery(last, **options),
        "twin": TwinQuery(network, rate=RATE, limit=LIMIT, device=device),
    }


def best_time(work: Callable[[], None], device: Any) -> float:
    """Return the seconds of one run, the best of some spans of time, warm."""
    clock = time.perf_counter if device.is_cuda else time.process_time
    for _ in range(5):
        work()
    wp.synchronize_device(device)
    start = clock()
    work()
    wp.synchronize_device(device)
    count = max(1, int(SPAN / max(clock() - start, 1.0e-6)))
    best = np.inf
    for _ in range(SPANS):
        start = clock()
        for _ in range(count):
            work()
        wp.synchronize_device(device)
        best = min(best, (clock() - start) / count)
    return float(best)


def random_windows(worlds: int, device: Any) -> History:
    """Return samples about the usual ones."""
    rng = np.random.default_rng(0)
    history = History(worlds, WINDOW, device)
    samples = np.array([2.4, 0.7, 0.0])[:, None] + rng.normal(size=(WINDOW, 3, worlds))
    history.ring.assign(samples.astype(np.float32))
    return history


def query_times(worlds: int, device: Any) -> dict[str, float]:
    """Return the milliseconds of a query, and how far the forms differ [N]."""
    history = random_windows(worlds, device)
    force = wp.zeros(worlds, dtype=wp.float32, device=device)
    forms = queries(device)
    out = {
        f"{n}_ms": 1e3 * best_time(lambda q=q: q(history, force), device) for n, q in forms.items()
    }
    said = {name: forces_of(query, history) for name, query in forms.items()}
    out["largest_difference_n"] = max(
        float(np.abs(said[name] - said["torchscript_whole"]).max()) for name in said
    )
    return out


def loop_rates(worlds: int, device: Any) -> dict[str, float]:
    """Return control steps per second of all worlds together; SolverMuJoCo's as many substeps."""
    mechanism = load_mechanism("finger")
    command = torch.full((worlds, 1), 2.0, device=wp.device_to_torch(device))
    loops = {"ideal": ControlLoop(mechanism, ideal_model(), worlds, max_step=STEP, device=device)}
    for name, query in queries(device).items():
        loops[name] = ControlLoop(
            mechanism, learned_model(), worlds, max_step=STEP, query=query, device=device
        )
    module = queries(device)["torchscript_whole"]
    out = {
        "mujoco_torchscript_whole": worlds
        / best_time(MujocoNetworkEngine(worlds, STEP, query=module, swings=True).run, device)
    }
    for name, loop in loops.items():
        loop.reset(command, joint_position=torch.zeros_like(loop.reading.joint_position))
        out[name] = worlds / best_time(lambda loop=loop: loop.step(command) and None, device)
    return out


def main() -> None:
    """Measure and write one file per device."""
    wp.config.quiet = True
    torch.set_num_threads(1)
    device = wp.get_device()
    result = {
        "command": "python -m tests.benchmarks.network",
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": device.name if device.is_cuda else f"{platform.machine()} ({device.name})",
        "torch": torch.__version__,
        "torch_threads": 1,
        "query": {str(worlds): query_times(worlds, device) for worlds in WORLDS},
        "control_steps_per_second": {str(worlds): loop_rates(worlds, device) for worlds in WORLDS},
    }
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"network_{'cuda' if device.is_cuda else 'cpu'}.json"
    path.write_text(json.dumps(result, indent=2) + "\n")
    sys.stdout.write(path.read_text())


if __name__ == "__main__":
    main()
