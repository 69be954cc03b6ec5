"""What a control step of many fingers costs, part by part, against Newton's own solvers.

Run from the root of the repository, on a machine with a GPU::

    python -m tests.benchmarks.gpu                      # everything
    python -m tests.benchmarks.gpu --parts network ppo  # some of it
    python -m tests.benchmarks.gpu --figure             # only draw what was measured

It writes ``tests/benchmarks/results/gpu.json``, where each part that is measured takes the place of
the former one, and ``docs/images/cost_by_worlds.png``. A control step is 50 ms in 25 substeps; each
engine does it in one CUDA graph; times are the best of seven spans by the clock, everything warm.

Parts: ``mechanics`` alone; the ``network`` alone (the authors' Transformer, 6,801 numbers); both in
a ``loop``; ``gradient`` of 2 s and 10 s, in steps of 1 ms; ``ppo``: samples per second, acting and
learning.
"""

import argparse
import gc
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch
import warp as wp

from tendon_newton.mechanisms.mechanism import load_mechanism
from tendon_newton.recording import Recording
from tendon_newton.simulation.control_loop import ControlLoop
from tendon_newton.simulation.differentiable import DifferentiableRollout
from tendon_newton.simulation.torch_bridge import torch_stream
from tests.benchmarks.engines import (
    CONTROL_STEP,
    FeatherstoneEngine,
    MujocoEngine,
    MujocoNetworkEngine,
    NewtonEngine,
    Swing,
    TendonEngine,
)
from tests.benchmarks.network import best_time, queries, random_windows
from tests.benchmarks.speed import commit
from tests.physics.networks import force_network, learned_model, write_force_network
from tests.physics.runs import ROWS, ideal_model, run_of, stairs
from train.policy.environment import FingerEnvironment
from train.policy.environment_config import EnvironmentConfig
from train.policy.training import train_policy
from train.policy.training_config import PolicyTrainingConfig

RESULT = Path(__file__).parent / "results" / "gpu.json"
FIGURE = Path(__file__).parents[2] / "docs" / "images" / "cost_by_worlds.png"
STEP = 2.0e-3  # s
WORLDS = (1, 64, 1024, 4096, 16384, 65536, 262144)
FOREIGN_WORLDS = 65536
"""Most worlds that Newton's solvers are measured with: building them takes minutes."""
JOINT_FRICTION = 5.0e-3
"""Dry friction of each joint [N m], a tenth of what its spring holds at the end of its range."""
GRADIENT_WORLDS = (1, 64, 1024, 4096, 8192, 16384)
GRADIENT_STEP = 1.0e-3  # s
LONG_WORLDS = 4096
"""Worlds of the run of 10 s."""
SEGMENTS = (1, 10, 100)
"""Into how many parts it is divided."""
SAMPLE_PRODUCTS = 3 * 16 + 3 * 48 + 4 * 30 * 8 + 16 * 16 + 2 * 16 * 64
"""Multiplications of a sample's way through the first layer: as a token; as query, key and value;
four heads that look at 30 samples; their mixture; the layers of 64."""
LAST_PRODUCTS = 3 * 16 * 16 + 2 * 4 * 30 * 16 + 16 * 16 + 2 * 16 * 64 + 16 * 8 + 8 * 4 + 4
"""Those of the last sample's way through the second layer and the perceptron."""
NETWORK_OPERATIONS = 2 * (30 * SAMPLE_PRODUCTS + LAST_PRODUCTS)
"""Multiplications and additions of one query of the Transformer; exponentials not counted."""
PPO_WORLDS = (8192, 32768)
ITERATIONS = 12
ITERATION_STEPS = 32

Row = dict[str, Any]


def arithmetic_peak() -> float:
    """Return the device's most single-precision operations per second, from its clock."""
    properties = torch.cuda.get_device_properties(0)
    clock = 1.0e3 * getattr(properties, "clock_rate", 1.98e6)  # Hz
    return properties.multi_processor_count * 128 * 2 * clock


def memory_in_use() -> int:
    """Return the bytes of the device that are taken."""
    gc.collect()
    torch.cuda.empty_cache()
    wp.synchronize()
    free, total = torch.cuda.mem_get_info()
    return total - free


def timed(engine: str, worlds: int, make: Callable[[], Callable[[], Any]]) -> Row:
    """Return what one control step of an engine costs.

    Args:
        engine: Its name.
        worlds: Number of worlds.
        make: Builds it, and returns what does one step.
    """
    before = memory_in_use()
    step = make()
    seconds = best_time(lambda: step() and None, wp.get_device())
    row = {
        "engine": engine,
        "worlds": worlds,
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": worlds / seconds,
        "bytes_per_world": (memory_in_use() - before) / worlds,
    }
    say(row)
    return row


