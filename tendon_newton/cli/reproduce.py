"""Reproduce the paper's results, each beside the paper's number, on the virtual bench.

  tendon-newton reproduce --quick --out reproduction

records the paper's 36 minutes, trains force networks, diagnoses the physical model, and runs the
paper's experiments: the open-loop ramp, forces on three setups and in contact, the tip on a
sinusoid, curves over data, extrapolation to a spring and to contact that were never seen, and
policies on stairs. OUT gets reproduction.md with the paper's value beside ours in every row,
reproduction.json with every number, seed, commit and hash, figures, and every model as a file for
other verbs. What is finished is not done again; the same seed gives the same numbers.

The stages, with --only: recordings, diagnosis, networks, parts, hybrids, ramp, force, tip, curve,
spring, contact, policies. Without --quick it takes hours on a few cores: ten benches,
longer trainings, policies of its own. With --jobs N, N processes do the pieces of all stages side
by side, and with --device cuda the policies learn on GPUs; all else is done on the CPU.

On real recordings, one folder for each bench, with the test recordings named as here:
  tendon-newton reproduce --recordings bench_a bench_b --out reproduction
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from train.reproduction.settings import ReproductionSettings


@dataclass(frozen=True, kw_only=True)
class ReproduceConfig:
    """What to reproduce, and where it goes."""

    out: Path
    """Folder for everything; made if it is not there."""
    quick: bool = False
    """Fewer benches, short trainings and no policies of its own: minutes instead of hours."""
    only: tuple[str, ...] = ()
    """Stages to run, with those that they need; all of them unless given."""
    seed: int = 0
    """Of what the recordings draw and of the networks' starting weights."""
    units: tuple[int, ...] = ()
    """Units of the virtual bench; 0 to 4 if quick, else 0 to 9, unless given."""
    recordings: tuple[Path, ...] = ()
    """Folders of real recordings, in place of the virtual benches."""
    causes: Path | None = None
    """Model file whose causes are fitted to every bench; a diagnosis finds them unless given."""
    jobs: int = 1
    """Processes side by side; the cores are shared among them."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the policies of a full run learn: on a CPU with a ninth of a GPU's steps."""
    policy: tuple[Path, ...] = ()
    """Policies (ONNX) that climb the stairs, in place of ones that are trained here."""


def main(config: ReproduceConfig) -> None:
    """Run the stages and write the report."""
    from tendon_newton.cli.output import make_folder
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()

    from train.reproduction.pieces import Workers
    from train.reproduction.report import rows_table, write_report
    from train.reproduction.reproduction import Reproduction
    from train.reproduction.steps.stages import run_stages

    with Workers(config.jobs) as workers:
        reproduction = Reproduction(
            settings=settings_of(config),
            out=make_folder(config.out),
            bench=None if config.recordings else VirtualBenches(),
            folders=config.recordings,
            policies=config.policy,
            causes=config.causes,
            tell=say,
            workers=workers if workers.count > 1 else None,
        )
        outcomes = run_stages(reproduction, config.only)
    table, page = write_report(reproduction, outcomes)
    print(rows_table([row for outcome in outcomes.values() for row in outcome.rows]))
    print(f"\nwrote {page} and {table.name}")


def settings_of(config: ReproduceConfig) -> ReproductionSettings:
    """Return the settings that the options name."""
    from train.reproduction.settings import POLICIES, find_settings

    settings = find_settings("quick" if config.quick else "full")
    return replace(
        settings,
        seed=config.seed,
        units=config.units or settings.units,
        policies=None if settings.policies is None else POLICIES[config.device],
    )


def say(text: str) -> None:
    """Print a line about what is being done."""
    print(text, flush=True)


class VirtualBenches:
    """Virtual benches, as fast as this computer runs them."""

    def record(self, unit: int, out: Path, *, seed: int, most: int | None) -> None:
        """Record the paper's plan and its further experiments on one unit."""
        from hardware.benches.bench_address import BenchAddress
        from hardware.collection.excitation_plan import find_plan
        from hardware.collection.experiment_plan import record_unit, thinned
        from hardware.stop_request import StopRequest
        from tendon_newton.cli.collect import Terminal

        address = BenchAddress(bench="finger", port=f"virtual::{unit}", lockstep=True)
        plan = thinned(find_plan("paper"), most)
        with StopRequest() as stop, Terminal() as operator:
            whole = record_unit(address, plan, out, operator, stop, seed=seed)
        if not whole:
            print("the recordings are not complete; the same command goes on", file=sys.stderr)
            raise KeyboardInterrupt

    def climb(self, unit: int, policy: Path, out: Path) -> float:
        """Let a policy climb the paper's stairs on one unit and return its tip error, RMS [m]."""
        from hardware.control.policy_runner import load_policy
        from tendon_newton.cli.evaluate_policy import EvaluatePolicyConfig, climbs_on_bench
        from tendon_newton.mechanisms.loading import load_mechanism
        from train.policy.scoring.evaluation import RunnablePolicy, reachable_error
        from train.policy.scoring.evaluation_scores import score

        config = EvaluatePolicyConfig(
            policies=(policy,), out=out, port=f"virtual:finger:{unit}", faster_than_real_time=True
        )
        loaded = load_policy(policy, trust=False)
        named = RunnablePolicy(name=policy.stem, card=loaded.card, run=loaded.run)
        (climb,) = climbs_on_bench(config, [named], out)
        return score(climb, reachable_error(load_mechanism("finger"), climb.goal)).rmse
