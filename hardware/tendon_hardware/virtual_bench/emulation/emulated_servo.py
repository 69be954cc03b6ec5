"""What every emulated servo on the bus has in common, whatever its family."""

import random
from typing import Any, ClassVar

from tendon_hardware.virtual_bench.physics.constants import ServoConstants
from tendon_hardware.virtual_bench.physics.motor import Motor

REBOOT_TIME = 0.25  # Silence after a reboot [s]; assumed


class EmulatedServo:
    """A servo's side of the bus."""

    BAUD_RATES: ClassVar[tuple[int, ...]]  # Baud rates by the value of their register [bit/s]
    # Address of the register of the ID; the baud rate and the return delay stand behind it
    IDENTIFIER: ClassVar[int]

    def __init__(
        self,
        registers: Any,
        firmware: Any,
        motor: Motor,
        constants: ServoConstants,
        rng: random.Random,
    ) -> None:
        self._registers = registers
        self._firmware = firmware
        self._motor = motor
        self._constants = constants
        self._random = rng
        self._silent_until = 0.0

    @property
    def identifier(self) -> int:
        """Address on the bus."""
        return int(self._registers.value(self.IDENTIFIER))

    @property
    def baud(self) -> int:
        """Speed that its port listens at [bit/s]."""
        code: int = self._registers.value(self.IDENTIFIER + 1)
        return self.BAUD_RATES[code]

    @property
    def return_delay(self) -> float:
        """Pause before an answer [s]."""
        return 2e-6 * self._registers.value(self.IDENTIFIER + 2)

    def restart(self, time: float, count: int) -> None:
        """Lose the RAM, torque included, and be silent for a while.

        Args:
            time: Now [s].
        """
        self._registers.power_up(count)
        self._silent_until = time + REBOOT_TIME

    def _measured(self) -> tuple[float, float]:
        """Return what scatter adds to the current [A], and the voltage as a register has it [V].

        The converter samples within the PWM's period: steady at rest and at full duty only.
        """
        gauss, duty = self._random.gauss, abs(self._motor.duty)
        current = self._constants.current_noise * gauss(0.0, 1.0)
        ripple = self._constants.voltage_ripple * min(1.0, 4.0 * duty * (1.0 - min(1.0, duty)))
        return current, self._motor.voltage + ripple * gauss(0.0, 1.0)
