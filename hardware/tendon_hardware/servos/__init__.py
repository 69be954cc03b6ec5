"""Servos by name: a data sheet each, all driven by the same driver."""

from tendon_hardware.servos import sts3215, sts3250, xc330_t288_t, xl330_m288_t
from tendon_hardware.servos.base import ServoSpec
from tendon_newton.errors import look_up

SERVOS: dict[str, ServoSpec] = {
    "sts3215": sts3215.SPEC,
    "sts3250": sts3250.SPEC,
    "xc330_t288_t": xc330_t288_t.SPEC,
    "xl330_m288_t": xl330_m288_t.SPEC,
}


def find_servo(name: str) -> ServoSpec:
    """Return a servo's data sheet; an unknown name is refused."""
    return look_up("servo", name, SERVOS)
