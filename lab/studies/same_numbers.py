"""Whether two commits answer alike: the demo, rollouts of all assets, exports, gradients, speed.

In a tree of each commit ``python lab/studies/same_numbers.py write FILE.json``, one after the
other on a quiet core; then ``python lab/studies/same_numbers.py hold OLD.json NEW.json`` says
what differs and by how much, and how long both took. Without compiled kernels the first run of a
tree compiles for minutes.
"""

import argparse
import hashlib
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

ROWS, SEED, WORLDS = 240, 7, 256
EFFECTS = {
    "command_delay": {"delay": 0.02},
    "coulomb_friction": {"force": 0.4},
    "viscous_friction": {"coefficient": 0.6},
    "load_cell_gain": {"scale": 1.1},
}
BENCH = "finger"  # Of exports, gradients and speed
FREE = {"hand_ball", "hand_pen"}  # What they hold is none of a recording
DEMO_SKIPPED = ("wall_time_s",)


def demo(folder: Path) -> Iterator[tuple[str, Any]]:
    """Yield every number of the demo's answer."""
    from tendon_newton.cli import main

    assert main(["demo", "--quiet", "--out", str(folder)]) == 0
    stack = [("demo", json.loads((folder / "diagnosis.json").read_text(encoding="utf-8")))]
    while stack:
        name, value = stack.pop()
        if isinstance(value, list):
            value = dict(enumerate(value))
        if isinstance(value, dict):
            stack += [(f"{name}.{key}", part) for key, part in value.items()]
        if isinstance(value, str | int | float) and not name.endswith(DEMO_SKIPPED):
            yield name, value


def simulations(folder: Path, assets: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Yield rollouts of all assets, the text of all exports, gradients, and times of a step [s]."""
    import torch
    import warp as wp

    import tendon_newton as tn
    from lab.benchmarks.timing import best_time
    from tendon_newton.exports import EXPORTS
    from tendon_newton.mechanisms.asset_library import asset_names
    from tests.physics.runs import ideal_model, run_of, simulate, stairs

    model, bare, rng = ideal_model(**EFFECTS), ideal_model(), np.random.default_rng(SEED)
    for name in assets or sorted({*asset_names()} - FREE - {"servo"}):
        mechanism = tn.load_mechanism(name)
        tendons = range(len(mechanism.tendons))
        commands = np.stack([stairs(rng, ROWS, 0.0, 2.5, 20) for _ in tendons], axis=1)
        (made,) = simulate([run_of(commands, bench=name)], bare, time_step=1e-3)
        yield f"rollout of {name}", np.concatenate([made.motor_position, made.force], 1).tolist()
    for target, export in EXPORTS.items():
        out = folder / target
        out.mkdir()
        written = export.write(out, tn.load_mechanism(BENCH), model)
        for file in written.files:
            yield f"export {file.name}", hashlib.sha256(file.read_bytes()).hexdigest()
    own = ideal_model(**{name: EFFECTS[name] for name in list(EFFECTS)[:3]})
    run = run_of(stairs(rng, ROWS, 0.2, 2.0, 20), bench=BENCH)
    rollout = tn.DifferentiableRollout(tn.load_mechanism(BENCH), [run], own, device="cpu")
    rollout.forward()
    rollout.backward(motor_position=np.ones((ROWS, 1)), force=np.full((ROWS, 1), 0.1))
    yield "gradients of parameters", rollout.inputs.parameters.grad.numpy().tolist()
    yield "gradients of commands", rollout.inputs.command.grad.numpy().tolist()
    loop = tn.ControlLoop(tn.load_mechanism(BENCH), model, WORLDS, rate=20.0, device="cpu")
    asked = torch.linspace(0.5, 3.0, WORLDS)[:, None]
    loop.reset(asked)
    device = wp.get_device("cpu")
    yield "seconds of a step", min(best_time(lambda: loop.step(asked), device) for _ in range(2))
    back = min(best_time(lambda: (rollout.forward(), rollout.backward()), device) for _ in range(2))
    yield "seconds of a gradient", back


def held(old: Any, new: Any) -> float:
    """Return how far two answers are apart, as a share of the first one's size [1]."""
    if isinstance(old, str) or isinstance(new, str):
        return 0.0 if old == new else np.inf
    a, b = (np.asarray(x, dtype=np.float64) for x in (old, new))
    return np.inf if a.shape != b.shape else float(np.max(np.abs(a - b)) / (np.max(np.abs(a)) or 1))


def main() -> None:
    """Write the answers of a tree, or hold those of two against each other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("write", "hold"))
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--assets", nargs="+", default=(), help="rollouts of these alone")
    told = parser.parse_args()
    tree = Path.cwd()  # whose code is looked at
    sys.path[:0] = [str(tree), *(str(tree / name) for name in ("hardware", "train", "lab"))]
    if told.what == "write":
        with TemporaryDirectory() as folder:
            found = dict([*demo(Path(folder) / "demo"), *simulations(Path(folder), told.assets)])
        told.files[0].write_text(json.dumps(found), encoding="utf-8")
        return
    old, new = (json.loads(file.read_text(encoding="utf-8")) for file in told.files)
    lone = sorted(old.keys() ^ new.keys())
    apart = {name: held(old[name], new[name]) for name in old if name in new}
    times = {name: new[name] / old[name] for name in apart if name.startswith("seconds")}
    differ = {name: far for name, far in apart.items() if far > 0.0 and name not in times}
    print(f"{len(apart) - len(times)} answers, {len(differ)} differ; in one tree alone: {lone}")
    print(*(f"{name}: {far:.2g}" for name, far in sorted(differ.items())), sep="\n")
    print(*(f"{name}: {ratio:.3f} times the old ones" for name, ratio in times.items()), sep="\n")


if __name__ == "__main__":
    main()
