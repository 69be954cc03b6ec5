"""How long a user waits: commands from start to end, each in a process of its own.

Run from the root of the repository, for both parts or one of them::

    python -m lab.benchmarks.startup [commands] [worlds]
    python -m lab.benchmarks.startup --fresh [--of CHECKOUT]

With ``--fresh`` all is timed from nothing: a new environment, an empty kernel cache, the demo, a
bench of one's own and a short training, of this or another checkout. Beside the seconds by the
clock stand those that the processors worked, which a busy machine changes less, and its load.
Each command runs first with an empty kernel cache, then with that of the first run (the best of
three); seconds by the clock, so the machine should be quiet. The worlds of a training are made with
compiled kernels, after the imports (the best of three); seconds that the process itself computed.
A part replaces its own rows in ``lab/benchmarks/results/startup_cpu.json``.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from lab.benchmarks.timing import RESULTS, Row, circumstances, commit, say
from tests.search_path import search_path

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "hidden_friction"
MODEL = EXAMPLE / "model.toml"
RESULT = RESULTS / "startup_cpu.json"
FRESH_RESULT = RESULTS / "startup_fresh_cpu.json"
WARM_RUNS = 3
REPLAY = ["simulate", str(EXAMPLE), "--model", str(MODEL), "--no-plots", "--out", "OUT"]
COMMANDS = {
    "help": ["--help"],
    "help of a verb": ["simulate", "--help"],
    "check an asset": ["asset", "check", "finger"],
    "simulate": REPLAY,
    "simulate with MuJoCo": [*REPLAY, "--solver", "mujoco"],
    "diagnose": ["diagnose", str(EXAMPLE), "--model", str(MODEL), "--out", "OUT"],
    "first iteration of a training": [
        "train-policy",
        "--worlds",
        "64",
        "--steps",
        "8",
        "--iterations",
        "1",
        "--out",
        "OUT",
    ],
}
"""What a user types behind ``tendon-newton``; OUT is an empty folder."""
WORLDS = (64, 4096, 65_536)
FIVE_CAUSES = (
    "coulomb_friction",
    "command_delay",
    "tendon_slack",
    "joint_stiffness_error",
    "gain_error",
)
PLANT = [sys.executable, "-m", "tests.planted.generator"]
ENVIRONMENT = """
import gc, sys, time
from tendon_newton.cli import COLLECT_AFTER
gc.set_threshold(*COLLECT_AFTER)
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.environment import FingerEnvironment
begun = time.process_time()
FingerEnvironment(EnvironmentConfig(worlds=int(sys.argv[1])))
print(time.process_time() - begun)
"""
"""Makes the worlds of a training as a verb does."""


def seconds(command: list[str], cache: Path) -> float:
    """Run a command once; return how long it took [s]."""
    with tempfile.TemporaryDirectory() as out:
        words = [out if word == "OUT" else word for word in command]
        environment = {**os.environ, "WARP_CACHE_PATH": str(cache)}
        begun = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "tendon_newton", *words],
            cwd=ROOT,
            env=environment,
            check=True,
            capture_output=True,
        )
        return time.perf_counter() - begun


def computing_seconds(worlds: int) -> float:
    """Make the worlds of a training; return the computing time that it took [s]."""
    command = [sys.executable, "-c", ENVIRONMENT, str(worlds)]
    made = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return float(made.stdout.split()[-1])


def time_commands() -> list[Row]:
    """Time every command."""
    rows = []
    for name, command in COMMANDS.items():
        with tempfile.TemporaryDirectory() as cache:
            cold = seconds(command, Path(cache))
            warm = min(seconds(command, Path(cache)) for _ in range(WARM_RUNS))
        rows.append({"what": name, "cold_seconds": round(cold, 2), "warm_seconds": round(warm, 2)})
        say(rows[-1])
    return rows


def time_worlds() -> list[Row]:
    """Time every number of worlds."""
    rows = []
    for worlds in WORLDS:
        best = min(computing_seconds(worlds) for _ in range(WARM_RUNS))
        rows.append({"worlds": worlds, "cpu_seconds": round(best, 2)})
        say(rows[-1])
    return rows


def fresh_rows(checkout: Path) -> Iterator[Row]:
    """Time an installation and what a newcomer runs first, from an empty environment.

    Args:
        checkout: Whose Makefile and program are timed; its own environment is left alone.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        clone = folder / "clone"
        subprocess.run(["git", "clone", "-q", str(checkout), str(clone)], check=True)
        makefile = (clone / "Makefile").read_text(encoding="utf-8")
        stamp = next(s for s in (".venv/.installed-for-demo", ".venv/.installed") if s in makefile)
        program = str(clone / ".venv" / "bin" / "tendon-newton")
        policy = ["train-policy", "--worlds", "32", "--steps", "16", "--iterations", "4"]
        steps: dict[str, tuple[list[str], str]] = {
            "installation for the demo": (["make", "-s", stamp], "demo"),
            "demo, empty kernel cache": ([program, "demo", "--out", "OUT"], "demo"),
            "demo again": ([program, "demo", "--out", "OUT"], "demo"),
            "train-policy, 4 iterations of 32 worlds, empty kernel cache": (
                [sys.executable, "-m", "tendon_newton", *policy, "--out", "OUT"],
                "policy",
            ),
        }
        for causes in (FIVE_CAUSES[:1], FIVE_CAUSES):
            recordings = str(folder / f"recordings {len(causes)}")
            subprocess.run([*PLANT, recordings, "--effect", *causes], cwd=ROOT, check=True)
            command = [program, "diagnose", recordings, "--out", "OUT"]
            first = len(causes) == 1
            what = "one planted cause, empty kernel cache" if first else "five planted causes"
            steps[what] = (command, "diagnosis")
        for number, (what, (command, cache)) in enumerate(steps.items()):
            words = [str(folder / f"out {number}") if w == "OUT" else w for w in command]
            yield {"what": what, **costs(words, clone, folder / cache)}
        size = sum(p.lstat().st_size for p in (clone / ".venv").rglob("*")) / 1.0e6
        yield {"what": "size of the environment", "megabytes": round(size)}


