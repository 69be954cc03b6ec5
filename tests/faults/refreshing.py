"""A refresh that was interrupted before its bench: the same command begins to climb there."""

import json
import tempfile
from dataclasses import asdict
from functools import cache
from pathlib import Path
from shutil import copyfile

from tendon_newton.data.model_file import write_model
from tendon_newton.workflows.deployment import drive
from tendon_newton.workflows.options import DeployOptions, RefreshOptions
from tendon_newton.workflows.refreshing import open_ledger
from tendon_train.refresh.refresh_outcome import CHANGED, Drift
from tests.hardware.deploy.policies import Proportional, card_of, write_onnx
from tests.hardware.silent_operator import SilentOperator
from tests.physics.runs import ideal_model
from tests.train.policy.small import short_training


@cache
def trained() -> Path:
    """Return a folder with a policy and its training, a model, and a log of the policy."""
    folder = Path(tempfile.mkdtemp())
    (folder / "checkpoints").mkdir()
    (folder / "checkpoints" / "000001.pt").touch()
    (folder / "policy.json").write_text(json.dumps({"config": asdict(short_training())}))
    write_model(folder / "model.toml", ideal_model())
    drive(
        DeployOptions(
            policy=write_onnx(folder / "policy.onnx", Proportional(), card_of().to_json()),
            port="virtual",
            goals="stairs",
            duration=2.0,
            out=folder / "deployments",
            faster_than_real_time=True,
        ),
        SilentOperator(),
    )
    return folder


def before_the_bench(out: Path, port: str) -> tuple[str, ...]:
    """Leave what a refresh leaves before it climbs, and return the words that name it."""
    folder = trained()
    logs, model, policy = folder / "deployments", folder / "model.toml", folder / "policy.onnx"
    (out / "training").mkdir(parents=True)
    copyfile(policy, out / "training" / policy.name)
    copyfile(model, out / model.name)
    ledger = open_ledger(
        RefreshOptions(logs=(logs,), model=model, policy=policy, out=out, port=port), out
    )
    drift = Drift(
        verdict=CHANGED,
        causes=(),
        theta_rmse=0.1,
        corrected_theta_rmse=0.01,
        reference_theta_rmse=None,
    )
    ledger.finish("drift", asdict(drift))
    ledger.finish("model", {"fitted": "all"})
    ledger.finish("training", {"iterations": 100, "seconds": 1.0, "samples": 1})
    return (str(logs), "--model", str(model), "--policy", str(policy))
