"""Fields of a tendon that an effect may read in some stages alone."""

from collections.abc import Callable
from typing import Any

from tendon_newton.device_code.field_check import field_uses
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import is_struct
from tendon_newton.effects import Stage
from tendon_newton.errors import InvalidDeviceCode

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
