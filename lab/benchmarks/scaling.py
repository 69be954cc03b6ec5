"""Measure control steps per second against the number of joints and of tendons.

Run as `python -m lab.benchmarks.scaling`; `--out` is the folder of the figures. Chains of 1
to 20 joints with one tendon, three joints with 1 to 10 tendons, and the assets with routed tendons,
each in our solver and in SolverMuJoCo at one step length. What the file has is not measured again.
"""

from __future__ import annotations

import argparse
import json
import platform
import re
import sys
import tempfile
import time
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from lab.benchmarks.engines_timed.engines import CAPPED, GAIN, MODEL, RADIUS
from lab.benchmarks.engines_timed.soundness import CONTROL_STEP, refuse_escaped
from lab.benchmarks.timing import RESULTS, best_time, commit
from tendon_newton.mechanisms.authoring.asset_plan import plan_asset, write_asset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver

STEP = 1.0e-3  # Step of both solvers [s]
WORLDS = 64
JOINTS = (1, 2, 3, 5, 10, 20)
TENDONS = (1, 2, 5, 10)
MANY = 3  # Joints of the chains with several tendons
ASSETS = ("finger_routed", "finger_antagonist", "thumb", "hand")


@wp.kernel
def pull_kernel(
    command: wp.array2d(dtype=float),
    arms: wp.array2d(dtype=float),
    joints: int,
    q: wp.array(dtype=float),
    force: wp.array(dtype=float),
) -> None:
    """Apply the ideal source's force of every tendon to the joints of a world."""
    i = wp.tid()
    for j in range(joints):
        force[joints * i + j] = 0.0
    for d in range(arms.shape[0]):
        length = wp.float32(0.0)
        for j in range(joints):
            length += arms[d, j] * q[joints * i + j]
        pull = wp.clamp(GAIN * (command[i, d] - length / RADIUS), 0.0, 21.0)
        for j in range(joints):
            force[joints * i + j] += arms[d, j] * pull


def chain(folder: Path, joints: int, tendons: int) -> Mechanism:
    """Return a row of light links of 10 mm, each tendon with an arm at every joint."""
    plan = plan_asset(
        f"chain_{joints}_{tendons}",
        tuple(f"joint_{j}" for j in range(joints)),
        spool_radius=RADIUS,
        force_limit=21.0,
        length=(0.01,),
        mass=(0.004,),
        moment_arm=(0.006,),
        stiffness=(0.05,),
        range=(1.5,),
        damping=(0.0005,),
    )
    file = write_asset(folder, plan)
    layer = file.with_name("tendon.usda")
    text = layer.read_text()
    (block,) = re.findall(r"( +def MjcTendon \"(\w+)\".*?\n        \}\n)", text, re.DOTALL)
    copies = [block[0].replace(f'"{block[1]}"', f'"flexor_{d}"') for d in range(tendons)]
    layer.write_text(text.replace(block[0], "\n".join(copies)))
    return load_mechanism(file)


def our_rate(mechanism: Mechanism) -> dict[str, float]:
    """Return control steps per second of all worlds, and the time until the first [s]."""
    model = build_model(mechanism, WORLDS)
    began = time.perf_counter()
    solver = TendonSolver(model, MODEL, max_step=STEP, precision="float32", update_bodies=False)
    state: Any = model.state()
    solver.command.fill_(1.0)
    solver.settle(state)
    solver.command.fill_(2.0)
    step = partial(solver.step, state, state, None, None, CONTROL_STEP)
    step()
    first = time.perf_counter() - began
    seconds = best_time(step, model.device)
    refuse_escaped("TendonSolver", joints_of(mechanism, state), mechanism.joint_limits)
    return {"steps_per_second": WORLDS / seconds, "first_step_s": first}


def joints_of(mechanism: Mechanism, state: Any) -> np.ndarray:
    """Return the joints of all worlds [rad or m], shape (W, J)."""
    return state.joint_q.numpy().reshape(WORLDS, len(mechanism.joints))


def mujoco_rate(mechanism: Mechanism) -> dict[str, float]:
    """Return the same of SolverMuJoCo; strings that turn their arms it pulls at their first ones.

    That costs it nothing, and it has their lengths to compute either way.
    """
    model = build_model(mechanism, WORLDS)
    began = time.perf_counter()
    solver = SolverMuJoCo(model, disable_contacts=True, **CAPPED)
    states, control = [model.state(), model.state()], model.control()
    command = wp.full((WORLDS, len(mechanism.tendons)), 2.0, dtype=float)
    arms = wp.array(np.array([t.moment_arm for t in mechanism.tendons]), dtype=float)
    substeps = 2 * round(CONTROL_STEP / STEP / 2.0)

    def control_step() -> None:
        for k in range(substeps):
            before, after = states[k % 2], states[1 - k % 2]
            inputs = [command, arms, len(mechanism.joints), before.joint_q, control.joint_f]
            wp.launch(pull_kernel, WORLDS, inputs=inputs)
            solver.step(before, after, control, None, STEP)

    control_step()
    first = time.perf_counter() - began
    with wp.ScopedCapture() as capture:
        control_step()
    seconds = best_time(lambda: wp.capture_launch(capture.graph), model.device)
    refuse_escaped("SolverMuJoCo", joints_of(mechanism, states[0]), mechanism.joint_limits)
    return {"steps_per_second": WORLDS / seconds, "first_step_s": first}


def measure(mechanism: Mechanism) -> dict[str, Any]:
    """Return the figures of one mechanism in both solvers."""
    ours, theirs = our_rate(mechanism), mujoco_rate(mechanism)
    row: dict[str, Any] = {
        "name": mechanism.name,
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "joints": len(mechanism.joints),
        "tendons": len(mechanism.tendons),
        "tendon": ours,
        "mujoco": theirs,
        "ratio": ours["steps_per_second"] / theirs["steps_per_second"],
    }
    sys.stdout.write(
        f"  {mechanism.name:18s} {row['joints']:3d} joints {row['tendons']:3d} tendons   "
        f"{ours['steps_per_second']:9.0f} /s   {theirs['steps_per_second']:7.0f} /s   "
        f"{row['ratio']:5.1f}   first step after {ours['first_step_s']:.1f} s\n"
    )
    sys.stdout.flush()
    return row


def main() -> None:
    """Measure all and write what is known after each mechanism."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS)
    out = parser.parse_args().out
    wp.config.quiet = True
    device = wp.get_device()
    result: dict[str, Any] = {
        "command": "python -m lab.benchmarks.scaling",
        "device": device.name if device.is_cuda else f"{platform.machine()} ({device.name})",
        "actuator": "ideal",
        "worlds": WORLDS,
        "step_s": STEP,
        "control_step_s": CONTROL_STEP,
    }
    file = out / f"scaling_{'gpu' if device.is_cuda else 'cpu'}.json"
    known = json.loads(file.read_text()) if file.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        shapes = [(count, 1) for count in JOINTS] + [(MANY, count) for count in TENDONS[1:]]
        groups = {
            "chains": [partial(chain, home, *shape) for shape in shapes],
            "assets": [partial(load_mechanism, name) for name in ASSETS],
        }
        for name, members in groups.items():
            result[name] = known.get(name, [])
            done = {row["name"] for row in result[name]}
            for member in members:
                mechanism = member()
                if mechanism.name not in done:
                    result[name].append(measure(mechanism))
                file.write_text(json.dumps(result, indent=2) + "\n")
    sys.stdout.write(f"wrote {file}\n")


if __name__ == "__main__":
    main()
