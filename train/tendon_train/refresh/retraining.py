"""A policy trained on from where it was, on a corrected model."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from tendon_newton.data.files.json_file import read_json
from tendon_newton.errors import InvalidPolicyFile
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.config.turning_config import TurningConfig
from tendon_train.policy.runs.curve import Progress
from tendon_train.policy.runs.policy_export import ExportedPolicy, export_policy
from tendon_train.policy.runs.policy_training import train_policy

PROMISE = "a policy that is trained on lies beside its policy.json"


@dataclass(frozen=True, kw_only=True)
class EarlierTraining:
    """Checkpoint and settings behind a policy."""

    config: PolicyTrainingConfig
    checkpoint: Path  # Last checkpoint of the training


def find_training(policy: Path) -> EarlierTraining:
    """Find the training behind a policy file, in the folder around it.

    Raises:
        InvalidPolicyFile: The folder is not what `tendon-newton train-policy` leaves.
    """
    path = policy.parent / "policy.json"
    table = read_json(path, InvalidPolicyFile, PROMISE).get("config")
    checkpoints = sorted((policy.parent / "checkpoints").glob("[0-9]*.pt"))
    if not checkpoints:
        raise InvalidPolicyFile(
            f"{policy.parent / 'checkpoints'}: a policy is trained on from its last checkpoint; "
            "there is none"
        )
    try:
        own = dict(table) if isinstance(table, dict) else {}
        places = dict(own.pop("environment"))
        if "command_range" in places:  # before the pay-out rule all of it counted everywhere
            places.setdefault("pay_out", places["command_range"])
        turning = TurningConfig(**kept(TurningConfig, places.pop("turning", {})))
        environment = EnvironmentConfig(**kept(EnvironmentConfig, places), turning=turning)
        config = PolicyTrainingConfig(environment=environment, **kept(PolicyTrainingConfig, own))
    except (TypeError, KeyError) as error:
        raise InvalidPolicyFile(f"{path}: its config is not that of a training") from error
    return EarlierTraining(config=config, checkpoint=checkpoints[-1])


def kept(kind: Any, table: dict[str, Any]) -> dict[str, Any]:
    """Return a config's values as its class wants them: JSON has lists in place of tuples."""
    names = {field.name for field in fields(kind)}
    return {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in table.items()
        if key in names
    }


def retrain(
    earlier: EarlierTraining,
    model: Path,
    out: Path,
    *,
    worn: tuple[str, ...] = (),
    iterations: int,
    device: str,
    report: Callable[[Progress], None],
) -> ExportedPolicy:
    """Train a policy on, with the settings that it had, on another model.

    An interrupted training goes on by the same call.

    Args:
        worn: Diagnoses of the bench as it is now: fingers differ by what they leave open as well.
        device: ``cpu`` or ``cuda``.
    """
    before = earlier.config.environment
    config = replace(
        earlier.config,
        environment=replace(before, force=str(model), randomise=(*before.randomise, *worn)),
        iterations=iterations,
        device=device,
    )
    trained = train_policy(config, out, report=report, start=earlier.checkpoint)
    return export_policy(out, trained, config)
