"""Whose a cause is, in words: of one servo, or of all where there are several."""

from tendon_newton.data.servo_names import servo_of
from tendon_newton.effects import law_of


def with_owner(cause: str, servos: int) -> str:
    """Return a cause's name with its owner, as in ``command_delay of both servos``.

    Args:
        cause: Name of the cause, which says the one servo that it is of.
        servos: Servos of the bench; nothing is said of an only one.
    """
    if servos == 1 or servo_of(cause) is not None or not law_of(cause).is_of_servo():
        return cause
    return f"{cause} of {'both' if servos == 2 else f'all {servos}'} servos"
