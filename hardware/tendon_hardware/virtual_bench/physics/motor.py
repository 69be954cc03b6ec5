"""A DC motor behind an H-bridge, its gear with friction that holds, its supply and its warmth."""

from math import exp

from tendon_hardware.virtual_bench.physics.constants import ServoConstants

COPPER = 0.0039  # [1/K] rise of the resistance of copper


class Motor:
    r"""Shaft of the servo: voltage in, motion out, loaded by the tendon's torque.

    .. math::
        i = (u V - k_t \omega) / R(T), \qquad V = V_0 - R_s u i, \qquad
        J \dot\omega = k_t i - r F - \tau_f

        |\tau_f| \le (\tau_c + \tau_s e^{-(\omega/\omega_s)^2}) + c_m |k_t i| + c_e r F

    The gear's friction has a part in proportion to the forces of motor and tendon on its teeth.
    Friction opposes motion, and at rest takes any value up to the bound. The gear holds a tendon
    at zero duty. Back-EMF and viscous friction are implicit; friction is an impulse that at most
    brings the shaft to rest, so it sticks exactly and never adds power.

    Source: Duclusaud et al. (2025), model M5 without what its load terms have more at rest.
    """

    def __init__(self, constants: ServoConstants) -> None:
        self._constants = constants
        self.angle = 0.0  # [rad]
        self.rate = 0.0  # [rad/s]
        self.current = 0.0  # [A] through the winding
        self.duty = 0.0  # [1]
        self.enabled = False  # off, the bridge is open: no torque and no back-EMF
        self.supply = constants.supply_voltage  # [V] without load
        self.voltage = constants.supply_voltage  # [V] at the servo
        self.temperature = constants.ambient  # [degC]

    def advance(self, tension: float, time_step: float) -> None:
        """Advance by one substep under the tendon's pull [N]."""
        c = self._constants
        kt, omega, duty = c.torque_constant, self.rate, self.duty
        if self.enabled:
            resistance = c.resistance * (1.0 + COPPER * (self.temperature - 25.0))
            gain = kt * kt / resistance
            drive = kt * duty * self.voltage / resistance
        else:
            gain = drive = 0.0
            resistance = 1.0
        pull = c.spool_radius * tension
        inertia = c.inertia + time_step * (gain + c.viscous_friction)
        free = (c.inertia * omega + time_step * (drive - pull)) / inertia
        torque = drive - gain * omega
        slow = omega / c.stribeck_speed
        limit = (
            c.dry_friction
            * (1.0 + (c.stick_excess * exp(-slow * slow) if -4.0 < slow < 4.0 else 0.0))
            + c.motor_load_friction * (torque if torque > 0.0 else -torque)
            + c.tendon_load_friction * pull
        )
        stop = time_step * limit / inertia
        omega = free - stop if free > stop else free + stop if free < -stop else 0.0
        self.rate = omega
        self.angle += time_step * omega
        if self.enabled:
            self.current = current = (drive - gain * omega) / kt
            self.voltage = self.supply - c.supply_resistance * duty * current
        else:
            self.current = 0.0
            self.voltage = self.supply

    def warm(self, duration: float) -> None:
        """Let the winding's loss warm the case for a while [s]."""
        c = self._constants
        heat = c.resistance * self.current * self.current
        target = c.ambient + c.thermal_resistance * heat
        self.temperature += (target - self.temperature) * duration / c.thermal_time

    @property
    def input_current(self) -> float:
        """Current at the servo's power input [A], where this series measures it."""
        return self.duty * self.current
