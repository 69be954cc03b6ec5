"""How long a compiler for CUDA takes over the kernels of a control loop; no GPU is needed.

Run from the root of the repository, on a quiet machine::

    python -m lab.benchmarks.compiling                # hand and hand_ball
    python -m lab.benchmarks.compiling finger thumb

It takes a control step on the CPU, compiles every kernel that was loaded for the device of the
GPU's figures, to its own instructions, and writes ``lab/benchmarks/results/compiling_cuda.json``.
"""

import argparse
import json
import platform
import sys
import tempfile
import time
from datetime import UTC, datetime

import torch
import warp as wp

from lab.benchmarks.engines_timed.engines import MODEL
from lab.benchmarks.programs import ARCHITECTURE, own_modules, plain_name
from lab.benchmarks.timing import RESULTS, commit
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop

RESULT = RESULTS / "compiling_cuda.json"


def take_step(asset: str) -> None:
    """Take a control step of two worlds on the CPU, which loads their kernels."""
    mechanism = load_mechanism(asset)
    loop = ControlLoop(
        mechanism, MODEL, 2, rate=20.0, max_step=1e-3, device="cpu", precision="float32"
    )
    command = torch.zeros(2, len(mechanism.tendons))
    loop.reset(command)
    loop.step(command)


def compile_times(seen: list[wp.Module]) -> dict[str, float]:
    """Compile modules that are not among those seen; return the seconds of each name's kernels."""
    found: dict[str, float] = {}
    for module in own_modules():
        if module in seen:
            continue
        seen.append(module)
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            wp.compile_aot_module(module, arch=ARCHITECTURE, module_dir=folder, use_ptx=False)
        seconds, name = time.perf_counter() - begun, plain_name(module)
        found[name] = round(found.get(name, 0.0) + seconds, 1)
        sys.stdout.write(f"  {seconds:6.1f} s  {name}\n")
        sys.stdout.flush()
    return found


def main() -> None:
    """Time all assets and write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("assets", nargs="*", default=["hand", "hand_ball"])
    assets = parser.parse_args().assets
    quiet_warp()
    seen: list[wp.Module] = []
    rows = {}
    for asset in assets:
        sys.stdout.write(f"{asset}\n")
        take_step(asset)
        rows[asset] = compile_times(seen)
    result = {
        "command": " ".join(["python -m lab.benchmarks.compiling", *sys.argv[1:]]),
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": f"compiled for sm_{ARCHITECTURE} on one core, {platform.machine()}",
        "seconds": rows,
    }
    RESULT.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
