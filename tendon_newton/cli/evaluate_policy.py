"""Let policies climb stairs of goals, in simulation and on a bench, and compare them.

  tendon-newton evaluate-policy ideal/policy.onnx learned/policy.onnx --out comparison
  --force ideal found/model.toml

The goals are the paper's: from 0 to pi/2 and back by pi/10, resting 1.5 s on each. In simulation a
policy runs step for step as it is deployed, against each force model that is named, in the nominal
finger and in as many further ones as --worlds asks for, whose numbers are drawn.

On a bench, real or virtual, whose logs are kept, and on logs of `deploy --goals stairs`:
  tendon-newton evaluate-policy learned/policy.onnx --out comparison --port /dev/ttyUSB0
  tendon-newton evaluate-policy learned/policy.onnx --out comparison --logs deployments/run_0.mcap

OUT gets evaluation.json with every number, evaluation.md with the table, and climb.png.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from train.policy.scoring.evaluation import Climb, RunnablePolicy
    from train.policy.scoring.evaluation_scores import ClimbScore


BENCH_DURATION = 16.5
"""Length of the paper's stairs: eleven of 1.5 s [s]."""


@dataclass(frozen=True, kw_only=True)
class EvaluatePolicyConfig:
    """Let policies climb stairs of goals, in simulation and on a bench, and compare them."""

    policies: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Policy files, ONNX or TorchScript."""
    out: Path
    """Folder for the results; made if it is not there."""
    force: tuple[str, ...] = ("ideal",)
    """What pulls the simulated finger: ideal, model files (.toml) or force networks
    (.safetensors)."""
    finger: str = "finger"
    """Finger with a tip and tendons that close it: a name under assets/, or a USD file."""
    worlds: int = 1
    """Simulated fingers; all but the first have numbers of their own."""
    randomise: tuple[str, ...] = ("joint_friction", "link_mass", "spool_radius", "joint_spring")
    """What differs between them; see train-policy. With joint_friction the first one has the
    nominal friction, a tenth of the springs' torque; none takes the model as it is."""
    dwell: float = 1.5
    """Time on each stair in simulation [s]; on a bench it is 1.5 s."""
    seed: int = 0
    """Of the numbers of the further worlds."""
    trust: bool = False
    """Trust the TorchScript files from now on: they are programs and run with your rights."""
    port: str | None = None
    """Serial port of a servo, or virtual: each policy climbs there too."""
    load_cell_port: str | None = None
    """Serial port of the load cell of that bench."""
    calibration: Path | None = None
    """Calibration of that load cell."""
    further_load_cell_ports: tuple[str, ...] = ()
    """Serial ports of the load cells of further servos on that bench."""
    further_calibrations: tuple[Path, ...] = ()
    """Calibrations of those load cells."""
    faster_than_real_time: bool = False
    """Whether a virtual bench runs as fast as it can."""
    logs: tuple[Path, ...] = ()
    """Logs of deployments on stairs, to be compared too; the first policy's bench is assumed."""
    plots: bool = True
    """Whether to draw the figure."""


def main(config: EvaluatePolicyConfig) -> None:
    """Evaluate, write and print the table."""
    import json

    from tendon_newton.cli.output import make_folder
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()

    from tendon_newton.errors import InvalidParameter
    from tendon_newton.mechanisms.loading import load_mechanism
    from train.policy.scoring.evaluation import reachable_error
    from train.policy.scoring.evaluation_scores import score, to_markdown

    policies = load_policies(config)
    out = make_folder(config.out)
    climbs = [*climbs_in_simulation(config, policies), *climbs_on_bench(config, policies, out)]
    if not climbs:
        raise InvalidParameter("nothing to compare: name a --force, a --port or --logs")
    mechanism = load_mechanism(config.finger)
    scores = [score(climb, reachable_error(mechanism, climb.goal)) for climb in climbs]
    table = {
        "dwell_s": config.dwell,
        "policies": {p.name: json.loads(p.card.to_json()) for p in policies},
        "climbs": [each.to_json() for each in scores],
    }
    text = to_markdown(scores)
    (out / "evaluation.json").write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    (out / "evaluation.md").write_text(text, encoding="utf-8")
    print(text)
    tell_floor(scores)
    if config.plots:
        from train.policy.scoring.evaluation_figure import draw_climbs

        print(f"drew {draw_climbs(climbs, scores, out / 'climb.png')}")
    print(f"wrote {out / 'evaluation.json'} and evaluation.md")


