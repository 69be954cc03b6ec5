"""How many control steps a second hands make, alone and with a ball in their grip.

Run from the root of the repository::

    python -m lab.benchmarks.hands                # on the GPU, if there is one
    python -m lab.benchmarks.hands --worlds 64

Fingers close on the ball and go on moving, each hand by other commands. A control step is 50 ms in
steps of 1 ms, float32. It writes ``lab/benchmarks/results/hands_cuda.json``, or ``hands_cpu``.
"""

import argparse
import json
import sys
import time

import torch
import warp as wp

from lab.benchmarks.engines_timed.engines import MODEL
from lab.benchmarks.timing import RESULTS, Row, circumstances, say
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop

ASSETS = ("hand", "hand_ball")
CLOSING = 12
"""Control steps until all fingers press the ball, and those of the kernels' compilation."""
TIMED = 5  # Control steps that are timed


def commands(worlds: int, tendons: int, device: str) -> list[torch.Tensor]:
    """Return the commands [rad] of all control steps, (worlds, tendons) each."""
    generator = torch.Generator().manual_seed(1)
    way = 0.2 * torch.rand(worlds, tendons, generator=generator)
    steps = torch.arange(CLOSING + TIMED, dtype=torch.float32)
    return [(torch.clamp(0.25 * k, max=4.0) + way * torch.sin(0.5 * k)).to(device) for k in steps]


def row(asset: str, worlds: int, device: str) -> Row:
    """Return the rate of one asset with so many worlds."""
    mechanism = load_mechanism(asset)
    loop = ControlLoop(
        mechanism, MODEL, worlds, rate=20.0, max_step=1e-3, device=device, precision="float32"
    )
    asked = commands(worlds, len(mechanism.tendons), device)
    loop.reset(torch.zeros_like(asked[0]))
    for command in asked[:CLOSING]:
        loop.step(command)
    loop.require_finite()
    begun = time.perf_counter()
    for command in asked[CLOSING:]:
        loop.step(command)
    loop.require_finite()
    seconds = (time.perf_counter() - begun) / TIMED
    return {"asset": asset, "worlds": worlds, "control_steps_per_s": round(worlds / seconds)}


def main() -> None:
    """Time all assets and write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, nargs="+", default=[4096, 8192, 16384])
    arguments = parser.parse_args()
    quiet_warp()
    device = "cuda" if wp.get_device().is_cuda else "cpu"
    rows = []
    for asset in ASSETS:
        for worlds in arguments.worlds:
            rows.append(row(asset, worlds, device))
            say(rows[-1])
    command = " ".join(["python -m lab.benchmarks.hands", *sys.argv[1:]])
    result = {**circumstances(command), "rows": rows}
    (RESULTS / f"hands_{device}.json").write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
