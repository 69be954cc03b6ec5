"""The loop of a deployment: read at 80 Hz, decide at 20 Hz, guard every tick.

In a tick the servo is read first, then the rules are applied to what is known, then, where a step
is due, the command goes out. Ticks have absolute deadlines; one that is over before it could run is
skipped and counted.
"""

from __future__ import annotations

from collections import deque

from hardware.bench import Bench
from hardware.deploy_log import DeployLog
from hardware.deploy_progress import DeployProgress
from hardware.deploy_settings import DeploySettings
from hardware.errors import (
    HardwareFault,
    LogNotWritten,
    PortLost,
    ServoAlert,
    ServoRefused,
    ServoReset,
    ServoSilent,
    WatchdogTripped,
)
from hardware.force_estimate import ForceEstimate
from hardware.force_watch import ForceWatch
from hardware.goals import Goals
from hardware.keyboard import KILL_KEYS, STOP_KEYS, Keyboard
from hardware.operator import Operator
from hardware.pacing import Ticker
from hardware.pilot import Pilot, PilotStep
from hardware.run_loop import LOOK_PERIOD, TIP_PERIOD
from hardware.safety import Glance, SafetyGuard, Trip
from hardware.servos.base import ServoHealth, ServoState
from hardware.stop_request import StopRequest

SKIP_WINDOW = 8
"""Ticks among which skipped ones are counted."""
SHOW_PERIOD = 0.1
"""Time between two looks of the operator at the figures [s]."""
TELL_PERIOD = 2.0
"""Time before the operator is told of the same rule again [s]."""
COMPLETE = "it has its full length"
UNWIND_DUTY = -0.15
"""Duty that lets the tendon out in mode ``pwm`` [1]: 1 rad/s at most."""
UNWIND_SPEED = 1.0
"""Speed at which it is let out in mode ``position`` [rad/s]."""
UNWIND_MARGIN = 0.05
"""Distance from home that counts as home [rad]."""
UNWIND_SLOWEST = 0.3
"""Mean speed below which unwinding is given up and the motor switched off [rad/s]."""