def load_policies(config: EvaluatePolicyConfig) -> list[RunnablePolicy]:
    """Load the policies, and name each after its file, or after its folder where that says more."""
    from hardware.control.policy_runner import load_policy
    from tendon_newton.errors import InvalidParameter
    from train.policy.scoring.evaluation import RunnablePolicy
    from train.policy.worlds.force_model import trust_force

    if not config.policies:
        raise InvalidParameter("name the files of one or more policies to evaluate")
    if not 0.1 <= config.dwell <= 1000.0:
        raise InvalidParameter(f"dwell must be 0.1 to 1000 s; it is {config.dwell}")
    if config.trust:
        for force in config.force:
            trust_force(force)
    stems = [path.stem for path in config.policies]
    policies = []
    for path in config.policies:
        alone = stems.count(path.stem) == 1 and path.stem != "policy"
        loaded = load_policy(path, trust=config.trust)
        name = path.stem if alone else path.resolve().parent.name
        policies.append(RunnablePolicy(name=name, card=loaded.card, run=loaded.run))
    return policies


def climbs_in_simulation(
    config: EvaluatePolicyConfig, policies: list[RunnablePolicy]
) -> list[Climb]:
    """Let the policies climb under each force model."""
    import numpy as np

    from hardware.control.goals import stairs
    from train.policy.config.environment_config import EnvironmentConfig
    from train.policy.scoring.evaluation import climb_stairs

    climbs = []
    for force in config.force:
        worlds = EnvironmentConfig(
            finger=config.finger, force=force, worlds=config.worlds, randomise=config.randomise
        )
        goals = stairs(config.dwell)
        count = round((goals.end + config.dwell) * worlds.rate)
        levels = np.array([goals.value((k + 0.5) / worlds.rate) for k in range(count)])
        climbs += climb_stairs(policies, levels, worlds, seed=config.seed)
    return climbs


def climbs_on_bench(
    config: EvaluatePolicyConfig, policies: list[RunnablePolicy], out: Path
) -> list[Climb]:
    """Let the policies climb on a bench, where there is one, and read the logs that are given."""
    from hardware.deployment.deploy_log import step_table
    from tendon_newton.mechanisms.loading import load_mechanism
    from train.policy.scoring.bench_climb import climb_on_bench

    logs = [(path.stem, path, policies[0]) for path in config.logs]
    if config.port is not None:
        for path, policy in zip(config.policies, policies, strict=True):
            logs.append((policy.name, deployed(config, path, out / "deployments"), policy))
    mechanism = load_mechanism(config.finger)
    return [
        climb_on_bench(name, log, step_table(log), mechanism, policy.card.spool_radius)
        for name, log, policy in logs
    ]


def deployed(config: EvaluatePolicyConfig, policy: Path, folder: Path) -> Path:
    """Deploy a policy on the paper's stairs and return its log."""
    from tendon_newton.cli import deploy

    before = set(folder.glob("*.mcap"))
    deploy.main(
        deploy.DeployConfig(
            policy=policy,
            port=config.port,
            bench=Path(config.finger).stem,
            goals="stairs",
            duration=BENCH_DURATION,
            out=folder,
            split="test",
            trust=config.trust,
            load_cell_port=config.load_cell_port,
            calibration=config.calibration,
            further_load_cell_ports=config.further_load_cell_ports,
            further_calibrations=config.further_calibrations,
            faster_than_real_time=config.faster_than_real_time,
        )
    )
    (log,) = set(folder.glob("*.mcap")) - before
    return log


def tell_floor(scores: list[ClimbScore]) -> None:
    """Say what part of the error no policy can avoid, where that is known."""
    least = scores[0].stairs[0]
    if least.reachable_error > 0.0:
        print(
            f"At goal {least.goal:.2f} rad no policy gets nearer than "
            f"{1e3 * least.reachable_error:.1f} mm: gravity bends the open finger."
        )
