"""The stages of a reproduction in their order: each one file and one line of a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from shutil import rmtree
from threading import Event

from tendon_newton.errors import unknown_name
from train.reproduction.outcome import Outcome, read_outcome, write_outcome
from train.reproduction.reproduction import Reproduction
from train.reproduction.steps import (
    contact_stage,
    curve_stage,
    diagnosis_stage,
    force_stage,
    hybrid_stage,
    network_stage,
    part_stage,
    policy_stage,
    ramp_stage,
    recording_stage,
    spring_stage,
    tip_stage,
)


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One step of a reproduction."""

    title: str
    """Heading in the report."""
    run: Callable[[Reproduction], Outcome]
    needs: tuple[str, ...] = ()
    """Stages whose files it reads."""


RECORDINGS = "recordings"
MODELS = ("networks", "diagnosis", "hybrids")
ON_PARTS = ("parts", *MODELS)
STAGES: dict[str, Stage] = {
    RECORDINGS: Stage(title="Recordings", run=recording_stage.run),
    "diagnosis": Stage(title="What the diagnosis finds", run=diagnosis_stage.run),
    "networks": Stage(title="Force networks", run=network_stage.run),
    "parts": Stage(title="Force networks on parts of the data", run=part_stage.run),
    "hybrids": Stage(
        title="Physics and network together", run=hybrid_stage.run, needs=("networks", "diagnosis")
    ),
    "ramp": Stage(title="The gap on an open-loop ramp", run=ramp_stage.run),
    "force": Stage(title="Force along measured motion", run=force_stage.run, needs=("networks",)),
    "tip": Stage(title="The tip in closed loop", run=tip_stage.run, needs=MODELS),
    "curve": Stage(title="How much data", run=curve_stage.run, needs=ON_PARTS),
    "spring": Stage(title="A spring that was never seen", run=spring_stage.run, needs=ON_PARTS),
    "contact": Stage(title="Contact that was never seen", run=contact_stage.run, needs=ON_PARTS),
    "policies": Stage(title="Policies", run=policy_stage.run, needs=MODELS),
}


def run_stages(reproduction: Reproduction, only: Sequence[str] = ()) -> dict[str, Outcome]:
    """Run stages, and those that they need, or read what they found before.

    With several processes, stages that do not need each other are under way at the same time; one
    that fails takes along those that need it, and no others.

    Args:
        reproduction: What to run them on.
        only: Names of stages; all of them if none.

    Returns:
        What is there of every stage, in the order of the table.
    """
    wanted = with_needs(only or tuple(STAGES))
    found: dict[str, Outcome | None] = {}
    workers = reproduction.workers
    if workers is None:
        for name in STAGES:
            found[name] = settled(reproduction, name, name in wanted, found)
    else:
        under_way: dict[str, Future[None]] = {}
        begun = {name: Event() for name in STAGES}

        def settle(name: str) -> None:
            """Settle a stage as soon as those that it needs are, when it is its turn."""
            for need in (RECORDINGS, *STAGES[name].needs):
                if need != name:
                    under_way[need].result()
            for earlier in ready_before(name):
                begun[earlier].wait()
            with workers.turn:
                begun[name].set()
                found[name] = settled(reproduction, name, name in wanted, found)

        with ThreadPoolExecutor(len(STAGES)) as threads:
            for name in STAGES:
                under_way[name] = threads.submit(settle, name)
        for future in under_way.values():
            future.result()
    return {name: outcome for name in STAGES if (outcome := found[name]) is not None}


def ready_before(name: str) -> list[str]:
    """Return the stages that can begin when one can, and stand before it in the table.

    Its order is that of their pieces, so that what takes longest is not begun last.
    """
    names = list(STAGES)
    return [n for n in names[: names.index(name)] if STAGES[n].needs == STAGES[name].needs]


def settled(
    reproduction: Reproduction, name: str, wanted: bool, found: Mapping[str, Outcome | None]
) -> Outcome | None:
    """Return what a stage found, now or before; None where there is nothing and none is wanted.

    Args:
        reproduction: What to run it on.
        name: Of the stage.
        wanted: Whether it is run if need be.
        found: What the stages that it needs found.
    """
    stage, path = STAGES[name], reproduction.outcome_file(name)
    if name == RECORDINGS:  # it says itself what is there already
        outcome = stage.run(reproduction)
        write_outcome(path, outcome, "")
        return outcome
    if any(found[need] is None for need in stage.needs):
        return None
    key = reproduction.key(name, stage.needs)
    outcome = read_outcome(path, key)
    if outcome is None and wanted:
        reproduction.tell(f"{name}: {stage.title}")
        pieces = path.with_name(f"{name}_{key[:16]}")
        outcome = stage.run(replace(reproduction, pieces=pieces))
        write_outcome(path, outcome, key)
        rmtree(pieces, ignore_errors=True)
    return outcome


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
