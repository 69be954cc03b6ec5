"""Measure a deployment beside a virtual bench: steadiness, memory, start, cost of a policy.

Usage: ``.venv/bin/python -m lab.studies.deployment [steady|start|cost] [--duration 600]``.
``steady`` runs in real time under 1 % of lost answers while a second process loads another core;
on a machine that others use as well, put ``nice -n -10`` before it, as the service does: the bench
is a process too, which a real one is not.
Faults and the rules against them are another exam: ``python -m tests.faults``.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tendon_hardware.benches.bench import open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.control.goals import FixedGoal
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.control.operator import OperatorProgress
from tendon_hardware.control.pilot import PolicyPilot
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy import Deployment, deploy
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.servos.base import ServoState
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench import Faults, VirtualPorts
from tests.hardware.silent_operator import SilentOperator

LOSS = Faults(dropped_replies=0.01)
BURN = "while True: pass"
GOAL_PERIOD = 3.0  # Time on each of two goals [s]


def main() -> None:
    """Print what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=["cost", "start", "steady"])
    parser.add_argument("--duration", type=float, default=600.0)
    arguments = parser.parse_args()
    parts: dict[str, Callable[[Path], None]] = {
        "cost": cost,
        "start": start,
        "steady": lambda policy: steady(policy, arguments.duration),
    }
    with tempfile.TemporaryDirectory() as folder:
        policy = Path(folder) / "policy.onnx"
        write_policy(policy)
        print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the start")
        for part in arguments.parts:
            parts[part](policy)


def write_policy(path: Path) -> None:
    """Write the paper's network in a process of its own, so that torch is not in this one."""
    code = (
        "import sys; from pathlib import Path; from tests.hardware.deploy.policies import *; "
        "write_onnx(Path(sys.argv[1]), network(seed=3), card_of().to_json())"
    )
    subprocess.run([sys.executable, "-c", code, str(path)], check=True, capture_output=True)


class MemoryWatch(SilentOperator):
    """An operator who notes the memory of this process, and moves the goal."""

    def __init__(self, goals: FixedGoal) -> None:
        super().__init__()
        self.goals = goals
        self.memory: list[tuple[float, float]] = []
        """Time [s] and resident memory [MB], every five seconds."""

    def show(self, progress: OperatorProgress) -> None:
        """Look at the memory now and then."""
        self.goals.key("7" if progress.elapsed % (2.0 * GOAL_PERIOD) < GOAL_PERIOD else "2")
        if not self.memory or progress.elapsed >= self.memory[-1][0] + 5.0:
            self.memory.append((progress.elapsed, resident()))


def resident() -> float:
    """Return the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def steady(path: Path, duration: float) -> None:
    """Run for a long time under packet loss, beside a process that takes a core."""
    address = BenchAddress(bench="finger", port="virtual", load_cell_rate=80)
    goals = FixedGoal(0.0, (0.0, 1.57))
    operator = MemoryWatch(goals)
    policy = load_policy(path)
    normal = ["nice", "-n", str(-os.nice(0))]
    burner = subprocess.Popen([*normal, sys.executable, "-c", BURN], start_new_session=True)
    try:
        with open_bench(address, operator.tell) as bench, StopRequest() as stop:
            assert isinstance(bench.controls, VirtualPorts)
            bench.controls.set_faults(LOSS)
            deployment = Deployment(
                bench=bench,
                pilot=PolicyPilot(policy),
                goals=goals,
                policy=policy,
                settings=DeploySettings(duration=duration),
            )
            log = path.with_name("steady.mcap")
            outcome = deploy(deployment, log, Keyboard(-1), operator, stop)
            counters = bench.servo.counters
    finally:
        burner.kill()
        burner.wait()
    memory = [megabytes for _, megabytes in operator.memory]
    settled = memory[len(memory) // 6 :]
    print(
        f"steady: {duration:.0f} s, policy by {policy.engine}: {outcome.pacing.text}; "
        f"{outcome.rows} rows, {outcome.missed} missed of {counters.reads}, {counters.retries} "
        f"retries; rules {outcome.trips}; ended: {outcome.ended}; memory {settled[0]:.1f} MB at "
        f"{duration / 6.0:.0f} s, {settled[-1]:.1f} MB at the end, {max(memory):.1f} MB at most; "
        f"log {log.stat().st_size / 1e6:.1f} MB; load {os.getloadavg()[0]:.1f}"
    )


def start(path: Path, count: int = 5) -> None:
    """Start the program several times and wait for its first command."""
    took, sizes = [], []
    with VirtualPorts(load_cell_rate=80) as ports:
        for run in range(count):
            begin = time.monotonic()
            command = [
                sys.executable,
                "-m",
                "tendon_newton",
                "deploy",
                "--policy",
                str(path),
                "--port",
                ports.servo_port,
                "--retries",
                "8",
                "--goals",
                "1.0",
                "--out",
                str(path.parent / f"start{run}"),
            ]
            program = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            while ports.state().duty == 0.0 and program.poll() is None:
                time.sleep(0.005)
            took.append(time.monotonic() - begin)
            time.sleep(1.0)
            sizes.append(memory_of(program.pid))
            program.terminate()
            program.wait()
    print(
        f"start to the first command: median {statistics.median(took):.2f} s, longest "
        f"{max(took):.2f} s of {count}; resident memory {max(sizes):.0f} MB"
    )


def memory_of(process: int) -> float:
    """Return the resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def cost(path: Path, count: int = 20_000) -> None:
    """Time one action of the policy, and a step with its history."""
    rng = np.random.default_rng(0)
    observations = rng.normal(size=(100, 1, 150)).astype(np.float32)
    before, begin = resident(), time.monotonic()
    policy = load_policy(path)
    loaded = time.monotonic() - begin
    pilot = PolicyPilot(policy)
    actions = timed(lambda k: policy(observations[k % 100]), count)
    steps = timed(lambda k: pilot.step([STATE], 0.5), count)
    print(
        f"action {actions}, step with history {steps}; loaded in "
        f"{1e3 * loaded:.0f} ms, {resident() - before:.0f} MB more"
    )


def timed(run: Callable[[int], object], count: int) -> str:
    """Return the median and the 99 % of how long something takes."""
    for k in range(100):
        run(k)
    took = np.empty(count)
    for k in range(count):
        begin = time.perf_counter()
        run(k)
        took[k] = time.perf_counter() - begin
    median, high = 1e6 * np.percentile(took, (50, 99))
    return f"{median:.0f} us median, {high:.0f} us 99 %"


STATE = ServoState(time=0.0, position=0.5, velocity=0.0, current=0.0)

if __name__ == "__main__":
    main()
