"""The loop of one run: command, read, log, at a steady rate, through what can be mended.

Every tick the command goes out first and the servo is read then, so that a row's measurements
follow its command. What is missed is not made up: its row is absent and ``/servo/diagnostics`` says
so.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import ceil

import numpy as np

from tendon_hardware.benches.bench import Bench
from tendon_hardware.clock import Clock
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.control.operator import Operator, OperatorProgress
from tendon_hardware.errors import PortLost, SafetyStop, ServoReset, ServoSilent
from tendon_hardware.logs.session_log import SessionLog
from tendon_hardware.pacing import Ticker
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.force_watch import ForceWatch
from tendon_hardware.safety_rules.motion_watch import MotionWatch
from tendon_hardware.safety_rules.rules import Glance, broken_rule, stop_beyond
from tendon_hardware.safety_rules.tip_watch import TipWatch
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.recording import Array

WORTH_TELLING = 0.5  # Gap that the operator is told of [s]
COASTED, AROUND = 0.3, 0.05
"""Angle beyond its window to which a spool may coast while its motor is off, and angle by which it
may still go on from there [rad]."""
STALE = 0.25  # Age of the last reading beyond which a loop on the host must not act on it [s]


class GapWatch:
    """Knows when the servo was last heard of."""

    def __init__(self, clock: Clock, limits: SafetyLimits, operator: Operator) -> None:
        self.clock = clock
        self.limits = limits
        self.operator = operator
        self.start = clock.now()  # Instant from which gaps are counted [s]
        # First and last instant of each gap, since the start [s]
        self.gaps: list[tuple[float, float]] = []
        self._heard = clock.now()
        self._gap: float | None = None

    @property
    def stale(self) -> bool:
        """Whether the last reading is too old to act on."""
        return self.clock.now() - self._heard > STALE

    def begin(self) -> None:
        """Note that a reading is missing."""
        if self._gap is None:
            self._gap = self._heard

    def miss(self) -> None:
        """Note that a reading is missing, and give up after too many.

        Raises:
            SafetyStop: The servo has been silent for too long.
        """
        self.begin()
        silence = self.clock.now() - self._heard
        if silence > self.limits.silence:
            raise SafetyStop(
                f"the servo must answer; it has been silent for {silence:.1f} s: see that its "
                "motor is off"
            )

    def end(self) -> None:
        """Count a gap that lasts to the end of a run."""
        if self._gap is not None:
            self.gaps.append((self._gap - self.start, self.clock.now() - self.start))

    def hear(self, instant: float, log: SessionLog | None) -> None:
        """Note a reading, and mark the gap that it ends."""
        begin, self._gap, self._heard = self._gap, None, instant
        if begin is None or log is None:
            return
        first, last = begin - self.start, instant - self.start
        self.gaps.append((first, last))
        text = f"no rows between {first:.3f} and {last:.3f} s"
        if last - first > WORTH_TELLING:
            self.operator.tell(f"The servo is back after {last - first:.1f} s: {text}.")
        log.event(
            instant, "servo", "warn", text, start=f"{first:.3f}", seconds=f"{last - first:.3f}"
        )


LOOK_PERIOD = 0.5  # Time between two looks at voltage, temperature and alerts [s]
RETURN_PERIOD = 0.25  # Time between two attempts to reach a servo whose port is gone [s]
FLUSH_PERIOD = 0.5  # Time between two writings of a log that no thread writes [s]
APPROACH_SPEED = 3.0  # At which the first command is approached [rad/s]


class RunLoop:
    """Drives the servo through one run."""

    def __init__(
        self, bench: Bench, settings: CollectSettings, operator: Operator, stop: StopRequest
    ) -> None:
        self.bench = bench
        self.servo = bench.servo
        self.clock = bench.clock
        self.settings = settings
        self.operator = operator
        self.stop = stop
        self.limits = settings.limits
        self.forces = ForceWatch(bench, settings.limits, operator, settings.spool_radius)
        self.motion = MotionWatch(bench.drives[0], settings.spool_radius, settings.limits.force)
        self.tip = TipWatch(bench)
        self.ticker = Ticker(self.clock, settings.rate)
        self.rows = 0  # Readings of the servo in the log
        self.missed = 0  # Ticks of the run whose reading never came
        self.gaps = GapWatch(self.clock, settings.limits, operator)
        self._log: SessionLog | None = None
        self._position = 0.0
        self._temperature: float | None = None
        self._away_since: float | None = None
        self._mend: Callable[[], None] | None = None
        self._next_return = 0.0
        self._sent = -1
        self._alerts = self.servo.counters.alerts
        self._next_look = 0.0

    def approach(self, angle: float) -> None:
        """Switch the motor on, go to an angle [rad] without haste and rest there.

        A spool that coasted to the edge of its window while its motor was off, or a little beyond,
        may come to rest and come back.
        """
        settings = self.settings
        self.servo.enable_torque()
        self._position = start = self.servo.read_state().position
        way = abs(angle - start) / APPROACH_SPEED
        count = ceil((way + settings.settle) * settings.rate)
        progress = np.arange(count) / (settings.rate * way) if way > 0.0 else np.ones(count)
        low, high = settings.limits.position
        if low - COASTED <= start <= low + AROUND:
            self.limits = replace(settings.limits, position=(min(low, start - AROUND), high))
        self._run(start + np.minimum(progress, 1.0) * (angle - start), "")
        self.limits = settings.limits

    def record(self, run: PlannedRun, command: Array, log: SessionLog) -> None:
        """Give the commands [rad], one per tick, shape (T,), and log what follows."""
        self._log = log
        self.ticker = Ticker(self.clock, self.settings.rate)
        try:
            self._run(command, run.name)
            self.forces.take(log)
        finally:
            self.gaps.end()

    def _run(self, command: Array, name: str) -> None:
        rate, count = self.settings.rate, len(command)
        self.ticker.restart()
        self.gaps.start = self.ticker.start
        self._sent, previous = -1, -1
        flush, show = max(1, round(FLUSH_PERIOD * rate)), self.clock.now() + LOOK_PERIOD
        while (tick := self.ticker.wait()) < count:
            if self.stop.signal is not None:
                return
            self._skip(tick - previous - 1)
            previous = tick
            rows = self.rows
            self._step(tick, float(command[tick]))
            self.missed += self._log is not None and self.rows == rows
            if name and self.clock.now() >= show:
                show = self.clock.now() + LOOK_PERIOD
                self._show(name, tick, count)
            if self.bench.lockstep and self._log is not None and tick % flush == 0:
                self._log.sink.flush(sync=False)
        self._skip(count - previous - 1)

    def _step(self, tick: int, angle: float) -> None:
        """Do what a tick asks for, as far as the servo can be reached."""
        self.forces.take(self._log)
        if self._away_since is not None and not self._return():
            self.gaps.miss()
            return
        try:
            if self._mend is not None:
                self._mend()
                self._mend = None
            if tick // self.settings.divider != self._sent:
                self._send(angle)
                self._sent = tick // self.settings.divider
            glance = self._read()
            alerted = self.servo.counters.alerts > self._alerts
            odd = alerted or broken_rule(self.limits, glance) is not None
            if odd or self.clock.now() >= self._next_look:  # an alert or a restart explains it
                self._alerts = self.servo.counters.alerts
                self._look()
            stop_beyond(self.limits, glance)
        except ServoSilent as error:
            self.gaps.miss()
            self._event("warn", str(error))
        except PortLost as error:
            self._away_since = self.clock.now()
            self._next_return = 0.0
            self.gaps.miss()
            self._tell("error", f"{error}; waiting for it")
        except ServoReset as error:
            self.gaps.miss()
            self._tell("error", f"{error}; it is set up again")
            self._mend = partial(self.servo.recover, resume_torque=True)
            self.motion.forget()
        self.tip.take(self._log)

    def _send(self, angle: float) -> None:
        """Send a command; a loop that does not know where the spool is lets go of it."""
        instant = self.clock.now()
        wanted = 0.0 if self.gaps.stale else self.settings.loop.duty(angle, self._position)
        duty = self.servo.command_duty(wanted)
        if self._log is not None:
            self._log.duty(instant, duty)
            self._log.command(instant, angle)

    def _read(self) -> Glance:
        state = self.servo.read_state()
        self._position = state.position
        self.forces.move(state)
        self.motion.take(state, self.forces.force)
        self.gaps.hear(state.time, self._log)
        if self._log is not None:
            self._log.state(state)
            self.rows += 1
        return Glance(
            now=state.time,
            position=state.position,
            strayed=self.motion.strayed,
            disobeyed=self.motion.disobeyed,
            stuck=self.motion.stuck,
            pull=self.forces.pull,
        )

    def _look(self) -> None:
        """Look at what changes slowly; an alert ends the run."""
        self._next_look = self.clock.now() + LOOK_PERIOD
        health = self.servo.check()
        self._temperature = health.temperature
        if self._log is not None:
            self._log.health(
                self.clock.now(),
                health,
                self.servo.counters,
                missed=self.missed,
                skipped=self.ticker.overruns,
            )
        known = Glance(now=self.clock.now(), temperature=health.temperature)
        stop_beyond(self.settings.limits, known)

    def _return(self) -> bool:
        """Try to reach a servo whose port is gone."""
        now = self.clock.now()
        if now < self._next_return:
            return False
        self._next_return = now + RETURN_PERIOD
        if not self.servo.reconnect(limit=0.0, resume_torque=True):
            return False
        self._away_since = None
        self._sent = -1
        return True

    def _skip(self, ticks: int) -> None:
        """Count ticks that were over before they could run."""
        if ticks > 0:
            self.missed += ticks * (self._log is not None)
            self.gaps.begin()

    def _event(self, level: str, text: str) -> None:
        if self._log is not None:
            self._log.event(self.clock.now(), "servo", level, text)

    def _tell(self, level: str, text: str) -> None:
        self._event(level, text)
        self.operator.tell(text)

    def _show(self, name: str, tick: int, count: int) -> None:
        elapsed = max(self.clock.now() - self.gaps.start, 1e-3)
        self.operator.show(
            OperatorProgress(
                name=name,
                elapsed=tick / self.settings.rate,
                duration=count / self.settings.rate,
                rate=self.rows / elapsed,
                missed=self.missed,
                force=self.forces.force,
                temperature=self._temperature,
            )
        )
