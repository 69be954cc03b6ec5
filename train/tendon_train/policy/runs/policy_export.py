"""From a trained policy to its files: ONNX and TorchScript, each with the policy's card."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from tendon_newton import __version__
from tendon_newton.actuators.networks.artifact import write_network
from tendon_newton.actuators.networks.onnx_file import write_module
from tendon_newton.data.cards.policy_card import DutyLoop, FurtherServo, PolicyCard, PolicyTraining
from tendon_newton.data.cards.policy_observation import sample_of
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.model_file import NamedValues
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.curve import CurvePoint, curve_table
from tendon_train.policy.runs.policy_training import Trained, files_of
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.turning import Turning

INPUT, OUTPUT = "observation", "action"
UNNAMED_SERVO = "unnamed"  # Servo on the card of a bench that names none
SERVO_READINGS = 4  # Readings of the servo per policy step, of which the policy sees the last


@dataclass(frozen=True, kw_only=True)
class ExportedPolicy:
    """The files of a policy."""

    onnx: Path
    torchscript: Path
    card: PolicyCard


class PolicyNetwork(nn.Module):
    """A policy in use: observations in SI units to actions (W, D) in a unit of its own [rad]."""

    def __init__(self, actor: Any, unit: float) -> None:
        super().__init__()
        self.deterministic = actor.as_jit().cpu().eval()
        self.unit = unit

    def forward(self, observation: Tensor) -> Tensor:
        """Return the actions, not yet cut."""
        return self.unit * self.deterministic(observation)


def export_policy(out: Path, trained: Trained, config: PolicyTrainingConfig) -> ExportedPolicy:
    """Write ``policy.onnx`` and ``policy.pt`` with their card, and ``policy.json`` with the curve.

    Raises:
        InvalidOutput: A file cannot be written.
    """
    card = make_card(trained.environment, config, trained.points)
    unit = config.environment.action_unit
    network = PolicyNetwork(trained.runner.alg.get_policy(), unit).eval()
    exported = ExportedPolicy(onnx=out / "policy.onnx", torchscript=out / "policy.pt", card=card)
    write_policy_onnx(exported.onnx, network, card)
    write_network(exported.torchscript, network, card)
    table = {"config": asdict(config), "curve": curve_table(trained.points)}
    write_json(out / "policy.json", table)
    return exported


def make_card(
    environment: FingerEnvironment, config: PolicyTrainingConfig, points: Sequence[CurvePoint]
) -> PolicyCard:
    """Say what a policy sees and does, and where it comes from."""
    own = environment.config
    first, *further = servos_of(environment)
    turning = environment.task.card if isinstance(environment.task, Turning) else None
    return PolicyCard(
        command_range=first.command_range,
        pay_out=first.pay_out,
        spool_radius=first.spool_radius,
        servo=first.servo,
        force_limit=first.force_limit,
        further_servos=tuple(further),
        loop=loop_of(environment.force.model.actuator),
        observation=sample_of(environment.num_actions, own.task),
        action_clip=own.action_clip,
        goal_range=own.goals if turning is None else own.turning.turn_rates,
        turning=turning,
        rate=own.rate,
        servo_rate=own.rate * SERVO_READINGS,
        history=own.history,
        model=environment.force.sha256,
        training=PolicyTraining(
            seed=config.seed,
            git_commit=git_commit(),
            version=__version__,
            samples=points[-1].samples if points else 0,
            force=environment.force.name,
            randomisation=environment.randomiser.told,
            files=files_of(environment),
        ),
    )


def loop_of(actuator: NamedValues) -> DutyLoop | None:
    """Return the position loop of a servo whose force comes of a duty."""
    if actuator.name != "pwm_servo":
        return None
    gain, limit, offset = (
        float(actuator.values.get(name, 0.0))
        for name in ("duty_per_rad", "max_duty", "duty_offset")
    )
    return DutyLoop(gain=gain, limit=limit, offset=offset)


def servos_of(environment: FingerEnvironment) -> list[FurtherServo]:
    """Return what a card says of each servo, in the order of the tendons."""
    named = environment.config.servo or environment.force.servo
    return [
        FurtherServo(
            command_range=command_range,
            pay_out=pay_out,
            spool_radius=environment.spool_radius,
            servo=named or tendon.servo.replace("-", "_") or UNNAMED_SERVO,
            force_limit=tendon.force_limit,
        )
        for tendon, command_range, pay_out in zip(
            environment.mechanism.tendons,
            environment.command_ranges,
            environment.pay_outs,
            strict=True,
        )
    ]


def write_policy_onnx(path: Path, network: nn.Module, card: PolicyCard) -> None:
    """Write a policy as a single ONNX file for any number of worlds."""
    write_module(path, network.cpu(), torch.zeros(1, card.observation_size), (INPUT, OUTPUT), card)
