"""The loop of a deployment: read at 80 Hz, decide at 20 Hz, guard every tick.

In a tick everything is read first, then the rules are applied to what is known, then, where a step
is due, the command goes out. Ticks have absolute deadlines; one that is over before it could run is
skipped and counted.
"""

from __future__ import annotations

from collections import deque

from hardware.bench import Bench
from hardware.deploy_log import DeployLog
from hardware.deploy_progress import DeployProgress
from hardware.deploy_senses import DeploySenses
from hardware.deploy_settings import DeploySettings
from hardware.errors import (
    HardwareFault,
    LogNotWritten,
    PortLost,
    ServoRefused,
    ServoSilent,
    WatchdogTripped,
)
from hardware.force_estimate import ForceEstimate
from hardware.goals import Goals
from hardware.keyboard import Keyboard
from hardware.operator import Operator
from hardware.pacing import Ticker
from hardware.pilot import Pilot, PilotStep
from hardware.run_loop import FLUSH_PERIOD
from hardware.safety import SafetyGuard, Trip
from hardware.stop_request import StopRequest
from hardware.tip_watch import TipWatch

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
        self.operator = operator
        self.estimate = estimate
        self.guard = SafetyGuard(settings.limits)
        self.ticker = Ticker(self.clock, settings.rate)
        self.senses = DeploySenses(bench, settings, goals, keyboard, operator, stop, self.ticker)
        self.tip = TipWatch(bench)
        self.steps = 0
        """Steps of the pilot."""
        self.acted: deque[tuple[Trip, float]] = deque(maxlen=100)
        """The latest trips, and when what they ask for had been done [s]."""
        self.first_command: float | None = None
        """Instant of the first command [s]."""
        self.ending: Trip | None = None
        """What ended the run; nothing if it had its full length."""
        self._over = False
        self._log: DeployLog | None = None
        self._goal = self._command = self._jump = self._policy_time = 0.0
        self._output: float | None = None
        self._sent = -1
        self._unwinding: tuple[float, float] | None = None
        self._next_show = 0.0
        self._told: dict[str, float] = {}

    @property
    def complete(self) -> bool:
        """Whether nothing but its length or its operator ended the run."""
        return self.ending is None or self.ending.rule.name in ("operator", "kill")

    def run(self, log: DeployLog | None) -> None:
        """Drive until the run is over; the motor may still be on where a signal interrupts."""
        self._log = log
        duration, senses = self.settings.duration, self.senses
        count = None if duration is None else round(duration * self.settings.rate)
        self.ticker.restart()
        senses.heard = self.ticker.start
        while not self._over:
            tick = self.ticker.wait()
            begin = self.clock.now()
            if count is not None and tick >= count and senses.stop_reason is None:
                senses.stop_reason = COMPLETE
            try:
                self._tick(tick)
                self._note(tick, begin)
            except LogNotWritten as error:
                senses.failure, self._log = str(error), None
            self._show(begin)

    def _tick(self, tick: int) -> None:
        senses = self.senses
        senses.take(tick, self._log)
        due = tick // self.settings.divider != self._sent
        step = self._decide() if due and senses.state is not None else None
        trips = self.guard.judge(senses.glance(self._output, self._jump))
        self._act(step, due=due, begun=bool(trips))
        if due:
            self._sent = tick // self.settings.divider
        for trip in trips:
            self._announce(trip)
        self.tip.take(None if self._log is None else self._log.session_log)

    def _decide(self) -> PilotStep:
        """Let the pilot look and decide; what it wants holds until the next step."""
        state = self.senses.state
        assert state is not None
        begin = self.clock.now()
        step = self.pilot.step(state, self.goals.value(begin - self.ticker.start))
        before = self._before(step)
        if self.estimate is not None:
            self.senses.estimated = self.estimate(before, state.position, state.velocity)
        self._goal, self._output = step.sample[-1], step.output
        self._jump = (step.command - before) * self.settings.policy_rate
        self._policy_time = self.clock.now() - begin
        self.steps += 1
        return step

    def _before(self, step: PilotStep) -> float:
        """Return the last command [rad]; before there is one, where the spool stands."""
        return step.sample[0] if self.first_command is None else self._command

    def _act(self, step: PilotStep | None, *, due: bool, begun: bool) -> None:
        """Do what the guard's mode asks for."""
        if self.guard.mode == "off" or (self.guard.mode == "unwind" and self.settings.dry):
            self._end()
        elif self.guard.mode == "unwind":
            if due or begun:
                self._unwind()
        elif due and step is not None:
            held = self.guard.mode == "hold"
            self.pilot.apply(None if held else step)
            self._send(self._before(step) if held else self._within(step))
            if self._log is not None:
                self._log.step(self.clock.now(), step, self._command, held=held)

    def _within(self, step: PilotStep) -> float:
        """Return a step's command within the range and no further from the last than allowed."""
        before = self._before(step)
        reach = self.settings.limits.command_rate / self.settings.policy_rate
        low, high = self.settings.loop.position_range
        return min(max(min(max(step.command, before - reach), before + reach), low), high)

    def _send(self, command: float, duty: float | None = None) -> None:
        """Give a command [rad], or in its place a duty [1], unless the run is dry."""
        instant, state = self.clock.now(), self.senses.state
        self._command = command
        if self.first_command is None:
            self.first_command = instant
        if self.settings.dry or state is None:
            return
        log = self._log.session_log if self._log is not None else None
        try:
            if self.settings.mode == "pwm":
                wanted = self.settings.loop.duty(command, state.position) if duty is None else duty
                sent = self.servo.command_duty(wanted)
                if log is not None:
                    log.duty(instant, sent)
            else:
                self.servo.command_position(command)
        except (ServoSilent, PortLost):
            return  # its silence is a rule's business
        except (WatchdogTripped, ServoRefused) as error:
            self.senses.stopped = str(error)
            return
        if log is not None:
            log.command(instant, command)

    def _unwind(self) -> None:
        """Let the tendon out slowly; at home, or where that does not work, the run is over."""
        loop, state, now = self.settings.loop, self.senses.state, self.clock.now()
        home = loop.position_range[0]
        position = home if state is None else state.position
        if self._unwinding is None:
            self._unwinding = (now, position)
        begin, start = self._unwinding
        patience = 1.0 + max(start - home, 0.0) / UNWIND_SLOWEST
        if position <= home + UNWIND_MARGIN or now - begin > patience or not self.settings.unwind:
            self._end()
        elif self.settings.mode == "pwm":
            self._send(position + (UNWIND_DUTY - loop.offset) / loop.gain, UNWIND_DUTY)
        else:
            self._send(max(start - UNWIND_SPEED * (now - begin), home))

    def _end(self) -> None:
        """Switch off for good."""
        self._over = True
        self.switch_off()

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
        ends = trip.action in ("unwind", "off") and trip.reason != COMPLETE
        if ends and self.ending is None:
            self.ending = trip
        if now >= self._told.get(trip.rule.name, -1.0):
            self._told[trip.rule.name] = now + TELL_PERIOD
            self.operator.tell(f"{trip.action.upper()}: {trip.reason}")
        if self._log is not None:
            self._log.trip(trip)

    def _note(self, tick: int, begin: float) -> None:
        """Log how long a tick took; a log that is not written beside the loop is handed on."""
        if self._log is None:
            return
        lateness = begin - self.ticker.start - tick / self.settings.rate
        now = self.clock.now()
        self._log.timing(now, tick, lateness, now - begin, self._policy_time)
        if self.bench.lockstep and tick % max(1, round(FLUSH_PERIOD * self.settings.rate)) == 0:
            self._log.session_log.sink.flush(sync=False)

    def _show(self, now: float) -> None:
        if now < self._next_show:
            return
        self._next_show = now + SHOW_PERIOD
        senses, elapsed = self.senses, now - self.ticker.start
        self.operator.show(
            DeployProgress(
                name="deploy",
                elapsed=elapsed,
                duration=self.settings.duration or 0.0,
                rate=senses.rows / max(elapsed, 1.0 / self.settings.rate),
                missed=senses.missed,
                force=senses.force,
                temperature=None if senses.health is None else senses.health.temperature,
                mode=self.guard.mode,
                goal=self._goal,
                position=0.0 if senses.state is None else senses.state.position,
                command=self._command,
                estimated=senses.forces.force is None,
                late=self.ticker.percentile(0.99),
                skipped=self.ticker.overruns,
            )
        )
