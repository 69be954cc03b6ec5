"""Servos by name: a data sheet each, all driven by the same driver."""

from collections.abc import Mapping
from types import MappingProxyType

from tendon_hardware.servos import sts3215, sts3250, xc330_t288_t, xl330_m288_t
from tendon_hardware.servos.base import ServoSpec
from tendon_newton.errors import look_up

SERVOS: Mapping[str, ServoSpec] = MappingProxyType(
    {
        "sts3215": sts3215.SPEC,
        "sts3250": sts3250.SPEC,
        "xc330_t288_t": xc330_t288_t.SPEC,
        "xl330_m288_t": xl330_m288_t.SPEC,
    }
)


def find_servo(name: str) -> ServoSpec:
    """Return a servo's data sheet; an unknown name is refused."""
    return look_up("servo", name, SERVOS)
