"""The benches of a reproduction that are not there: they record, and policies climb on them."""

from dataclasses import dataclass
from pathlib import Path

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.excitation_plan import find_plan
from tendon_hardware.control.operator import Operator
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_log import step_table
from tendon_hardware.stop_request import StopRequest
from tendon_lab.reproduction.experiment_plan import record_unit, thinned
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.workflows.climbing import climbed
from tendon_newton.workflows.options import BenchPorts
from tendon_train.policy.scoring.bench_climb import climb_on_bench
from tendon_train.policy.scoring.evaluation_scores import score
from tendon_train.policy.scoring.policy_evaluation import reachable_error

BENCH = "finger"


@dataclass(frozen=True, kw_only=True)
class VirtualBenches:
    """Virtual benches, as fast as this computer runs them."""

    operator: Operator  # Told how it goes

    def record(self, unit: int, out: Path, *, seed: int, most: int | None) -> None:
        """Record the paper's plan and its further experiments on one unit.

        Raises:
            KeyboardInterrupt: The operator has ended it; the same call goes on.
        """
        address = BenchAddress(bench=BENCH, port=f"virtual::{unit}", lockstep=True)
        plan = thinned(find_plan("paper"), most)
        with StopRequest() as stop:
            whole = record_unit(address, plan, out, self.operator, stop, seed=seed)
        if not whole:
            self.operator.tell("the recordings are not complete; the same command goes on")
            raise KeyboardInterrupt

    def climb(self, unit: int, policy: Path, out: Path) -> float:
        """Let a policy climb the paper's stairs on one unit and return its tip error, RMS [m]."""
        ports = BenchPorts(port=f"virtual:{BENCH}:{unit}", faster_than_real_time=True)
        log = climbed(ports, policy, out / "deployments", self.operator)
        mechanism, card = load_mechanism(BENCH), load_policy(policy).card
        climb = climb_on_bench(policy.stem, log, step_table(log), mechanism, card.spool_radius)
        return score(climb, reachable_error(mechanism, climb.goal)).rmse