def say(row: Row) -> None:
    """Print a row as soon as it is there."""
    values = (f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items())
    sys.stdout.write(", ".join(values) + "\n")
    sys.stdout.flush()


def mechanics(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time the mechanics under the ideal source, with dry friction and end stops in the joints."""

    def ours(worlds: int) -> Callable[[], Any]:
        return in_motion(TendonEngine(worlds, STEP, friction=JOINT_FRICTION, swings=True))

    def theirs(kind: type[NewtonEngine], worlds: int) -> Callable[[], Any]:
        return in_motion(kind(worlds, STEP, friction=JOINT_FRICTION, swings=True))

    for worlds in worlds_asked:
        yield timed("TendonSolver", worlds, lambda w=worlds: ours(w))
        if worlds <= FOREIGN_WORLDS:
            for kind in (MujocoEngine, FeatherstoneEngine):
                name = f"Solver{kind.__name__.removesuffix('Engine')}"
                yield timed(name, worlds, lambda w=worlds, k=kind: theirs(k, w))


def in_motion(engine: TendonEngine | NewtonEngine) -> Callable[[], Any]:
    """Return a step of an engine whose fingers swing."""
    engine.command.fill_(1.0)
    engine.settle()
    return lambda: wp.capture_launch(engine.graph)


def network(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time queries of the authors' Transformer in its forms."""
    device = wp.get_device()
    for worlds in worlds_asked:
        force = wp.zeros(worlds, dtype=wp.float32)
        history = random_windows(worlds, device)
        for name, query in queries(device, of_set="authors").items():
            row = timed(name, worlds, lambda q=query, h=history, f=force: lambda: q(h, f))
            rate = NETWORK_OPERATIONS * row["world_steps_per_second"]
            yield {**row, "share_of_arithmetic_limit": rate / arithmetic_peak()}


def loop(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time whole control steps: sensors, network, mechanics, readings."""
    device = wp.get_device()
    mechanism = load_mechanism("finger")
    model = learned_model()

    def ours(worlds: int, query: Any) -> Callable[[], Any]:
        command = torch.full((worlds, 1), 2.0, device="cuda")
        made = ControlLoop(
            mechanism, model, worlds, max_step=STEP, precision="float32", query=query, device=device
        )
        made.reset(command)
        made.bench_numbers("friction").fill_(JOINT_FRICTION)
        swing = Swing(wp.from_torch(command))

        def step() -> None:
            with torch_stream(device):
                swing()
            made.step(command)

        return step

    for worlds in worlds_asked:
        forms = queries(device, of_set="authors")
        yield timed("TendonSolver + twin", worlds, lambda w=worlds, q=forms["twin"]: ours(w, q))
        if worlds <= FOREIGN_WORLDS:
            module = forms["torchscript_whole"]
            yield timed(
                "SolverMuJoCo + TorchScript",
                worlds,
                lambda w=worlds, q=module: (
                    MujocoNetworkEngine(w, STEP, query=q, friction=JOINT_FRICTION, swings=True).run
                ),
            )


def gradient(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time 2 s forwards and backwards by all numbers and commands; 10 s in one piece and more."""
    most = max(worlds_asked)
    runs = swinging_runs(max(GRADIENT_WORLDS), 2.0)
    ways = {"many substeps at once": True, "one substep after the other": False}
    for worlds in (w for w in GRADIENT_WORLDS if w <= most):
        for way, at_once in ways.items():
            yield gradient_row(way, runs[:worlds], at_once=at_once)
    if most >= LONG_WORLDS:
        runs = swinging_runs(LONG_WORLDS, 10.0)
        for segments in SEGMENTS:
            yield gradient_row(f"10 s in {segments} segments", runs, segments=segments)


def swinging_runs(count: int, duration: float) -> list[Recording]:
    """Return recordings of so many seconds, each with other commands."""
    rng = np.random.default_rng(3)
    rows = int(ROWS * duration) + 1
    return [run_of(stairs(rng, rows, 1.0, 3.0, int(10 * duration))) for _ in range(count)]


def gradient_row(name: str, runs: Sequence[Recording], **options: Any) -> Row:
    """Time a differentiable rollout of a finger whose tendon rubs."""
    model = ideal_model(coulomb_friction={"force": 0.5}, viscous_friction={"coefficient": 0.3})
    before = memory_in_use()
    mechanism = load_mechanism("finger")
    rollout = DifferentiableRollout(mechanism, runs, model, time_step=GRADIENT_STEP, **options)
    seed = np.ones((*rollout.forward().motor_position.shape, 1))
    for _ in range(2):
        rollout.forward()
        rollout.backward(motor_position=seed)
    seconds = {
        name: best_time(
            lambda graph=rollout.graphs[name]: wp.capture_launch(graph), wp.get_device()
        )
        for name in ("forward", "backward")
    }
    row = {
        "engine": name,
        "worlds": len(runs),
        **{f"{name}_milliseconds": 1.0e3 * value for name, value in seconds.items()},
        "backward_over_forward": seconds["backward"] / seconds["forward"],
        "bytes_per_world": (memory_in_use() - before) / len(runs),
    }
    say(row)
    return row


def ppo(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time the environment alone, and whole iterations of a training."""
    with tempfile.TemporaryDirectory() as folder:
        network_file = write_force_network(
            Path(folder) / "force.pt", force_network(of_set="authors")
        )
        for worlds in (w for w in PPO_WORLDS if w <= max(worlds_asked)):
            for force in ("ideal", str(network_file)):
                name = "ideal" if force == "ideal" else "Transformer"
                config = EnvironmentConfig(worlds=worlds, force=force)
                environment = FingerEnvironment(config, device="cuda:0")
                action = torch.zeros(worlds, environment.num_actions, device="cuda")
                action.fill_(0.5)
                row = timed(
                    f"environment, {name}",
                    worlds,
                    lambda e=environment, a=action: lambda: e.step(a),
                )
                yield row
                del environment
                yield training_row(config, name, Path(folder) / f"{name}{worlds}")


def training_row(config: EnvironmentConfig, force: str, out: Path) -> Row:
    """Return the samples per second of a training, its first iterations left out."""
    seconds = iteration_time(config, out)
    row = {
        "engine": f"PPO, {force}",
        "worlds": config.worlds,
        "milliseconds": 1.0e3 * seconds,
        "samples_per_second": config.worlds * ITERATION_STEPS / seconds,
    }
    say(row)
    return row


def iteration_time(config: EnvironmentConfig, out: Path) -> float:
    """Return the seconds of an iteration of a training, the median without the first ones."""
    ends: list[float] = []
    training = PolicyTrainingConfig(
        environment=config, iterations=ITERATIONS, steps=ITERATION_STEPS, batch=4 * config.worlds,
        epochs=4, learning_rate=1.0e-3, checkpoint_every=ITERATIONS, device="cuda",
    )  # fmt: skip
    train_policy(training, out, report=lambda progress: ends.append(time.perf_counter()))
    return float(np.median(np.diff(ends[2:]))) if len(ends) > 2 else float("nan")


PARTS: dict[str, Callable[[Sequence[int]], Iterator[Row]]] = {
    "mechanics": mechanics,
    "network": network,
    "loop": loop,
    "gradient": gradient,
    "ppo": ppo,
}


def draw(result: dict[str, Any]) -> None:
    """Draw the time of a control step against the number of worlds."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(12, 4.5), sharey=True, layout="constrained")
    for axis, part in zip(axes, ("mechanics", "network", "loop"), strict=True):
        rows = result.get(part, {}).get("rows", [])
        for engine in dict.fromkeys(row["engine"] for row in rows):
            points = [(r["worlds"], r["milliseconds"]) for r in rows if r["engine"] == engine]
            axis.loglog(*zip(*points, strict=True), marker="o", label=engine)
        axis.set(title=part, xlabel="worlds")
        axis.grid(alpha=0.3)
        if rows:
            axis.legend(fontsize=8, loc="upper left")
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(low, 20.0 * high)  # room for the legends
    axes[0].set_ylabel(f"one control step of {1e3 * CONTROL_STEP:.0f} ms [ms]")
    figure.savefig(FIGURE, dpi=120)


def circumstances(command: str) -> dict[str, str]:
    """Return what belongs beside figures."""
    return {
        "command": command,
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": torch.cuda.get_device_name(0),
        "torch": torch.__version__,
    }


def main() -> None:
    """Measure what was asked for, write as it comes, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--parts", nargs="*", choices=PARTS, default=list(PARTS))
    parser.add_argument("--worlds", nargs="*", type=int, default=WORLDS, help="how many")
    parser.add_argument("--figure", action="store_true", help="only draw what was measured")
    arguments = parser.parse_args()
    result = json.loads(RESULT.read_text()) if RESULT.exists() else {}
    if not arguments.figure:
        wp.config.quiet = True
        for part in arguments.parts:
            rows: list[Row] = []
            head = circumstances(f"python -m tests.benchmarks.gpu --parts {part}")
            for row in PARTS[part](arguments.worlds):
                rows.append(row)
                result[part] = {**head, "rows": rows}
                RESULT.write_text(json.dumps(result, indent=1) + "\n")
    draw(result)


if __name__ == "__main__":
    main()
