"""Runs in which nothing is wrong: none may be stopped.

Every bench with one or two servos is driven in every way, whole and worn, gently and as hard as may
be, with something in its way or not, with every servo and every load cell, at the rates that there
are. In lockstep.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tendon_hardware.benches.bench import open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.control.goals import FixedGoal, stairs
from tendon_hardware.deployment.deploy_settings import DeploySettings, loops_of
from tendon_hardware.errors import HardwareFault
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.rule_limits import limits_for
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.host_position_loop import HostPositionLoop, no_stronger
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench.physics.obstacle import OBSTACLES
from tendon_newton.data.excitations import EXCITATIONS, TEST_EXCITATIONS
from tests.faults.lies import TWO, squeezing, to_and_fro
from tests.hardware.deploy.policies import policy_of
from tests.hardware.deploy.runs import Flight, closing
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


def swinging(rng: random.Random) -> Callable[[np.ndarray], float]:
    """Return a policy that pulls as hard as it may and lets go, for drawn times."""
    half, step = rng.randrange(6, 60), count()
    return lambda sample: 2.0 if (next(step) // half) % 2 == 0 else -2.0


def deployed(rng: random.Random) -> None:
    """Deploy a policy to its end, on one servo or on two, with something in its way or not."""
    goals = stairs() if rng.random() < 0.5 else FixedGoal(rng.uniform(0.2, 1.57), (0.0, 1.57))
    servo, rate = rng.choice(sorted(SERVOS)), rng.choice([80, 80, 20])
    limits = limits_for(
        SERVOS[servo], SafetyLimits(force=100.0), clip=2.0, load_cell_rate=float(rate)
    )
    settings = DeploySettings(duration=LENGTH, limits=limits)
    words: dict[str, Any] = {"policy": policy_of(rng.choice([closing, swinging(rng), hard]))}
    if rng.random() < 0.2:
        first, *others = loops_of(TWO)
        settings = replace(settings, loop=first, further_loops=tuple(others))
        words = {
            "bench": "finger_antagonist",
            "policy": policy_of(rng.choice([to_and_fro, squeezing()]), TWO),
        }
    else:
        obstacle = rng.choice(["free", *OBSTACLES])
        words |= {"after": 0.02, "fault": lambda bench, stop: bench.controls.set_obstacle(obstacle)}
    outcome = Flight(
        settings=settings, goals=goals, load_cell_rate=rate, servo=servo, **words
    ).fly()
    assert outcome.fault is None, f"{servo}, {words}: {outcome.ended}"


def hard(sample: np.ndarray) -> float:
    """Pull as hard as a policy may."""
    return 2.0


def calm(hours: float, tell: Callable[[str], None], seed: int = 0) -> dict[str, Any]:
    """Run for so much simulated time [h], tell of each stop, and return a row of the exam."""
    rng = random.Random(seed)
    stopped, runs = 0, round(3600.0 * hours / LENGTH)
    for number in range(runs):
        run: CalmRun | str = "a deployment"
        try:
            if number % 2:
                (run := drawn(rng)).record()
            else:
                deployed(rng)
        except (AssertionError, HardwareFault) as error:
            stopped += 1
            tell(f"{run}: {error}")
    tell(f"calm: {runs} runs, {runs * LENGTH / 60.0:.0f} min simulated: {stopped} stopped")
    return {
        "fault": "nothing is wrong",
        "minutes": runs * LENGTH / 60.0,
        "runs": runs,
        "acted": runs - stopped,
    }
