"""Train a policy for a finger by reinforcement learning in simulation.

The paper's budget of 105 million steps, minutes on a GPU and hours on a CPU:
  tendon-newton train-policy --out policies/ideal

On a diagnosed model, or on a force network:
  tendon-newton train-policy --force found/model.toml --randomise none --out policy
  tendon-newton train-policy --force networks/paper-0.safetensors --out policy

A hand that turns a ball in its palm:
  tendon-newton train-policy --task turn --out turning

On four GPUs of one machine:
  torchrun --nproc-per-node 4 -m tendon_newton train-policy --device cuda --out policy

A GPU is used where torch finds one. A try on a CPU, in some minutes:
  tendon-newton train-policy --worlds 256 --steps 32 --epochs 4 --learning-rate 1e-3 --out try

OUT gets policy.onnx and policy.pt, each with its card, policy.json with the learning curve, a
TensorBoard log and checkpoints. The same command goes on with a training that was interrupted, and
with more --iterations also with a finished one.
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.device_code.quiet import quiet_warp
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig

if TYPE_CHECKING:
    from tendon_train.policy.runs.forecast import Forecast

LONG = 1800.0  # Time from which on a shorter training is proposed [s].
TRY = "--worlds 256 --steps 32 --epochs 4 --learning-rate 1e-3"


@dataclass(frozen=True, kw_only=True)
class TrainPolicyConfig:
    """Train a policy for a finger by reinforcement learning in simulation."""

    out: Path  # Folder for the files; made if it is not there.
    trust: bool = False
    """Trust the force network from now on: its file is a program and runs with your rights."""
    training: tyro.conf.OmitArgPrefixes[PolicyTrainingConfig] = field(
        default_factory=PolicyTrainingConfig
    )


def main(config: TrainPolicyConfig) -> None:
    """Train and write the policy."""
    quiet_warp()

    from tendon_hardware.servos import find_servo
    from tendon_newton.mechanisms.asset_library import asset_files
    from tendon_train.policy.runs.policy_export import export_policy
    from tendon_train.policy.runs.policy_training import train_policy
    from tendon_train.policy.runs.training_process import Process
    from tendon_train.policy.worlds.force_model import trust_force
    from tendon_train.policy.worlds.randomisation import on_diagnosed_finger

    own = replace(config.training, environment=on_diagnosed_finger(config.training.environment))
    if own != config.training:
        print(f"  on {own.environment.finger}, the bench of the diagnosis", flush=True)
    if own.environment.servo is not None:
        find_servo(own.environment.servo)
    if config.trust:
        trust_force(own.environment.force)
    rank = Process.own().rank
    out = make_folder(config.out, shared=rank > 0)
    trained = train_policy(
        own, out, report=lambda p: print(f"  {p.text}", flush=True), expect=show_forecast
    )
    for divergence in trained.environment.divergences:
        print(f"  {divergence}")
    if rank > 0:
        return
    exported = export_policy(out, trained, own)
    print(f"\nwrote {exported.onnx} and {exported.torchscript.name}")
    if trained.points:
        last, environment = trained.points[-1], own.environment
        words = ["tendon-newton", "evaluate-policy", str(exported.onnx), "--out", "comparison"]
        if environment.finger not in asset_files():
            words += ["--finger", environment.finger]
        if environment.force != "ideal":
            words += ["--force", environment.force]
        print(f"{last.samples:,} steps; while exploring: {last.text}; next: {shlex.join(words)}")


def show_forecast(expected: Forecast) -> None:
    """Say what the training will take, and what takes less."""
    print(f"  {expected.text}", flush=True)
    if expected.seconds is not None and expected.seconds > LONG:
        print(f"  a try in some minutes: {TRY}", flush=True)
