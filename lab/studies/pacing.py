"""Measure how steadily ``collect`` keeps 80 Hz beside a virtual bench in real time.

Usage: ``.venv/bin/python -m lab.studies.pacing [--duration 60] [--repeats 3]``. Each line is
one whole run of the program: servo over a pseudo-terminal, load cell, log with its thread, with
waits that sleep to the end and waits that spin for their last part.
"""

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from tendon_hardware.benches.bench import open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.clock import MonotonicClock
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.formats.mcap_file import read_mcap
from tests.hardware.silent_operator import SilentOperator

SPINS = (0.0, 2e-4, 1e-3)  # Ends of a wait that are spent spinning [s]


def main() -> None:
    """Print a line per run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the start; lateness in ms")
    print(
        "spin [ms]  median    99 %   worst  skipped  missed  drift [ms]  CPU  bench's CPU  memory"
    )
    for _ in range(arguments.repeats):
        for spin in SPINS:
            print(line(spin, arguments.duration), flush=True)


def line(spin: float, duration: float) -> str:
    """Record once and return what it took."""
    address = BenchAddress(bench="finger", port="virtual")
    run = PlannedRun(name="run", bench="finger", excitation="random_steps", duration=duration)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        operator = SilentOperator()
        with open_bench(address, operator.tell) as bench, StopRequest() as stop:
            assert isinstance(bench.clock, MonotonicClock)
            bench.clock.spin = spin
            begin, own = time.monotonic(), resource.getrusage(resource.RUSAGE_SELF)
            outcome = record_run(bench, run, CollectSettings(), path, operator, stop)
            wall, used = time.monotonic() - begin, resource.getrusage(resource.RUSAGE_SELF)
        if outcome.fault:
            return f"{1e3 * spin:9.1f}  {outcome.fault}"
        drift = drift_of(read_mcap(path, bench="finger").time)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    pacing = outcome.pacing
    return (
        f"{1e3 * spin:9.1f} {1e3 * pacing.median:7.2f} {1e3 * pacing.p99:7.2f} "
        f"{1e3 * pacing.worst:7.2f} {pacing.overruns:8d} {outcome.missed:7d} {1e3 * drift:11.3f} "
        f"{100.0 * (seconds(used) - seconds(own)) / wall:4.0f} % "
        f"{100.0 * (seconds(after) - seconds(before)) / wall:9.0f} % "
        f"{used.ru_maxrss / 1024:4.0f} MB"
    )


def drift_of(instants: np.ndarray) -> float:
    """Return how far rows have moved against the ticks from the first ten seconds to the last [s].

    Medians, so that a single late row does not count as drift.
    """
    late = instants * 80.0 - np.round(instants * 80.0)
    part = min(800, late.size // 2)
    return float(np.median(late[-part:]) - np.median(late[:part])) / 80.0


def seconds(usage: resource.struct_rusage) -> float:
    """Return processor time [s]."""
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    main()
