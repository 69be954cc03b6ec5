"""The stages of a reproduction in their order: each one file and one line of a table."""

from collections.abc import Callable, Sequence
from contextlib import suppress
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
from tendon_newton.errors import look_up


@dataclass(frozen=True, kw_only=True)
class ReproductionStage:
    """One step of a reproduction."""

    title: str  # Heading in the report
    run: Callable[[Reproduction], Outcome]  # Does its jobs, and says what they have found
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


def run_stages(reproduction: Reproduction, only: Sequence[str] = ()) -> dict[str, Outcome]:
    """Run stages and those that they need; of others, tell what an earlier run found.

    Args:
        reproduction: What to run them on.
        only: Names of stages; all of them if none.

    Returns:
        What is there of every stage, in their order.

    Raises:
        UnknownName: No such stage.
        InvalidOutput: The folder is another reproduction's.
    """
    wanted = {RECORDINGS} | with_needs(only or tuple(REPRODUCTION_STAGES))
    reproduction.begin()
    found: dict[str, Outcome] = {}
    for name, stage in REPRODUCTION_STAGES.items():
        own = reproduction if name in wanted else replace(reproduction, executor=None)
        if found.keys() >= {*stage.needs}:
            with suppress(NotDone):
                found[name] = stage.run(own)
    return found


def with_needs(names: Sequence[str]) -> set[str]:
    """Return stages and all that they need.

    Raises:
        UnknownName: No such stage.
    """
    found: set[str] = set()
    for name in names:
        stage = look_up("stage", name, REPRODUCTION_STAGES)
        found |= {name} | with_needs(stage.needs)
    return found
