"""The smallest plan that every stage of these tests can run on, on the virtual bench."""

from pathlib import Path

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.excitation_plan import BENCHES, Share, runs_of
from tendon_hardware.stop_request import StopRequest
from tendon_lab.reproduction.experiment_plan import record_unit
from tendon_lab.reproduction.settings import ReproductionSettings
from tests.hardware.silent_operator import SilentOperator

TRAINING = (
    Share(excitation="random_steps", count=2, duration=8.0),
    Share(excitation="sine", count=2, duration=5.0),
)
TESTS = (Share(excitation="steps_held_1s", count=1, duration=4.0, split="test"),)
ON_FINGER = (
    Share(excitation="closing_sine", count=1, duration=5.0, split="test"),
    Share(excitation="random_steps", count=1, duration=5.0, obstacle="tape_roll"),
)
PLAN = tuple(
    run
    for bench in BENCHES
    for run in runs_of(bench, (*TRAINING, *TESTS, *(ON_FINGER if bench == "finger" else ())))
)
SETTINGS = ReproductionSettings(
    name="tiny",
    units=(0,),
    epochs=1,
    windows_per_epoch=512,
    kinds=("transformer",),
    diagnosis_seconds=4.0,
    diagnosis_kinds=1,
    refit_seconds=4.0,
    refit_kinds=1,
    time_step=5.0e-4,
)


class TinyBench:
    """Records the small plan on the virtual bench, in lockstep."""

    def record(self, unit: int, out: Path, *, seed: int, most: int | None) -> None:
        """Record it, as far as it is not there."""
        address = BenchAddress(bench="finger", port=f"virtual::{unit}", lockstep=True)
        whole = record_unit(address, PLAN, out, SilentOperator(), StopRequest(), seed=seed)
        assert whole
