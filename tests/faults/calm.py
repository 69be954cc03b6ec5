"""Runs in which nothing is wrong: none may be stopped.

Every bench with one or two servos is driven in every way, whole and worn, with something in its way
or not, with every servo and every load cell, at the rates that there are. In lockstep.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tendon_hardware.benches.bench import open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.control.goals import FixedGoal, stairs
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.errors import HardwareFault
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.host_position_loop import HostPositionLoop, no_stronger
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench.physics.obstacle import OBSTACLES
from tendon_newton.data.excitations import EXCITATIONS, TEST_EXCITATIONS
from tests.hardware.deploy.runs import Flight
from tests.hardware.silent_operator import SilentOperator

LENGTH = 20.0  # Length of a run [s]


@dataclass(frozen=True, kw_only=True)
class CalmRun:
    """A run in which nothing is wrong."""

    bench: str
    seed: int
    wear: str
    servo: str
    load_cell_rate: int
    excitation: str
    obstacle: str

    @property
    def address(self) -> BenchAddress:
        """The virtual bench."""
        return BenchAddress(
            bench=self.bench,
            port=f"virtual:{self.bench}:{self.seed}:{self.wear}",
            servo=self.servo,
            load_cell_rate=self.load_cell_rate,
            lockstep=True,
        )

    def record(self) -> None:
        """Record it to its end."""
        run = PlannedRun(
            name="run",
            bench=self.bench,
            excitation=self.excitation,
            duration=LENGTH,
            obstacle=self.obstacle,
        )
        loop = no_stronger(HostPositionLoop(), SERVOS[self.servo])
        settings = CollectSettings(loop=loop, settle=0.5, limits=SafetyLimits(force=60.0))
        operator = SilentOperator()
        with (
            TemporaryDirectory() as folder,
            open_bench(self.address, operator.tell) as bench,
            StopRequest() as stop,
        ):
            path = Path(folder) / "run.mcap"
            outcome = record_run(bench, run, settings, path, operator, stop)
        assert outcome.finished, outcome.fault


def drawn(rng: random.Random) -> CalmRun:
    """Draw a run."""
    bench = rng.choice(["finger", "finger", "spring_weak", "spring_strong"])
    return CalmRun(
        bench=bench,
        seed=rng.randrange(50),
        wear=rng.choice(["new", "friction"]),
        servo=rng.choice(sorted(SERVOS)),
        load_cell_rate=rng.choice([80, 80, 20, 10]),
        excitation=rng.choice([*EXCITATIONS, *TEST_EXCITATIONS]),
        obstacle=rng.choice(["free", *OBSTACLES]) if bench == "finger" else "free",
    )


def deployed(rng: random.Random) -> None:
    """Deploy a policy to its end, up and down the stairs or to one goal."""
    goals = stairs() if rng.random() < 0.5 else FixedGoal(rng.uniform(0.2, 1.57), (0.0, 1.57))
    settings = DeploySettings(duration=LENGTH)
    rate = rng.choice([80, 20])
    if rate == 20:
        settings = replace(settings, limits=replace(settings.limits, stale_force=0.175))
    outcome = Flight(settings=settings, goals=goals, load_cell_rate=rate).fly()
    assert outcome.fault is None, outcome.ended


def calm(hours: float, tell: Callable[[str], None], seed: int = 0) -> dict[str, Any]:
    """Run for so much simulated time [h], tell of each stop, and return a row of the exam."""
    rng = random.Random(seed)
    stopped, count = 0, round(3600.0 * hours / LENGTH)
    for number in range(count):
        run: CalmRun | str = "a deployment"
        try:
            if number % 5:
                (run := drawn(rng)).record()
            else:
                deployed(rng)
        except (AssertionError, HardwareFault) as error:
            stopped += 1
            tell(f"{run}: {error}")
    tell(f"calm: {count} runs, {count * LENGTH / 60.0:.0f} min simulated: {stopped} stopped")
    return {
        "fault": "nothing is wrong",
        "minutes": count * LENGTH / 60.0,
        "runs": count,
        "acted": count - stopped,
    }