class DeployLoop:
    """Lets a pilot drive the servo as long as the rules allow.

    Args:
        bench: An open bench whose servo is configured, and on unless the run is dry.
        pilot: Who decides.
        settings: Rates, mode and limits.
        goals: Where the goal comes from.
        keyboard: The operator's keys.
        operator: Who is told and shown.
        stop: Who may end the run by a signal.
        estimate: Gives the tension where no load cell does.
    """

    def __init__(
        self, bench: Bench, pilot: Pilot, settings: DeploySettings, goals: Goals,
        keyboard: Keyboard, operator: Operator, stop: StopRequest,
        estimate: ForceEstimate | None = None,
    ) -> None:  # fmt: skip
        self.bench = bench
        self.servo = bench.servo
        self.clock = bench.clock
        self.pilot = pilot
        self.settings = settings
        self.goals = goals
        self.keyboard = keyboard
        self.operator = operator
        self.stop = stop
        self.estimate = estimate
        self.guard = SafetyGuard(settings.limits)
        self.forces = ForceWatch(bench, None, operator)
        self.ticker = Ticker(self.clock, settings.rate)
        self.rows = self.missed = self.steps = 0
        """Readings of the servo, ticks without one, and steps of the pilot."""
        self.acted: deque[tuple[Trip, float]] = deque(maxlen=100)
        """The latest trips, and when what they ask for had been done [s]."""
        self.first_command: float | None = None
        """Instant of the first command [s]."""
        self.ending: Trip | None = None
        """What ended the run; nothing if it had its full length."""
        self.over = False
        self.goal = 0.0
        self._log: DeployLog | None = None
        self._state: ServoState | None = None
        self._health: ServoHealth | None = None
        self._estimated: float | None = None
        self._stopped: str | None = None
        self._stop: str | None = None
        self._kill: str | None = None
        self._failure: str | None = None
        self._heard = self.clock.now()
        self._alerts = self.servo.counters.alerts
        self._ran: deque[int] = deque()
        self._sent = -1
        self._command = 0.0
        self._policy_time = 0.0
        self._unwinding: tuple[float, float] | None = None
        self._next_show = self._next_log = self._next_tip = 0.0
        self._told: dict[str, float] = {}

    @property
    def complete(self) -> bool:
        """Whether nothing but its length or its operator ended the run."""
        return self.ending is None or self.ending.rule.name in ("operator", "kill")

    def run(self, log: DeployLog | None) -> None:
        """Drive until the run is over; the motor may still be on where a signal interrupts."""
        self._log = log
        duration = self.settings.duration
        count = None if duration is None else round(duration * self.settings.rate)
        self.ticker.restart()
        self._heard = self.ticker.start
        while not self.over:
            tick = self.ticker.wait()
            begin = self.clock.now()
            self._ran.append(tick)
            while self._ran[0] <= tick - SKIP_WINDOW:
                self._ran.popleft()
            if count is not None and tick >= count and self._stop is None:
                self._stop = COMPLETE
            try:
                self._tick(tick)
                self._note(tick, begin)
            except LogNotWritten as error:
                self._failure, self._log = str(error), None
            self._show(begin)

    def _tick(self, tick: int) -> None:
        log = self._log
        self.forces.take(log.session_log if log else None)
        rows = self.rows
        self._read()
        self.missed += self.rows == rows
        if (tick + self.settings.divider // 2) % self.settings.divider == 0 or (
            self.servo.counters.alerts > self._alerts
        ):
            self._look()
        self._listen()
        due = tick // self.settings.divider != self._sent
        step = self._decide() if due and self._state is not None else None
        trips = self.guard.judge(self._glance(step))
        self._act(step, due=due, begun=bool(trips))
        if due:
            self._sent = tick // self.settings.divider
        for trip in trips:
            self._announce(trip)
        self._see_tip()

    def _read(self) -> None:
        """Read the servo, where it can be reached."""
        try:
            self._state = state = self.servo.read_state()
        except (ServoSilent, PortLost, ServoRefused):
            return
        self._heard = state.time
        self.rows += 1
        if self._log is not None:
            self._log.session_log.state(state)

    def _look(self) -> None:
        """Look at what changes slowly, and whether the motor still does what it is told."""
        self._alerts = self.servo.counters.alerts
        try:
            self._health = health = self.servo.check()
        except (ServoAlert, ServoReset, WatchdogTripped) as error:
            self._stopped = str(error)
            return
        except (ServoSilent, PortLost, ServoRefused):
            return
        now = self.clock.now()
        if self._log is not None and now >= self._next_log:
            self._next_log = now + LOOK_PERIOD
            counters = self.servo.counters
            self._log.session_log.health(
                now, health,
                {"missed": self.missed, "retries": counters.retries,
                 "corrupted": counters.corrupted, "skipped_ticks": self.ticker.overruns},
            )  # fmt: skip

    def _listen(self) -> None:
        """Take signals, keys and goals."""
        if self.stop.signal is not None and self._stop is None:
            self._stop = f"stopped by {self.stop.signal}"
        for key in self.keyboard.pressed():
            if key in STOP_KEYS:
                self._stop = self._stop or f"stopped by {STOP_KEYS[key]}"
            elif key in KILL_KEYS:
                self._kill = f"switched off by {KILL_KEYS[key]}"
            else:
                self.goals.key(key)
        while self.goals.notes:
            self.operator.tell(self.goals.notes.pop(0))

    def _decide(self) -> PilotStep:
        """Let the pilot look and decide."""
        state = self._state
        assert state is not None
        begin = self.clock.now()
        self.goal = self.goals.value(begin - self.ticker.start)
        step = self.pilot.step(state, self.goal)
        if self.estimate is not None:
            command = self._command if self.first_command is not None else state.position
            self._estimated = self.estimate(command, state.position, state.velocity)
        self._policy_time = self.clock.now() - begin
        self.steps += 1
        return step

    def _glance(self, step: PilotStep | None) -> Glance:
        """Gather what is known now."""
        state, health, now = self._state, self._health, self.clock.now()
        jump = 0.0
        if step is not None and state is not None:
            before = self._command if self.first_command is not None else state.position
            jump = (step.command - before) * self.settings.policy_rate
        return Glance(
            now=now,
            position=None if state is None else state.position,
            silence=max(now - self._heard, 0.0),
            force=self._estimated if self.forces.force is None else self.forces.force,
            blindness=self.forces.silence,
            current=None if state is None else state.current,
            voltage=None if health is None else health.voltage,
            temperature=None if health is None else health.temperature,
            stopped=self._stopped,
            skipped=min(self._ran[-1] + 1, SKIP_WINDOW) - len(self._ran),
            output=None if step is None else step.output,
            jump=jump,
            stop=self._stop,
            kill=self._kill,
            failure=self._failure,
        )

    def _act(self, step: PilotStep | None, *, due: bool, begun: bool) -> None:
        """Do what the guard's mode asks for."""
        if self.guard.mode == "off" or (self.guard.mode == "unwind" and self.settings.dry):
            self.over = True
            self.switch_off()
        elif self.guard.mode == "unwind":
            if due or begun:
                self._unwind()
        elif due and step is not None:
            held = self.guard.mode == "hold"
            self.pilot.apply(None if held else step)
            command = self._command if held and self.first_command is not None else step.command
            self._send(self._within(command, step))
            if self._log is not None:
                self._log.step(self.clock.now(), step, self._command, held=held)

    def _within(self, command: float, step: PilotStep) -> float:
        """Return a command within the range and no further from the last one than allowed."""
        before = self._command if self.first_command is not None else step.sample[0]
        reach = self.settings.limits.command_rate / self.settings.policy_rate
        low, high = self.settings.loop.position_range
        return min(max(min(max(command, before - reach), before + reach), low), high)

    def _send(self, command: float, duty: float | None = None) -> None:
        """Give a command [rad], or in its place a duty [1], unless the run is dry."""
        instant = self.clock.now()
        self._command = command
        if self.first_command is None:
            self.first_command = instant
        if self.settings.dry:
            return
        assert self._state is not None
        log = self._log.session_log if self._log is not None else None
        try:
            if self.settings.mode == "pwm":
                if duty is None:
                    duty = self.settings.loop.duty(command, self._state.position)
                sent = self.servo.command_duty(duty)
                if log is not None:
                    log.duty(instant, sent)
            else:
                self.servo.command_position(command)
        except (ServoSilent, PortLost):
            return  # its silence is a rule's business
        except (WatchdogTripped, ServoRefused) as error:
            self._stopped = str(error)
            return
        if log is not None:
            log.command(instant, command)

    def _unwind(self) -> None:
        """Let the tendon out slowly; at home, or where that does not work, the run is over."""
        now, home = self.clock.now(), self.settings.loop.position_range[0]
        position = home if self._state is None else self._state.position
        if self._unwinding is None:
            self._unwinding = (now, position)
        begin, start = self._unwinding
        patience = 1.0 + max(start - home, 0.0) / UNWIND_SLOWEST
        if position <= home + UNWIND_MARGIN or now - begin > patience or not self.settings.unwind:
            self.over = True
            self.switch_off()
        elif self.settings.mode == "pwm":
            loop = self.settings.loop
            self._send(position + (UNWIND_DUTY - loop.offset) / loop.gain, UNWIND_DUTY)
        else:
            self._send(max(start - UNWIND_SPEED * (now - begin), home))

    def switch_off(self) -> None:
        """Switch the motor off, as far as it can be reached; more than once does no harm."""
        if not self.servo.torque_enabled:
            return
        try:
            self.servo.disable_torque()
        except HardwareFault as error:
            self.operator.tell(f"THE MOTOR MAY STILL RUN, SWITCH ITS SUPPLY OFF: {error}")

    def _announce(self, trip: Trip) -> None:
        """Note, log and tell that a rule came into effect, after it was acted upon."""
        now = self.clock.now()
        self.acted.append((trip, now))
        if trip.action in ("unwind", "off") and self.ending is None and (
            trip.reason != COMPLETE
        ):  # fmt: skip
            self.ending = trip
        if now >= self._told.get(trip.rule.name, -1.0):
            self._told[trip.rule.name] = now + TELL_PERIOD
            self.operator.tell(f"{trip.action.upper()}: {trip.reason}")
        if self._log is not None:
            self._log.trip(trip)

    def _see_tip(self) -> None:
        """Log the tip where something sees it; in real time asking takes long, so not always."""
        now = self.clock.now()
        if self.bench.controls is None or self._log is None or now < self._next_tip:
            return
        self._next_tip = now if self.bench.lockstep else now + TIP_PERIOD
        tip = self.bench.tip()
        if tip is not None:
            self._log.session_log.tip(self.clock.now(), *tip)

    def _note(self, tick: int, begin: float) -> None:
        """Log how long a tick took; a log that is not written beside the loop is handed on."""
        if self._log is None:
            return
        lateness = begin - self.ticker.start - tick / self.settings.rate
        now = self.clock.now()
        self._log.timing(now, tick, lateness, now - begin, self._policy_time)
        if self.bench.lockstep and tick % round(LOOK_PERIOD * self.settings.rate) == 0:
            self._log.session_log.sink.flush(sync=False)

    def _show(self, now: float) -> None:
        if now < self._next_show:
            return
        self._next_show = now + SHOW_PERIOD
        force = self.forces.force
        elapsed = now - self.ticker.start
        self.operator.show(
            DeployProgress(
                name="deploy",
                elapsed=elapsed,
                duration=self.settings.duration or 0.0,
                rate=self.rows / max(elapsed, 1.0 / self.settings.rate),
                missed=self.missed,
                force=self._estimated if force is None else force,
                temperature=None if self._health is None else self._health.temperature,
                mode=self.guard.mode,
                goal=self.goal,
                position=0.0 if self._state is None else self._state.position,
                command=self._command,
                estimated=force is None,
                late=self.ticker.percentile(0.99),
                skipped=self.ticker.overruns,
                policy=self._policy_time,
            )
        )