def costs(command: list[str], folder: Path, cache: Path) -> Row:
    """Run a command; return what it took, and how busy the machine was meanwhile."""
    environment = {**os.environ, "WARP_CACHE_PATH": str(cache), "PYTHONPATH": search_path(folder)}
    begun = time.perf_counter()
    run = subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert run.stdout is not None
    row: Row = {}
    said = []
    for line in run.stdout:
        said.append(line.decode())
        if "looking at" in said[-1]:
            row["first_simulation_seconds"] = round(time.perf_counter() - begun, 1)
    _, status, used = os.wait4(run.pid, 0)
    if status:
        raise SystemExit(f"{command} failed:\n{''.join(said)}")
    return {
        "seconds": round(time.perf_counter() - begun, 1),
        "cpu_seconds": round(used.ru_utime + used.ru_stime, 1),
        **row,
        "peak_megabytes": round(used.ru_maxrss / 1.0e3),
        "load": round(os.getloadavg()[0], 1),
    }


PARTS = {"commands": time_commands, "worlds": time_worlds}  # What is timed, by its name in the file


def time_fresh(checkout: Path) -> None:
    """Time a checkout from nothing; what is measured is kept at once, under its commit."""
    circumstance = circumstances("python -m lab.benchmarks.startup --fresh --of CHECKOUT")
    cores = f"{platform.machine()}, {os.cpu_count()} cores"
    timed = {**circumstance, "commit": commit(checkout), "device": cores, "rows": []}
    for row in fresh_rows(checkout):
        say(row)
        timed["rows"].append(row)
        result = json.loads(FRESH_RESULT.read_text()) if FRESH_RESULT.exists() else {}
        FRESH_RESULT.write_text(json.dumps({**result, timed["commit"]: timed}, indent=2) + "\n")


def main() -> None:
    """Time the parts that were asked for, and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="all without a name")
    parser.add_argument("--fresh", action="store_true", help="from an empty environment")
    parser.add_argument("--of", type=Path, default=ROOT, help="checkout to time with --fresh")
    options = parser.parse_args()
    if options.fresh:
        time_fresh(options.of.resolve())
        return
    result = json.loads(RESULT.read_text())
    for part in options.parts or PARTS:
        command = f"python -m lab.benchmarks.startup {part}"
        result[part] = {**circumstances(command), "rows": PARTS[part]()}
    RESULT.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
