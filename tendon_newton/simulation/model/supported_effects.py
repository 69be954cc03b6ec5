"""Which effects a simulator other than `Rollout` can hold."""

from collections.abc import Iterable

from tendon_newton.effects import Stage, find_effect
from tendon_newton.errors import InvalidParameter

# Stages that are about the rows of a log, which only a rollout over a recording has
LOG_STAGES = (Stage.PERIOD, Stage.CELL_CLOCK, Stage.CELL_LAG)


def refuse_stages(effects: Iterable[str], stages: Iterable[Stage], simulator: str) -> None:
    """Refuse effects that act where a simulator has no place for them."""
    for name in effects:
        for stage in stages:
            if find_effect(name).hook(stage) is not None:
                raise InvalidParameter(
                    f"{simulator} cannot hold {name}, which acts on the {stage.value}; Rollout can"
                )
