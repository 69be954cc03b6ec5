"""What holds of some stages alone: fields that an effect may read, simulators that have them."""

from collections.abc import Callable, Iterable
from typing import Any

from tendon_newton.device_code.field_check import field_uses
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import is_struct
from tendon_newton.effects import Stage, find_effect
from tendon_newton.errors import InvalidDeviceCode, InvalidParameter

# Stages in which a field of `Tendon` has its value; it is zero in the others. Every other field has
# its value in all stages.
KNOWN_IN: dict[str, tuple[Stage, ...]] = {
    "error": (
        Stage.ERROR,
        Stage.DUTY,
        Stage.MOTOR_FORCE,
        Stage.SPOOL_FORCE,
        Stage.TENSION,
        Stage.TRANSMISSION,
    ),
    "motor_force": (Stage.SPOOL_FORCE, Stage.TENSION),
    "tension": (Stage.ENCODER,),
}
# Stages that are about the rows of a log, which only a rollout over a recording has
LOG_STAGES = (Stage.PERIOD, Stage.CELL_CLOCK, Stage.CELL_LAG)


def check_stage(hook: Callable[..., Any], stage: Stage | None) -> None:
    """Refuse a device function that reads a field of a tendon which has no value in its stage.

    The stage is None where the function renews what the effect remembers.

    Raises:
        InvalidDeviceCode: It does; the message names function, field, stage and line.
    """
    for use in field_uses(hook, is_struct):
        stages = KNOWN_IN.get(use.field) if use.struct is Tendon else None
        if stages is not None and stage not in stages:
            where = "a memory is renewed" if stage is None else f"the stage is {stage.value!r}"
            raise InvalidDeviceCode(
                f"{hook.__qualname__} asks for tendon.{use.field}, which has no value where "
                f"{where}, but in {', '.join(s.value for s in stages)} ({use.place})"
            )


def refuse_stages(effects: Iterable[str], stages: Iterable[Stage], simulator: str) -> None:
    """Refuse effects that act where a simulator has no place for them."""
    for name in effects:
        for stage in stages:
            if find_effect(name).hook(stage) is not None:
                raise InvalidParameter(
                    f"{simulator} cannot hold {name}, which acts on the {stage.value}; Rollout can"
                )
