"""A fault for each safety rule, made on the virtual bench."""

import os
import signal
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hardware.bench import Bench
from hardware.deploy_settings import DeploySettings
from hardware.safety_limits import DeployLimits
from hardware.stop_request import StopRequest
from hardware.virtual_bench import FaultEvent, Faults
from tests.hardware.deploy.policies import policy_of
from tests.hardware.deploy.runs import Flight, closing

SETTINGS = DeploySettings(duration=6.0)
ALLOWED = 0.1
"""From a fault to what is done against it [s]."""


def plant(bench: Bench) -> Any:
    """Return what the bench is made of."""
    return bench.controls.bench.plant  # pyright: ignore


def let(name: str, **words: Any) -> Callable[[Bench, StopRequest], None]:
    """Let an event happen now."""

    def happen(bench: Bench, stop: StopRequest) -> None:
        bench.controls.plan(FaultEvent(name=name, start=bench.clock.now(), **words))  # pyright: ignore

    return happen


def slip(bench: Bench, stop: StopRequest) -> None:
    """Let the spool spin out of its window, as it does when the tendon breaks."""
    plant(bench).motor.angle = 7.5


def sag(bench: Bench, stop: StopRequest) -> None:
    """Let the supply sag below what the servo needs, but not so far that it restarts."""
    plant(bench).motor.supply = 6.0


def heat(bench: Bench, stop: StopRequest) -> None:
    """Heat the motor."""
    plant(bench).motor.temperature = 68.0


def load(bench: Bench, stop: StopRequest) -> None:
    """Hang four kilogrammes on the load cell."""
    bench.controls.hang_mass(4.0)  # pyright: ignore


def silence(bench: Bench, stop: StopRequest) -> None:
    """Let no answer of the servo come through."""
    bench.controls.set_faults(Faults(dropped_replies=1.0))  # pyright: ignore


def stall(bench: Bench, stop: StopRequest) -> None:
    """Let the computer be busy with something else for 75 ms."""
    bench.clock.sleep_until(bench.clock.now() + 0.075)


def terminate(bench: Bench, stop: StopRequest) -> None:
    """Send what a shutdown sends."""
    os.kill(os.getpid(), signal.SIGTERM)


def hang_up(bench: Bench, stop: StopRequest) -> None:
    """Send what a lost terminal sends."""
    os.kill(os.getpid(), signal.SIGHUP)


class Spoilt:
    """A policy that goes bad when it is told to.

    Args:
        output: What it gives from then on.
        calm: Whether it does nothing before.
    """

    def __init__(self, output: float, *, calm: bool = False) -> None:
        self.output = output
        self.calm = calm
        self.bad = False

    def __call__(self, sample: np.ndarray) -> float:
        """Act well, or badly."""
        if self.bad:
            return self.output
        return 0.0 if self.calm else closing(sample)

    def spoil(self, bench: Bench, stop: StopRequest) -> None:
        """Go bad."""
        self.bad = True


@dataclass(kw_only=True)
class Case:
    """A fault and the rule that must act against it."""

    rule: str
    action: str
    fault: Callable[[Bench, StopRequest], None] | None = None
    settings: DeploySettings = SETTINGS
    output: float | None = None
    """What a policy that goes bad gives."""
    calm: bool = False
    """Whether it does nothing before."""
    words: dict[str, Any] = field(default_factory=dict)

    def flight(self, after: float) -> Flight:
        """Prepare a deployment with this fault."""
        fault, words = self.fault, dict(self.words)
        if self.output is not None:
            spoilt = Spoilt(self.output, calm=self.calm)
            fault, words["policy"] = spoilt.spoil, policy_of(spoilt)
        return Flight(settings=self.settings, fault=fault, after=after, **words)


def limited(**changes: Any) -> DeploySettings:
    """Return settings with other limits."""
    return replace(SETTINGS, limits=DeployLimits(**changes))


CASES: dict[str, Case] = {
    "a spool out of its window": Case(rule="position_window", action="off", fault=slip),
    "a sagging supply": Case(rule="voltage", action="off", fault=sag),
    "an overload": Case(rule="servo_stopped", action="off", fault=let("alert", alert="overload")),
    "a restarted servo": Case(rule="missed_reads", action="hold", fault=let("reboot")),
    "too much tension": Case(rule="tension", action="unwind", fault=load),
    "a hot motor": Case(rule="temperature", action="unwind", fault=heat),
    "too much current": Case(
        rule="current",
        action="unwind",
        output=2.0,
        calm=True,
        settings=limited(current=0.015),
    ),
    "a shutdown": Case(rule="operator", action="unwind", fault=terminate),
    "a lost terminal": Case(rule="operator", action="unwind", fault=hang_up),
    "a silent servo": Case(rule="missed_reads", action="hold", fault=silence),
    "a silent load cell": Case(
        rule="stale_force", action="hold", fault=let("cell_silence", duration=0.4)
    ),
    "a busy computer": Case(
        rule="loop_overrun", action="hold", fault=stall, words={"in_step": True}
    ),
    "a policy that gives no number": Case(rule="policy_output", action="hold", output=np.nan),
    "a policy far out of range": Case(rule="policy_output", action="hold", output=1e3),
    "a policy that jumps": Case(
        rule="command_rate",
        action="cut",
        output=2.0,
        calm=True,
        settings=limited(command_rate=10.0),
    ),
}
"""Every rule that can be broken on a virtual bench in lockstep, by what breaks it."""
