"""The stages of a reproduction in their order: each one file and one line of a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tendon_newton.errors import unknown_name
from train.reproduction import (
    contact_stage,
    curve_stage,
    diagnosis_stage,
    force_stage,
    hybrid_stage,
    network_stage,
    policy_stage,
    ramp_stage,
    recording_stage,
    spring_stage,
    tip_stage,
)
from train.reproduction.outcome import Outcome, read_outcome, write_outcome
from train.reproduction.reproduction import Reproduction


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One step of a reproduction."""

    title: str
    """Heading in the report."""
    run: Callable[[Reproduction], Outcome]
    needs: tuple[str, ...] = ()
    """Stages whose files it reads."""


MODELS = ("networks", "diagnosis", "hybrids")
STAGES: dict[str, Stage] = {
    "recordings": Stage(title="Recordings", run=recording_stage.run),
    "networks": Stage(title="Force networks", run=network_stage.run),
    "diagnosis": Stage(title="What the diagnosis finds", run=diagnosis_stage.run),
    "hybrids": Stage(title="Physics and network together", run=hybrid_stage.run,
                     needs=("diagnosis",)),
    "ramp": Stage(title="The gap on an open-loop ramp", run=ramp_stage.run),
    "force": Stage(title="Force along measured motion", run=force_stage.run, needs=("networks",)),
    "tip": Stage(title="The tip in closed loop", run=tip_stage.run, needs=MODELS),
    "curve": Stage(title="How much data", run=curve_stage.run, needs=MODELS),
    "spring": Stage(title="A spring that was never seen", run=spring_stage.run, needs=MODELS),
    "contact": Stage(title="Contact that was never seen", run=contact_stage.run, needs=MODELS),
    "policies": Stage(title="Policies", run=policy_stage.run, needs=MODELS),
}  # fmt: skip


def run_stages(reproduction: Reproduction, only: Sequence[str] = ()) -> dict[str, Outcome]:
    """Run stages, and those that they need, or read what they found before.

    Args:
        reproduction: What to run them on.
        only: Names of stages; all of them if none.

    Returns:
        What is there of every stage, in the order of the table.
    """
    wanted = with_needs(only or tuple(STAGES))
    out: dict[str, Outcome] = {}
    for name, stage in STAGES.items():
        path = reproduction.out / "stages" / f"{name}.json"
        if name == "recordings":  # it says itself what is there already
            write_outcome(path, out.setdefault(name, stage.run(reproduction)), "")
            continue
        key = reproduction.key(name)
        found = read_outcome(path, key)
        if found is None and name in wanted:
            reproduction.tell(f"{name}: {stage.title}")
            found = stage.run(reproduction)
            write_outcome(path, found, key)
        if found is not None:
            out[name] = found
    return out


def with_needs(names: Sequence[str]) -> set[str]:
    """Return stages and all that they need.

    Raises:
        UnknownName: No such stage.
    """
    found: set[str] = set()
    for name in names:
        if name not in STAGES:
            raise unknown_name("stage", name, STAGES)
        found |= {name} | with_needs(STAGES[name].needs)
    return found
