"""Let policies follow the paper's stairs of goals, in simulation and on a bench; score them.

A run of a policy over the stairs is a climb.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_hardware.control.goals import stairs
from tendon_hardware.control.operator import Operator
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_log import step_table
from tendon_hardware.virtual_bench.process import DEFAULT_BENCH
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter, listed
from tendon_newton.mechanisms.asset_library import FOLDERS_VARIABLE, asset_files, asset_path
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.workflows.deployment import drive
from tendon_newton.workflows.options import BenchPorts, ClimbOptions, DeployOptions, policy_file
from tendon_newton.workflows.turning_comparison import compare_turning
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.scoring.bench_climb import climb_on_bench
from tendon_train.policy.scoring.evaluation_scores import (
    ClimbScore,
    draw_climbs,
    score,
    to_markdown,
)
from tendon_train.policy.scoring.policy_evaluation import (
    Climb,
    RunnablePolicy,
    climb_stairs,
    reachable_error,
)
from tendon_train.policy.worlds.force_model import trust_force

BENCH_DURATION = 16.5  # Length of the paper's stairs: eleven of 1.5 s [s]


@dataclass(frozen=True, kw_only=True)
class ClimbComparison:
    """Climbs of all policies, what they are worth, and the files that say so."""

    scores: tuple[ClimbScore, ...]  # None of policies that turn a ball
    text: str  # The table in Markdown
    files: tuple[Path, ...]


def compare_policies(options: ClimbOptions, operator: Operator) -> ClimbComparison:
    """Let policies climb, and write ``evaluation.json``, ``evaluation.md`` and ``climb.png``.

    Policies that turn a ball do so instead, and have no picture.

    Raises:
        InvalidParameter: Nothing is named that could be compared, or a policy is for another
            finger.
    """
    policies = load_policies(options)
    finger = finger_of(options.finger, policies)
    out = make_folder(options.out)
    if any(policy.card.task == "turn" for policy in policies):
        text, files = compare_turning(options, policies, finger, out)
        return ClimbComparison(scores=(), text=text, files=files)
    mechanism = load_mechanism(finger)
    logged = [climb_of(path.stem, path, policies[0], mechanism) for path in options.logs]
    climbs = [
        *climbs_in_simulation(options, policies, finger),
        *logged,
        *climbs_on_bench(options, policies, finger, mechanism, out, operator),
    ]
    if not climbs:
        raise InvalidParameter("nothing to compare: name a --force, a --port or --logs")
    scores = tuple(score(climb, reachable_error(mechanism, climb.goal)) for climb in climbs)
    table = {
        "dwell_s": options.dwell,
        "policies": {p.name: json.loads(p.card.to_json()) for p in policies},
        "climbs": [each.to_json() for each in scores],
    }
    text = to_markdown(scores)
    files = (out / "evaluation.json", out / "evaluation.md")
    write_json(files[0], table)
    write_text(files[1], text)
    if options.plots:
        files = (*files, draw_climbs(climbs, scores, out / "climb.png"))
    return ClimbComparison(scores=scores, text=text, files=files)


def load_policies(options: ClimbOptions) -> list[RunnablePolicy]:
    """Load the policies, and name each after its file, or after its folder where that says more."""
    if not options.policies:
        raise InvalidParameter("name the files of one or more policies to evaluate")
    if not 0.1 <= options.dwell <= 1000.0:
        raise InvalidParameter(f"dwell must be 0.1 to 1000 s; it is {options.dwell}")
    if options.trust:
        for force in options.force:
            trust_force(force)
    stems = [path.stem for path in options.policies]
    policies: list[RunnablePolicy] = []
    for path in options.policies:
        alone = stems.count(path.stem) == 1 and path.stem != "policy"
        loaded = load_policy(policy_file(path), trust=options.trust)
        name = path.stem if alone else path.resolve().parent.name
        policies.append(RunnablePolicy(name=name, card=loaded.card, run=loaded.run))
    return policies


def finger_of(given: str | None, policies: Sequence[RunnablePolicy]) -> str:
    """Return the finger that policies are for: the one on their cards, which may be given as well.

    Args:
        given: Name or file of the finger, if it is given.
        policies: The policies; an old card may name no finger.

    Raises:
        InvalidParameter: They are for several fingers, for another one, or for one that is not
            known here.
    """
    cards = {policy.name: policy.card.training.finger for policy in policies}
    named = {name: finger for name, finger in cards.items() if finger is not None}
    if len(set(named.values())) > 1:
        fingers = listed([f"{name} for {finger}" for name, finger in named.items()])
        raise InvalidParameter(f"policies of one finger can be compared; these are {fingers}")
    finger = next(iter(named.values()), None)
    if given is None:
        if finger is not None and finger not in asset_files():
            raise InvalidParameter(
                f"the policy was trained for {finger!r}, which is no asset here: give --finger "
                f"FILE, or list the folder above it in {FOLDERS_VARIABLE}"
            )
        return finger or DEFAULT_BENCH
    if finger is not None and asset_path(given).stem != finger:
        raise InvalidParameter(
            f"the policy was trained for {finger!r}; --finger names {asset_path(given).stem!r}"
        )
    return given


def climbs_in_simulation(
    options: ClimbOptions, policies: Sequence[RunnablePolicy], finger: str
) -> list[Climb]:
    """Let the policies climb under each force model."""
    climbs: list[Climb] = []
    for force in options.force:
        worlds = EnvironmentConfig(
            finger=finger, force=force, worlds=options.worlds, randomise=options.randomise
        )
        levels = stair_levels(worlds.rate, options.dwell)
        climbs += climb_stairs(policies, levels, worlds, seed=options.seed)
    return climbs


def stair_levels(rate: float, dwell: float) -> Array:
    """Return the goal [rad] at every policy step on the paper's stairs, dwelling on each [s]."""
    goals = stairs(dwell)
    count = round((goals.end + dwell) * rate)
    return np.array([goals.value((k + 0.5) / rate) for k in range(count)])


def climbs_on_bench(
    options: ClimbOptions,
    policies: Sequence[RunnablePolicy],
    finger: str,
    mechanism: Mechanism,
    out: Path,
    operator: Operator,
) -> list[Climb]:
    """Let the policies climb on a bench, where there is one."""
    if options.port is None:
        return []
    ports: Any = {field.name: getattr(options, field.name) for field in fields(BenchPorts)}
    deployment = DeployOptions(
        **ports,
        bench=asset_path(finger).stem,
        goals="stairs",
        duration=BENCH_DURATION,
        out=out / "deployments",
        split="test",
        trust=options.trust,
    )
    climbs: list[Climb] = []
    for path, policy in zip(options.policies, policies, strict=True):
        log = drive(replace(deployment, policy=path), operator).path
        assert log is not None
        climbs.append(climb_of(policy.name, log, policy, mechanism))
    return climbs


def climb_of(name: str, log: Path, policy: RunnablePolicy, mechanism: Mechanism) -> Climb:
    """Read a climb from the log of a policy's deployment."""
    return climb_on_bench(name, log, step_table(log), mechanism, policy.card.spool_radius)
