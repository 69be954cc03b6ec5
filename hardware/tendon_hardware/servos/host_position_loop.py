"""The position loop on the host: a servo in PWM mode becomes a spring that the tendon pulls on."""

from dataclasses import dataclass, replace
from math import isfinite, pi

from tendon_hardware.errors import CommandNotFinite
from tendon_hardware.servos.base import ServoSpec
from tendon_newton.errors import InvalidParameter

REFERENCE_TORQUE = 0.75
"""Stall torque of the XC330-T288-T at 9 V [N m], for which the bench's numbers were chosen."""


@dataclass(frozen=True, kw_only=True, slots=True)
class HostPositionLoop:
    r"""Duty for a command and a measured position, meant to run at 20 Hz.

    .. math:: u = clip(k (\theta_d - \theta), \pm u_{max}) + u_0

    Source: the controller of the bench on which the force network was measured. The offset
    :math:`u_0` keeps the tendon taut.
    """

    gain: float = 0.10  # Duty per angle, k [1/rad]
    duty_limit: float = 0.90  # Greatest duty of the feedback [1]
    offset: float = 0.02  # Duty that is always added [1]
    # Where commands lie and the spool may turn [rad]; outside, no duty drives it further out
    position_range: tuple[float, float] = (0.0, 2.0 * pi)
    # Least command of a spool that is wound in, and the angle beyond which it is [rad]; None where
    # the range's own end counts everywhere
    pay_out: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not self.gain > 0.0 or not isfinite(self.gain):
            raise InvalidParameter(f"gain must be above 0 1/rad; it is {self.gain}")
        if not 0.0 < self.duty_limit <= 1.0 or not abs(self.offset) < self.duty_limit:
            raise InvalidParameter(
                "duty_limit must be above 0, up to 1, and the offset within it; they are "
                f"{self.duty_limit} and {self.offset}"
            )
        low, high = self.position_range
        if not (isfinite(low) and isfinite(high) and low < high):
            raise InvalidParameter(f"position_range must be low, high; it is {low}, {high} rad")
        if self.pay_out is not None and not self.pay_out[0] < low <= self.pay_out[1] < high:
            raise InvalidParameter(
                "pay_out must be a command below the range and an angle in it; they are "
                f"{self.pay_out[0]} and {self.pay_out[1]} rad of {low} to {high} rad"
            )

    @property
    def greatest_duty(self) -> float:
        """Greatest duty that it gives [1]."""
        return min(self.duty_limit + abs(self.offset), 1.0)

    def allowed(self, command: float, position: float) -> float:
        """Return a command [rad] cut to what a spool at an angle [rad] may be asked for."""
        low, high = self.position_range
        if self.pay_out is not None and position > self.pay_out[1]:
            low = self.pay_out[0]
        return min(max(command, low), high)

    def duty(self, command: float, position: float) -> float:
        """Return the duty [1].

        Args:
            command: Desired spool angle [rad]; cut to what is allowed.
            position: Measured spool angle [rad].
        """
        if not (isfinite(command) and isfinite(position)):
            raise CommandNotFinite(
                f"command and position must be finite; they are {command} and {position} rad"
            )
        low, high = self.position_range
        error = self.allowed(command, position) - position
        duty = min(max(self.gain * error, -self.duty_limit), self.duty_limit) + self.offset
        duty = min(max(duty, -1.0), 1.0)
        if position >= high:
            return min(duty, 0.0)
        if position <= low:
            return max(duty, 0.0)
        return duty


def no_stronger(loop: HostPositionLoop, spec: ServoSpec) -> HostPositionLoop:
    """Return a loop with which a stronger servo pulls no harder than the bench's own."""
    share = min(1.0, REFERENCE_TORQUE / spec.stall_torque)
    return replace(
        loop, gain=share * loop.gain, duty_limit=share * loop.duty_limit, offset=share * loop.offset
    )
