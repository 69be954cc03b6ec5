"""How far a tendon came in a step, by its velocity at the end and its mean acceleration."""

from tendon_newton.device_code.placeholders import real
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template


@device_template
def travel(tendon: Tendon) -> real:
    """Return how far a tendon was wound in since the step began [m]."""
    return (tendon.velocity - real(0.5) * tendon.acceleration * tendon.elapsed) * tendon.elapsed
