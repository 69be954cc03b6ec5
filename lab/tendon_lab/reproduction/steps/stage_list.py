"""The stages of a reproduction in their order: each one file and one line of a table."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from tendon_lab.reproduction.outcome import Outcome
from tendon_lab.reproduction.reproduction import NotDone, Reproduction
from tendon_lab.reproduction.steps import (
    diagnosis_stage,
    force_stage,
    network_stage,
    recording_stage,
    tip_stage,
)
from tendon_newton.errors import unknown_name


@dataclass(frozen=True, kw_only=True)
class ReproductionStage:
    """One step of a reproduction."""

    title: str  # Heading in the report
    run: Callable[[Reproduction], Awaitable[Outcome]]
    """Waits for its jobs, and says what they have found."""
    needs: tuple[str, ...] = ()  # Stages whose files it reads


RECORDINGS = "recordings"
MODELS = ("networks", "diagnosis")
REPRODUCTION_STAGES: dict[str, ReproductionStage] = {
    RECORDINGS: ReproductionStage(title="Recordings", run=recording_stage.run),
    "diagnosis": ReproductionStage(title="What the diagnosis finds", run=diagnosis_stage.run),
    "networks": ReproductionStage(title="Force networks", run=network_stage.run),
    "force": ReproductionStage(
        title="Force along measured motion", run=force_stage.run, needs=("networks",)
    ),
    "tip": ReproductionStage(title="The tip in closed loop", run=tip_stage.run, needs=MODELS),
}


def run_stages(
    reproduction: Reproduction,
    only: Sequence[str] = (),
    stages: Mapping[str, ReproductionStage] = REPRODUCTION_STAGES,
) -> dict[str, Outcome]:
    """Run stages and those that they need; of others, tell what an earlier run found.

    Jobs of stages that do not need each other are under way at the same time; a stage that fails
    takes along those that need it, and no others.

    Args:
        reproduction: What to run them on.
        only: Names of stages; all of them if none.
        stages: All that there are; one stands behind those that it needs.

    Returns:
        What is there of every stage, in their order.

    Raises:
        UnknownName: No such stage.
        InvalidOutput: The folder is another reproduction's.
    """
    wanted = {RECORDINGS} | with_needs(only or tuple(stages), stages)
    reproduction.begin()
    found = asyncio.run(settled(reproduction, wanted, stages))
    return {name: outcome for name, outcome in found.items() if outcome is not None}


async def settled(
    reproduction: Reproduction, wanted: set[str], stages: Mapping[str, ReproductionStage]
) -> dict[str, Outcome | None]:
    """Return what every stage found; None where there is nothing and none is wanted."""
    tasks: dict[str, asyncio.Task[Outcome | None]] = {}

    async def settle(name: str) -> Outcome | None:
        needs = [n for n in (RECORDINGS, *stages[name].needs) if n != name]
        if None in await asyncio.gather(*(tasks[need] for need in needs)):
            return None
        own = reproduction if name in wanted else replace(reproduction, executor=None)
        try:
            outcome = await stages[name].run(own)
        except NotDone:
            return None
        return outcome if name in wanted or outcome.numbers else None

    for name in stages:
        tasks[name] = asyncio.create_task(settle(name))
    await asyncio.wait(tasks.values())  # all end before the first error is raised
    return {name: task.result() for name, task in tasks.items()}


def with_needs(
    names: Sequence[str], stages: Mapping[str, ReproductionStage] = REPRODUCTION_STAGES
) -> set[str]:
    """Return stages and all that they need.

    Raises:
        UnknownName: No such stage.
    """
    found: set[str] = set()
    for name in names:
        if name not in stages:
            raise unknown_name("stage", name, stages)
        found |= {name} | with_needs(stages[name].needs, stages)
    return found
