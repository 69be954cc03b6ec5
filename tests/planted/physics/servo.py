"""A servo with a motor of its own: winding, rotor and gear behind a position loop."""

from dataclasses import dataclass

import numpy as np

from tests.planted.physics.bench import FORCE_LIMIT


@dataclass(frozen=True, kw_only=True)
class DcServo:
    """Numbers of the servo, all seen from the output shaft."""

    duty_per_rad: float  # Duty cycle per position error [1/rad]
    greatest_duty: float = 1.0  # [1]
    supply: float  # [V]
    torque_constant: float  # [N m/A], and the same number in V s/rad
    resistance: float  # Of the winding [ohm]
    inertia: float  # Of rotor and gear [kg m^2]

    @property
    def torque_per_volt(self) -> float:
        """Torque of the motor at rest per volt [N m/V]."""
        return self.torque_constant / self.resistance

    def force_at_rest(self, error: float, radius: float) -> float:
        """Force [N] on a spool of that radius [m] that the servo holds with an error [rad]."""
        duty = float(np.clip(self.duty_per_rad * error, -self.greatest_duty, self.greatest_duty))
        force = duty * self.supply * self.torque_per_volt / radius
        return float(np.clip(force, -FORCE_LIMIT, FORCE_LIMIT))
