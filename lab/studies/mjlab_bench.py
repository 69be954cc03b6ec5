"""How far benches exported to mjlab stray from our own simulation, run by mjlab itself.

    MJLAB_PYTHON=/path/to/python python -m lab.studies.mjlab_bench

The Python is one with mjlab 1.6. The physics steps 0.5 ms; the motor's angle is compared.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from lab.studies.exports import TRUTH_STEP, model_of
from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.exports.configs.mjlab_target import write_mjlab_target
from tendon_newton.exports.departure import standard_runs
from tendon_newton.exports.model_numbers import angle_shift, command_lead, spool_of
from tendon_newton.exports.mujoco.mujoco_target import placed_tendons
from tendon_newton.simulation.hosts.replay import bench_of, rollout_of

CASES = (
    ("finger", "pwm_servo"),
    ("spring_weak", "pwm_servo"),
    ("thumb", "pwm_servo"),
    ("finger", "ideal"),
    ("finger", "pd_torque"),
)
STEP, COUNT = 5.0e-4, 25  # Step of the physics [s], and how many are in a row


def stray(bench: str, actuator: str) -> float:
    """Return by how much the motor's angle strays [rad], RMS."""
    model = model_of(bench, actuator)
    mechanism = bench_of(bench, model)
    (run,) = standard_runs(mechanism, spool_of(mechanism.tendons[0], model))
    rollout = rollout_of(mechanism, [run], model, time_step=TRUTH_STEP)
    ours = rollout.run(rollout.base_vectors(model)[None])[0][0]
    signs, offsets = placed_tendons(mechanism)
    (tendon,), sign = mechanism.tendons, signs[0]
    shift, radius = angle_shift(tendon, model, offsets[0]), spool_of(tendon, model)
    assert run.command is not None
    targets = run.command[:, 0] - shift + command_lead(model)
    if actuator != "pwm_servo":
        targets = targets * sign * radius
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_mjlab_target(folder, mechanism, model)
        asked = {
            "step": STEP,
            "count": COUNT,
            "gravity": mechanism.gravity.tolist(),
            "joints": ours.joint_position[0].tolist(),
            "targets": targets.tolist(),
        }
        (folder / "asked.json").write_text(json.dumps(asked), encoding="utf-8")
        lengths = lengths_in_mjlab(folder)
    return rms(sign * lengths / radius + shift - ours.motor_position[:, 0])


def lengths_in_mjlab(folder: Path) -> Array:
    """Return the tendon's lengths [m] that mjlab finds."""
    program = Path(__file__).with_name("mjlab_world.py")
    subprocess.run([os.environ["MJLAB_PYTHON"], str(program), str(folder)], check=True)
    return np.loadtxt(folder / "lengths.csv")


def main() -> None:
    """Print a table."""
    quiet_warp()
    print("| bench | actuator | motor angle |\n|---|---|---|")
    for bench, actuator in CASES:
        print(f"| {bench} | {actuator} | {1e3 * stray(bench, actuator):.1f} mrad |", flush=True)


if __name__ == "__main__":
    main()
