"""Deployments on virtual benches, with faults that begin when a test says so."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hardware.bench import Bench, BenchAddress, open_bench
from hardware.deploy import Deployment, DeployOutcome, deploy
from hardware.deploy_settings import DeploySettings
from hardware.force_estimate import ForceEstimate
from hardware.goals import FixedGoal, Goals
from hardware.keyboard import Keyboard
from hardware.operator import Progress, SilentOperator
from hardware.pilot import Pilot, PolicyPilot
from hardware.policy_runner import Policy
from hardware.safety import Trip
from hardware.servos.base import ServoState
from hardware.stop_request import StopRequest
from tests.hardware.deploy.policies import policy_of


def closing(sample: np.ndarray) -> float:
    """Pull in proportion to what is left to 1.4 times the goal."""
    return float(1.4 * sample[4] - sample[0] + 0.3)


class Disturbed:
    """A pilot that lets something happen once the run has come far enough.

    Args:
        inner: Who decides.
        after: When, since the first step [s].
        act: What happens.
    """

    def __init__(self, inner: Pilot, after: float, act: Callable[[], None]) -> None:
        self.inner, self.after, self.act = inner, after, act
        self.start: float | None = None
        self.happened: float | None = None

    def step(self, state: ServoState, goal: float) -> object:
        """Let it happen when it is time, then decide."""
        self.start = state.time if self.start is None else self.start
        if self.happened is None and state.time - self.start >= self.after:
            self.happened = state.time
            self.act()
        return self.inner.step(state, goal)

    def apply(self, step: object) -> None:
        """Hand it on."""
        self.inner.apply(step)  # pyright: ignore


@dataclass(kw_only=True)
class Flight:
    """One deployment and what came of it."""

    path: Path | None = None
    policy: Policy = field(default_factory=lambda: policy_of(closing))
    goals: Goals = field(default_factory=lambda: FixedGoal(1.0, (0.0, 1.57)))
    settings: DeploySettings = field(default_factory=lambda: DeploySettings(duration=4.0))
    seed: int = 0
    load_cell_rate: int = 80
    lockstep: bool = True
    calibrated: bool = True
    after: float = 1.5
    fault: Callable[[Bench, StopRequest], None] | None = None
    """What happens to the bench."""
    estimate: ForceEstimate | None = None
    said: list[str] = field(default_factory=list)
    acted: list[tuple[Trip, float]] = field(default_factory=list)
    begun: float | None = None
    """When the fault began [s]."""
    torque_after: bool | None = None
    positions: list[float] = field(default_factory=list)

    def fly(self) -> DeployOutcome:
        """Deploy."""
        address = BenchAddress(
            bench="finger", port=f"virtual:finger:{self.seed}",
            load_cell_rate=self.load_cell_rate, lockstep=self.lockstep,
        )  # fmt: skip
        operator = Watching(self)
        with open_bench(address, operator.tell) as bench, StopRequest() as stop:
            if not self.calibrated:
                bench.load_cell = bench.calibration = None
            pilot = PolicyPilot(self.policy)
            fault = self.fault
            if fault is not None:
                pilot = Disturbed(pilot, self.after, lambda: fault(bench, stop))
            deployment = Deployment(
                bench=bench, pilot=pilot,  # pyright: ignore
                settings=self.settings, goals=self.goals, policy=self.policy,
                estimate=self.estimate,
            )  # fmt: skip
            outcome = deploy(deployment, self.path, Keyboard(-1), operator, stop)
            if isinstance(pilot, Disturbed):
                self.begun = pilot.happened
            if self.lockstep:
                self.torque_after = bench.controls.bench.plant.registers.torque  # pyright: ignore
        self.said, self.acted = operator.told, list(outcome.acted)
        return outcome

    def latency(self, rule: str) -> float:
        """Return the time from the fault to the rule's action [s]."""
        assert self.begun is not None
        done = [instant for trip, instant in self.acted if trip.rule.name == rule]
        assert done, f"{rule} never came into effect; {[t.rule.name for t, _ in self.acted]}"
        return done[0] - self.begun


class Watching(SilentOperator):
    """An operator who keeps what is said and shown."""

    def __init__(self, flight: Flight) -> None:
        super().__init__()
        self.flight = flight

    def show(self, progress: Progress) -> None:
        """Keep where the spool was."""
        self.flight.positions.append(progress.position)  # pyright: ignore
