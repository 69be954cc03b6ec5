"""The driver of one servo: set and verified, watched, and switched off whatever happens."""

from math import isfinite, pi

from tendon_hardware import errors
from tendon_hardware.clock import Clock, MonotonicClock
from tendon_hardware.servos import setting_up
from tendon_hardware.servos.base import (
    ServoCounters,
    ServoHealth,
    ServoSettings,
    ServoSpec,
    ServoState,
    alert_words,
)
from tendon_hardware.servos.bus import Bus
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.servos.family import WATCHDOG_TRIPPED, Targets
from tendon_hardware.servos.serial_bus.keeper import Keeper
from tendon_hardware.servos.serial_bus.servo_port import PortHandler, ServoPort
from tendon_hardware.servos.spool_angle import SpoolAngle
from tendon_newton.errors import InvalidParameter

POLL_PERIOD = 0.05  # Pause between attempts while something comes back [s]
REST_SHARE = 0.4
"""Time without a rest, of that after which a pull is forgotten [1]: four commands at 20 Hz."""
REST = 0.003  # Length of a rest [s]: three periods of the firmware


class BusServo:
    """One servo on its bus, of any family in the table.

    Args:
        port: Path of a serial port, a port handler of the SDK's kind, or a port that several
            servos share.
        baud: Rate of the bus [1/s].
        clock: Clock that dates the states; the computer's monotonic one unless given.
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
        # Silence on the bus after which it stops [s]; None before it is configured
        self.watchdog: float | None = None
        self.duty = 0.0  # Duty that it was last given [1]
        self.duty_limit = 1.0  # Greatest duty that it is given [1]
        self.voltage: float | None = None  # Supply when it was last looked at [V]
        self._clock: Clock = MonotonicClock() if clock is None else clock
        self._bus = Bus(
            port,
            family=FAMILIES[spec.family],
            identifier=identifier,
            baud=baud,
            clock=self._clock,
            counters=self.counters,
            retries=retries,
        )
        self.table = self._bus.table  # Registers of its family
        self._spool = SpoolAngle(spec, counts_turns=self.table.counts_turns)
        self._velocity_unit = spec.velocity_unit
        self._keeper: Keeper | None = None
        self._forgets = FAMILIES[spec.family].forgets
        self._rested = 0.0
        self._seen = 0.0
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
        self._bus.port.open()
        try:
            setting_up.greet(self._bus, self.spec, self._clock)
            scale = FAMILIES[self.spec.family].velocity_scale(self._bus)
            self._velocity_unit = scale * self.spec.velocity_unit
        except BaseException:
            self._bus.port.close()
            raise

    def close(self) -> bool:
        """Switch the motor off and close the port; more than once does no harm.

        Returns:
            Whether the motor is known to be off. If not, the supply must be switched off.
        """
        try:
            return self.switched_off()
        finally:
            self._abandon()
            self._bus.port.close()

    def switched_off(self) -> bool:
        """Switch the motor off, if it is not, and tell whether it is known to be off."""
        try:
            if self._torque and self._bus.port.is_open:
                self.disable_torque()
        except errors.HardwareFault:
            return False
        return not self._torque

    def configure(self, *, watchdog_s: float = 0.2, duty_limit: float = 1.0) -> ServoSettings:
        """Set everything that decides how the servo moves, verify it, and take home if unset.

        Args:
            watchdog_s: Silence after which the servo stops [s]; steps of 20 ms up to 2.54 s.
            duty_limit: Greatest duty that it will be given [1].

        Returns:
            The settings as they read back.
        """
        if not 0.02 <= watchdog_s <= 2.54:
            raise InvalidParameter(
                f"watchdog must be 0.02 to 2.54 s, what the servo can hold; it is {watchdog_s}"
            )
        if self.watchdog is not None:
            self._notice(*self._bus.read(self.table.torque, self.table.mark))
        self.watchdog, self.duty_limit = watchdog_s, duty_limit
        self._set_up()
        if not self._spool.has_home:
            self.set_home()
        return self.settings()

    def settings(self) -> ServoSettings:
        """Read back all that decides the step response, for the log."""
        return FAMILIES[self.spec.family].read_settings(self._bus, self.spec, self.port)

    def set_home(self, angle: float = 0.0) -> None:
        """Call the present spool angle ``angle`` [rad]; the servo itself keeps no home."""
        (position,) = self._bus.read(self.table.position)
        self._spool.set_home(position, angle)
        self._seen = self._bus.instant

    def read_state(self) -> ServoState:
        """Read duty, current, velocity and position in one transaction.

        Raises:
            ServoSilent: No whole answer came in all attempts.
            PortLost: The adapter is gone; ``reconnect`` brings it back.
            SharedIdentifier: Another servo has the same ID.
        """
        self.counters.reads += 1
        self._feed()
        self._bus.refuse_second()
        try:
            duty, current, velocity, position = self._bus.read(*self.table.state)
        except errors.HardwareFault:
            self.counters.missed += 1
            raise
        unseen, self._seen = self._bus.instant - self._seen, self._bus.instant
        # by duty it may be twice as fast as its firmware goes: half a turn, or the first look
        if not self.table.counts_turns and unseen * self.spec.no_load_speed > 0.5 * pi:
            self._spool.restore_turns(position)
        return ServoState(
            time=self._bus.instant,
            position=self._spool.angle(position),
            velocity=velocity * self._velocity_unit,
            current=current * self.spec.current_unit,
            duty=duty / self.spec.duty_counts,
        )

    def read_health(self) -> ServoHealth:
        """Read what changes slowly, in two transactions; count restarts and watchdog trips."""
        table = self.table
        watchdog = () if table.watchdog is None else (table.watchdog,)
        torque, mark, error, *silence = self._bus.read(
            table.torque, table.mark, table.alerts, *watchdog
        )
        voltage, temperature = self._bus.read(table.voltage, table.temperature)
        self._notice(torque, mark)
        self.voltage = voltage * self.spec.voltage_unit
        tripped = WATCHDOG_TRIPPED in silence or self._unwatched
        return ServoHealth(
            voltage=self.voltage,
            temperature=float(temperature),
            hardware_error=error,
            torque_enabled=bool(torque),
            watchdog_tripped=tripped,
            alerts=alert_words(error, FAMILIES[self.spec.family].alerts),
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
        if health.watchdog_tripped:
            raise self._tripped()
        if health.alerts:
            raise errors.ServoAlert(
                setting_up.alert_text(self._bus, self.spec, health.hardware_error)
            )
        if self._restarted:
            raise errors.ServoReset(
                f"servo {self.identifier} must keep its settings but has started anew; "
                "look at its supply and plug"
            )
        if driven and not health.torque_enabled:
            raise errors.ServoReset(
                f"servo {self.identifier} must drive its motor; something else has switched it off"
            )
        return health

    def command_duty(self, fraction: float) -> float:
        """Send a duty [1], positive winds in; cut to the greatest and returned as sent.

        Raises:
            WatchdogTripped: The servo stopped and takes no goals.
        """
        if not isfinite(fraction):
            raise errors.CommandNotFinite(f"a duty must be finite; it is {fraction}")
        self._configured()
        self._feed()
        if self._unwatched:
            raise self._tripped()
        sent = min(max(fraction, -self.duty_limit), self.duty_limit)
        self.counters.limited += sent != fraction
        goal = round(sent * self.spec.duty_counts)
        try:
            self._rest(goal)
            self._bus.write(self.table.goal_duty, goal)
        except errors.ServoRefused:
            register = self.table.watchdog
            if register is None or self._bus.read(register) != (WATCHDOG_TRIPPED,):
                raise
            raise self._tripped() from None
        self.duty = sent
        return sent

    def enable_torque(self) -> None:
        """Switch the motor on, after settings and alerts were looked at and the watchdog armed.

        The first goal is no duty: nothing moves. A watchdog that had tripped is cleared. A servo
        that has none is kept by a process of its own, see `Keeper`.

        Raises:
            ServoAlert: The servo reports a hardware error.
            SettingMismatch: A register reads back other than it was set.
        """
        watchdog = self._configured()
        setting_up.refuse_alert(self._bus, self.spec)
        setting_up.verify(self._bus, self._targets())
        setting_up.arm_watchdog(self._bus, watchdog)  # one that has tripped takes no goals
        setting_up.set_verified(self._bus, self.table.goal_duty, 0)
        self._release()
        self._keeper = self._bus.keeper(watchdog)
        self._rested = self._clock.now()
        self._torque = True  # from here on something must be switched off
        setting_up.set_verified(self._bus, self.table.torque, 1)

    def disable_torque(self) -> None:
        """Switch the motor off, under an alert as well, and until it reads back as off.

        Raises:
            ServoSilent: The register never read as off.
            MotorStillDriven: It does, and duty or current tell otherwise.
            PortLost: The adapter is gone.
        """
        setting_up.switch_off(self._bus)
        setting_up.refuse_driven(self._bus, self.spec, self._clock)
        self._release()
        self._torque = False
        self.duty = 0.0

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
        self._configured()
        self._notice(*self._bus.read(self.table.torque, self.table.mark))
        self._set_up()  # without its motor, a Feetech servo's overload is over
        setting_up.refuse_alert(self._bus, self.spec)
        if resume_torque:
            self.enable_torque()

    def reboot(self) -> None:
        """Restart the servo, which clears alerts, and set it up again; the motor stays off."""
        self._bus.reboot()
        self._torque = False
        self._restarted = self.watchdog is not None
        setting_up.await_restart(self._bus, self.spec, self._clock)
        if self.watchdog is not None:
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
        self._abandon()
        while True:
            self._bus.port.close()
            try:
                if self._keeper is not None and not self._keeper.ended:
                    raise errors.PortLost(
                        f"{self._bus.port.name}: the motor is not yet known to be off"
                    )
                self.open()
                if self.watchdog is not None:
                    self.recover(resume_torque=resume_torque)
                self.counters.reconnects += 1
                return True
            except (errors.PortLost, errors.PortUnavailable, errors.ServoSilent):
                if self._clock.now() >= deadline:
                    return False
            self._clock.sleep_until(min(deadline, self._clock.now() + POLL_PERIOD))

    @property
    def _unwatched(self) -> bool:
        """Whether what watches over the motor has acted, or does not watch."""
        return self._keeper is not None and self._keeper.fault is not None

    def _feed(self) -> None:
        if self._keeper is not None:
            self._keeper.feed()

    def _release(self) -> None:
        if self._keeper is not None:
            self._keeper.release()
            self._keeper = None

    def _abandon(self) -> None:
        if self._keeper is not None:  # the motor is not known to be off
            self._keeper.abandon()

    def _rest(self, goal: int) -> None:
        """Let a pull rest for a moment, before a servo without a watchdog forgets it."""
        forgets, now = self._forgets, self._clock.now()
        if forgets is not None and abs(goal) >= round(forgets.duty * self.spec.duty_counts):
            if now - self._rested < REST_SHARE * forgets.time:
                return
            self._bus.write(self.table.goal_duty, 0)
            self._clock.sleep_until(now + REST)
        self._rested = now

    def _targets(self) -> Targets:
        return FAMILIES[self.spec.family].targets(self.spec, self.duty_limit)

    def _set_up(self) -> None:
        self.disable_torque()
        if self._restarted:
            (position,) = self._bus.read(self.table.position)
            self._spool.restore_turns(position)
            self._restarted = False
        setting_up.apply(self._bus, self._targets())

    def _notice(self, torque: int, mark: int) -> None:
        """Notice that a servo has restarted, or that an alert has switched its motor off."""
        self._torque = self._torque and bool(torque)
        if self.watchdog is not None and mark != self.table.marked and not self._restarted:
            self._restarted = True
            self.counters.resets += 1

    def _configured(self) -> float:
        """Return the watchdog's silence [s]; a servo that nobody has configured is refused."""
        if self.watchdog is None:
            raise errors.SettingMismatch(
                f"servo {self.identifier} must be configured before it is driven; it is not"
            )
        return self.watchdog

    def _tripped(self) -> errors.WatchdogTripped:
        self.counters.watchdog_trips += 1
        noted = None if self._keeper is None else self._keeper.fault
        reason = noted or f"no instruction came for {self._configured():g} s"
        return errors.WatchdogTripped(
            f"servo {self.identifier} stopped: {reason}; its motor stays off until it is switched "
            "on again"
        )
