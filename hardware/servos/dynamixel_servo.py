"""The driver of one servo: set and verified, watched, and switched off whatever happens."""

from __future__ import annotations

from math import isfinite

from hardware.clock import Clock, MonotonicClock
from hardware.errors import (
    CommandNotFinite,
    HardwareFault,
    PortLost,
    PortUnavailable,
    ServoAlert,
    ServoRefused,
    ServoReset,
    ServoSilent,
    SettingMismatch,
    WatchdogTripped,
)
from hardware.servos import registers as r
from hardware.servos.base import (
    ServoConfiguration,
    ServoCounters,
    ServoHealth,
    ServoSettings,
    ServoSpec,
    ServoState,
)
from hardware.servos.bus import Bus
from hardware.servos.servo_port import PortHandler, ServoPort
from hardware.servos.setting_up import (
    alert_text,
    apply,
    arm_watchdog,
    await_restart,
    greet,
    refuse_alert,
    set_verified,
    switch_off,
    verify,
)
from hardware.servos.settings import MARK, read_settings
from hardware.servos.spool_angle import SpoolAngle

POLL_PERIOD = 0.05
"""Pause between attempts while something comes back [s]."""


class DynamixelServo:
    """One servo of the X-330 series on its bus.

    Args:
        spec: Data sheet of the servo.
        port: Path of a serial port, a port handler of the SDK's kind, or a port that several
            servos share.
        identifier: ID on the bus.
        baud: Rate of the bus [1/s].
        clock: Clock that dates the states; the computer's monotonic one unless given.
        retries: Times that an instruction is sent again.
    """

    def __init__(
        self,
        spec: ServoSpec,
        port: str | PortHandler | ServoPort,
        *,
        identifier: int = 1,
        baud: int = 1_000_000,
        clock: Clock | None = None,
        retries: int = 2,
    ) -> None:
        self.spec = spec
        name = port.path if isinstance(port, ServoPort) else port
        self.port = name if isinstance(name, str) else None
        self.identifier = identifier
        self.baud = baud
        self.counters = ServoCounters()
        self.configuration: ServoConfiguration | None = None
        self.duty = 0.0
        """Duty that it was last given [1]."""
        self._clock: Clock = MonotonicClock() if clock is None else clock
        self._bus = Bus(
            port,
            identifier=identifier,
            baud=baud,
            clock=self._clock,
            counters=self.counters,
            retries=retries,
        )
        self._spool = SpoolAngle(spec)
        self._torque = False
        self._restarted = False

    @property
    def torque_enabled(self) -> bool:
        """The motor was switched on here and, as far as is known, still is."""
        return self._torque

    def open(self) -> None:
        """Open the port and make sure that the expected servo answers.

        Raises:
            PortBusy: Another process holds the port.
            PortUnavailable: The port is not there.
            ServoSilent: Nothing answers at this rate and ID.
            UnsupportedServo: Another model does.
        """
        self._bus.open()
        try:
            greet(self._bus, self.spec, self._clock)
        except BaseException:
            self._bus.close()
            raise

    def close(self) -> bool:
        """Switch the motor off and close the port; more than once does no harm.

        Returns:
            Whether the motor is known to be off. If not, the supply must be switched off.
        """
        try:
            return self.switched_off()
        finally:
            self._bus.close()

    def switched_off(self) -> bool:
        """Switch the motor off, if it is not, and tell whether it is known to be off."""
        try:
            if self._torque and self._bus.is_open:
                self.disable_torque()
        except HardwareFault:
            return False
        return not self._torque

    def configure(
        self, *, watchdog_s: float = 0.2, duty_limit: float = 1.0, return_delay: float = 0.0
    ) -> ServoSettings:
        """Set everything that decides how the servo moves, verify it, and take home if unset.

        Args:
            watchdog_s: Silence after which the servo stops [s].
            duty_limit: Greatest duty that the servo may give [1].
            return_delay: Pause of the servo before it answers [s].

        Returns:
            The settings as they read back.
        """
        if self.configuration is not None:
            self._notice(*self._bus.read(r.TORQUE_ENABLE, r.LED))
        self.configuration = ServoConfiguration(
            watchdog=watchdog_s, duty_limit=duty_limit, return_delay=return_delay
        )
        self._set_up(self.configuration)
        if not self._spool.has_home:
            self.set_home()
        return self.settings()

    def settings(self) -> ServoSettings:
        """Read back all that decides the step response, for the log."""
        return read_settings(self._bus, self.spec, self.port)

    def set_home(self, angle: float = 0.0) -> None:
        """Call the present spool angle ``angle`` [rad]; the servo itself keeps no home."""
        (position,) = self._bus.read(r.PRESENT_POSITION)
        self._spool.set_home(position, angle)

    def read_state(self) -> ServoState:
        """Read current, velocity and position in one transaction of ten bytes.

        Raises:
            ServoSilent: No whole answer came in all attempts.
            PortLost: The adapter is gone; ``reconnect`` brings it back.
            SharedIdentifier: Another servo has the same ID.
        """
        self.counters.reads += 1
        self._bus.refuse_second()
        try:
            current, velocity, position = self._bus.read(*r.STATE_BLOCK)
        except HardwareFault:
            self.counters.missed += 1
            raise
        return ServoState(
            time=self._bus.instant,
            position=self._spool.angle(position),
            velocity=velocity * self.spec.velocity_unit,
            current=current * self.spec.current_unit,
        )

    def read_health(self) -> ServoHealth:
        """Read what changes slowly, in two transactions; count restarts and watchdog trips."""
        torque, lamp, error, watchdog = self._bus.read(
            r.TORQUE_ENABLE, r.LED, r.HARDWARE_ERROR, r.BUS_WATCHDOG
        )
        voltage, temperature = self._bus.read(r.PRESENT_VOLTAGE, r.PRESENT_TEMPERATURE)
        self._notice(torque, lamp)
        tripped = watchdog == r.WATCHDOG_TRIPPED
        return ServoHealth(
            voltage=voltage * self.spec.voltage_unit,
            temperature=float(temperature),
            hardware_error=error,
            torque_enabled=bool(torque),
            watchdog_tripped=tripped,
        )

    def check(self) -> ServoHealth:
        """Read the health and refuse to go on where the motor does not do what it is told.

        Raises:
            ServoAlert: The servo reports a hardware error.
            WatchdogTripped: The servo stopped for want of instructions.
            ServoReset: The servo has started anew.
        """
        driven = self._torque
        health = self.read_health()
        if health.alerts:
            raise ServoAlert(alert_text(self.identifier, health.hardware_error))
        if health.watchdog_tripped:
            self.counters.watchdog_trips += 1
            raise WatchdogTripped(self._watchdog_text())
        if self._restarted:
            raise ServoReset(
                f"servo {self.identifier} must keep its settings but has started anew; "
                "look at its supply and plug"
            )
        if driven and not health.torque_enabled:
            raise ServoReset(
                f"servo {self.identifier} must drive its motor; something else has switched it off"
            )
        return health

    def command_duty(self, fraction: float) -> float:
        """Send a duty [1], positive winds in; cut to the limit and returned as sent.

        Raises:
            WatchdogTripped: The servo stopped and takes no goals.
        """
        if not isfinite(fraction):
            raise CommandNotFinite(f"a duty must be finite; it is {fraction}")
        limit = self._configured().duty_limit
        sent = min(max(fraction, -limit), limit)
        self.counters.limited += sent != fraction
        try:
            self._bus.write(r.GOAL_PWM, round(sent * self.spec.duty_counts))
        except ServoRefused:
            (watchdog,) = self._bus.read(r.BUS_WATCHDOG)
            if watchdog != r.WATCHDOG_TRIPPED:
                raise
            self.counters.watchdog_trips += 1
            raise WatchdogTripped(self._watchdog_text()) from None
        self.duty = sent
        return sent

    def enable_torque(self) -> None:
        """Switch the motor on, after settings and alerts were looked at and the watchdog armed.

        The first goal is no duty: nothing moves.

        Raises:
            ServoAlert: The servo reports a hardware error.
            SettingMismatch: A register reads back other than it was set.
        """
        configuration = self._configured()
        refuse_alert(self._bus)
        verify(self._bus, configuration, self.spec)
        set_verified(self._bus, r.GOAL_PWM, 0)
        arm_watchdog(self._bus, configuration)
        self._torque = True  # from here on something must be switched off
        set_verified(self._bus, r.TORQUE_ENABLE, 1)

    def disable_torque(self) -> None:
        """Switch the motor off, under an alert as well, and until it reads back as off.

        Raises:
            ServoSilent: The register never read as off.
            PortLost: The adapter is gone.
        """
        switch_off(self._bus)
        self._torque = False
        self.duty = 0.0

    def clear_watchdog(self) -> None:
        """Make a servo take goals again whose watchdog had stopped it; it stays armed."""
        arm_watchdog(self._bus, self._configured())

    def recover(self, *, resume_torque: bool = False) -> None:
        """Set a servo up again that has started anew, was stopped or could not be reached.

        A servo that has restarted knows its angle within one turn only. The turn is restored from
        the last position that was read. Without the motor the tendon unwinds the spool, so the
        spool may have turned back by up to 5.3 rad, and on by 1 rad.

        Args:
            resume_torque: Switch the motor on again, without duty.

        Raises:
            ServoAlert: The servo reports a hardware error; only ``reboot`` clears it.
        """
        configuration = self._configured()
        self._notice(*self._bus.read(r.TORQUE_ENABLE, r.LED))
        refuse_alert(self._bus)
        self._set_up(configuration)
        if resume_torque:
            self.enable_torque()

    def reboot(self) -> None:
        """Restart the servo, which clears alerts, and set it up again; the motor stays off."""
        self._bus.reboot()
        self._torque = False
        self._restarted = self.configuration is not None
        await_restart(self._bus, self.spec, self._clock)
        if self.configuration is not None:
            self.recover()

    def reconnect(self, *, limit: float = 5.0, resume_torque: bool = False) -> bool:
        """Open a lost port again and set the servo up, waiting up to a limit.

        Args:
            limit: Longest wait [s]; 0 is one attempt.
            resume_torque: Switch the motor on again, without duty.

        Returns:
            Whether the servo is back; where the port stays away it is not.
        """
        deadline = self._clock.now() + limit
        while True:
            self._bus.close()
            try:
                self.open()
                if self.configuration is not None:
                    self.recover(resume_torque=resume_torque)
                self.counters.reconnects += 1
                return True
            except (PortLost, PortUnavailable, ServoSilent):
                if self._clock.now() >= deadline:
                    return False
            self._clock.sleep_until(min(deadline, self._clock.now() + POLL_PERIOD))

    def _set_up(self, configuration: ServoConfiguration) -> None:
        self.disable_torque()
        if self._restarted:
            (position,) = self._bus.read(r.PRESENT_POSITION)
            self._spool.restore_turns(position)
            self._restarted = False
        apply(self._bus, configuration, self.spec)

    def _notice(self, torque: int, lamp: int) -> None:
        """Notice that a servo has restarted, or that an alert has switched its motor off."""
        self._torque = self._torque and bool(torque)
        if self.configuration is not None and lamp != MARK and not self._restarted:
            self._restarted = True
            self.counters.resets += 1

    def _configured(self) -> ServoConfiguration:
        if self.configuration is None:
            raise SettingMismatch(
                f"servo {self.identifier} must be configured before it is driven; it is not"
            )
        return self.configuration

    def _watchdog_text(self) -> str:
        return (
            f"servo {self.identifier} stopped: no instruction came for "
            f"{self._configured().watchdog:g} s; it takes goals again once the watchdog is cleared"
        )
