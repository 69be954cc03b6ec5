"""Names of causes: an effect, and where it is about one servo alone, which."""

import re

OF_SERVO = re.compile(r"(?P<effect>.+) of servo (?P<servo>\d+)")


def name_of(effect: str, servo: int | None) -> str:
    """Return the name of an effect of one servo, or of all of them: ``gain_error of servo 1``."""
    return effect if servo is None else f"{effect} of servo {servo}"


def effect_of(cause: str) -> str:
    """Return the effect that a cause is."""
    found = OF_SERVO.fullmatch(cause)
    return found["effect"] if found else cause


def servo_of(cause: str) -> int | None:
    """Return the servo that a cause is about, counted from 0; None where it is about all."""
    found = OF_SERVO.fullmatch(cause)
    return int(found["servo"]) if found else None
