"""Deployments on virtual benches, with faults that begin when a test says so."""

import functools
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.benches.bench_address import BenchAddress, DriveAddress
from tendon_hardware.benches.virtual_calibration import calibrated_twins
from tendon_hardware.control.goals import FixedGoal, Goals
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.control.pilot import Pilot, PilotStep, PolicyPilot
from tendon_hardware.control.policy_runner import Policy
from tendon_hardware.deployment.deploy import Deployment, DeployOutcome, deploy
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.load_cells.calibration import write_calibration
from tendon_hardware.safety_rules.force_estimate import ForceEstimate
from tendon_hardware.safety_rules.rules_applied import Trip
from tendon_hardware.servos.base import ServoState
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.stop_request import StopRequest
from tests.hardware.deploy.policies import policy_of
from tests.hardware.silent_operator import SilentOperator

WATCHDOG, FORGOTTEN = 0.22, 0.6
"""Times after which a servo that hears nothing gives no duty, with and without a watchdog [s]."""


@functools.cache
def calibration_files(bench: str, rate: int) -> tuple[Path, ...]:
    """Return the calibrations of a virtual bench's load cells, made once."""
    folder = Path(tempfile.mkdtemp())
    paths = []
    for place, calibration in enumerate(calibrated_twins(bench, 0, rate)):
        paths.append(folder / f"cell_{place}.toml")
        write_calibration(paths[-1], calibration)
    return tuple(paths)


def closing(sample: np.ndarray) -> float:
    """Pull in proportion to what is left to 1.4 times the goal."""
    return float(1.4 * sample[4] - sample[0] + 0.3)


class Disturbed:
    """A pilot in whose step something happens once the run has come far enough."""

    def __init__(
        self, inner: Pilot, instant: float, act: Callable[[], None], *, often: bool = False
    ) -> None:
        self.inner, self.instant, self.act, self.often = inner, instant, act, often
        self.happened: float | None = None

    def step(self, states: Sequence[ServoState], goal: float) -> PilotStep:
        """Let it happen when it is time, then decide."""
        if self.happened is None and states[0].time >= self.instant:
            self.happened = states[0].time
            self.act()
        elif self.happened is not None and self.often:
            self.act()
        return self.inner.step(states, goal)

    def apply(self, step: PilotStep | None) -> None:
        """Hand it on."""
        self.inner.apply(step)


def at_instant(bench: Bench, instant: float, act: Callable[[], None]) -> None:
    """Let something happen at an instant of a bench in lockstep, whatever the loop is doing."""
    virtual = bench.controls  # pyright: ignore
    advance = virtual.advance

    def advance_with_it(time: float) -> None:
        if time >= instant:
            virtual.advance = advance
            advance(instant)
            act()
        advance(time)

    virtual.advance = advance_with_it


@dataclass(kw_only=True)
class Flight:
    """One deployment and what came of it."""

    path: Path | None = None
    bench: str = "finger"
    policy: Policy = field(default_factory=lambda: policy_of(closing))
    pilot: Pilot | None = None  # Flies in the policy's place
    goals: Goals = field(default_factory=lambda: FixedGoal(1.0, (0.0, 1.57)))
    settings: DeploySettings = field(default_factory=lambda: DeploySettings(duration=2.0))
    load_cell_rate: int = 80
    servo: str = "xc330_t288_t"
    lockstep: bool = True
    load_cell: bool = True
    after: float = 0.5  # When the fault happens, since the bench was opened [s]
    fault: Callable[[Bench, StopRequest], None] | None = None  # What happens
    # Whether it happens to the program, in a step of its pilot, and not to the bench
    in_step: bool = False
    often: bool = False  # Whether it is let happen in every step from then on
    estimate: ForceEstimate | None = None
    keyboard: Keyboard = field(default_factory=lambda: Keyboard(-1))
    operator: SilentOperator = field(default_factory=SilentOperator)
    acted: list[tuple[Trip, float]] = field(default_factory=list)
    begun: float | None = None  # When the fault began [s]
    # Whether any servo drove its motor when the deployment had returned
    torque_after: bool | None = None
    duty_after: float = 0.0  # Greatest duty of any motor once its watchdog has had its time [1]
    angle_after: float = 0.0  # True angle of the spool then [rad]

    def fly(self) -> DeployOutcome:
        """Deploy."""
        first, *others = calibration_files(self.bench, self.load_cell_rate)
        further = [
            DriveAddress(identifier=2 + k, calibration=each) for k, each in enumerate(others)
        ]
        address = BenchAddress(
            bench=self.bench,
            port="virtual",
            load_cell_rate=self.load_cell_rate,
            servo=self.servo,
            lockstep=self.lockstep,
            calibration=first,
            further=tuple(further),
        )
        with open_bench(address, self.operator.tell) as bench, StopRequest() as stop:
            if not self.load_cell:
                bench.drives[0].load_cell = bench.drives[0].calibration = None
            pilot, fault = self.pilot or PolicyPilot(self.policy), self.fault
            if fault is not None:
                self.begun = bench.clock.now() + self.after
                if self.in_step or not self.lockstep:
                    pilot = Disturbed(
                        pilot, self.begun, lambda: fault(bench, stop), often=self.often
                    )
                else:
                    at_instant(bench, self.begun, lambda: fault(bench, stop))
            deployment = Deployment(
                bench=bench,
                pilot=pilot,
                settings=self.settings,
                goals=self.goals,
                policy=self.policy,
                estimate=self.estimate,
            )
            with self.keyboard as keyboard:
                outcome = deploy(deployment, self.path, keyboard, self.operator, stop)
            if isinstance(pilot, Disturbed):
                self.begun = pilot.happened
            if self.lockstep:
                plant = bench.controls.plant  # pyright: ignore
                self.angle_after = plant.motor.angle
                watched = FAMILIES[bench.servo.spec.family].forgets is None
                wait = WATCHDOG if watched else FORGOTTEN
                bench.clock.sleep_until(bench.clock.now() + wait)
                self.torque_after = any(line.motor.enabled for line in plant.lines)
                self.duty_after = max(abs(line.motor.duty) for line in plant.lines)
        self.acted = list(outcome.acted)
        return outcome

    @property
    def since(self) -> float:
        """When the fault began, where there was one [s]."""
        assert self.begun is not None
        return self.begun

    def latency(self, rule: str) -> float:
        """Return the time from the fault to the end of the rule's action [s]."""
        done = [
            instant
            for trip, instant in self.acted
            if trip.rule.name == rule and instant >= self.since
        ]
        assert done, f"{rule} never came into effect; {[t.rule.name for t, _ in self.acted]}"
        return done[0] - self.since
