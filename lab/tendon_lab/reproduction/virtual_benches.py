"""The benches of a reproduction that are not there: they record."""

from dataclasses import dataclass
from pathlib import Path

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.excitation_plan import find_plan
from tendon_hardware.control.operator import Operator
from tendon_hardware.stop_request import StopRequest
from tendon_lab.reproduction.experiment_plan import record_unit, thinned

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
