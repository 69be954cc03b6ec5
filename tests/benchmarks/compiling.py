"""How long a compiler for CUDA takes over the kernels of a control loop; no GPU is needed.

Run from the root of the repository, on a quiet machine::

    python -m tests.benchmarks.compiling                # hand and hand_ball
    python -m tests.benchmarks.compiling finger thumb

It takes a control step on the CPU, compiles every kernel that was loaded for the device of the
GPU's figures, to its own instructions, and writes ``tests/benchmarks/results/compiling_cuda.json``.
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

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.benchmarks.programs import ARCHITECTURE, own_modules, plain_name
from tests.benchmarks.timing import RESULTS, commit

RESULT = RESULTS / "compiling_cuda.json"
IDEAL = Model(actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}))


def take_step(asset: str) -> None:
    """Take a control step of two worlds on the CPU, which loads their kernels."""
    mechanism = load_mechanism(asset)
    loop = ControlLoop(
        mechanism, IDEAL, 2, rate=20.0, max_step=1e-3, device="cpu", precision="float32"
    )
    command = torch.zeros(2, len(mechanism.tendons))
    loop.reset(command)
    loop.step(command)


def compile_times(seen: set[int]) -> dict[str, float]:
    """Compile modules that are not among those seen; return the seconds of each by its name."""
    found = {}
    for module in own_modules():
        if id(module) in seen:
            continue
        seen.add(id(module))
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            wp.compile_aot_module(module, arch=ARCHITECTURE, module_dir=folder, use_ptx=False)
        found[plain_name(module)] = round(time.perf_counter() - begun, 1)
        sys.stdout.write(f"  {found[plain_name(module)]:6.1f} s  {plain_name(module)}\n")
        sys.stdout.flush()
    return found


def main() -> None:
    """Time all assets and write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("assets", nargs="*", default=["hand", "hand_ball"])
    assets = parser.parse_args().assets
    quiet_warp()
    seen: set[int] = set()
    rows = {}
    for asset in assets:
        sys.stdout.write(f"{asset}\n")
        take_step(asset)
        rows[asset] = compile_times(seen)
    result = {
        "command": " ".join(["python -m tests.benchmarks.compiling", *sys.argv[1:]]),
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": f"compiled for sm_{ARCHITECTURE} on one core, {platform.machine()}",
        "seconds": rows,
    }
    RESULT.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
