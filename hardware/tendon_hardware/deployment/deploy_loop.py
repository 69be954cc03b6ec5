"""The loop of a deployment: read at 80 Hz, decide at 20 Hz, guard every tick.

In a tick everything is read first, then the rules are applied to what is known, then, where a step
is due, the command goes out. Ticks have absolute deadlines; one that is over before it could run is
skipped and counted.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from tendon_hardware import errors
from tendon_hardware.benches.bench import Bench, motors_off
from tendon_hardware.collection.run_loop import FLUSH_PERIOD
from tendon_hardware.control.goals import Goals
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.control.operator import Operator
from tendon_hardware.control.pilot import Pilot, PilotStep
from tendon_hardware.control.policy_runner import Policy
from tendon_hardware.deployment.ball_watch import BallWatch
from tendon_hardware.deployment.deploy_log import DeployLog
from tendon_hardware.deployment.deploy_operator import DeployProgress
from tendon_hardware.deployment.deploy_senses import DeploySenses
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.pacing import Ticker
from tendon_hardware.safety_rules.force_estimate import ForceEstimate
from tendon_hardware.safety_rules.rules_applied import SafetyGuards, Trip
from tendon_hardware.safety_rules.tip_watch import TipWatch
from tendon_hardware.servos.base import ServoState
from tendon_hardware.stop_request import StopRequest

SHOW_PERIOD = 0.1  # Time between two looks of the operator at the figures [s]
TELL_PERIOD = 2.0  # Time before the operator is told of the same rule again [s]
COMPLETE = "it has its full length"
BUSY = "loop_overrun"
"""Rule that a computer with other work breaks again and again; the operator is told once."""
BUSY_HINT = ". A virtual bench waits for this computer with --faster-than-real-time"
UNWIND_DUTY = -0.15  # Duty that lets the tendon out [1]: 1 rad/s at most
UNWIND_MARGIN = 0.05  # Distance from home that counts as home [rad]
UNWIND_SLOWEST = 0.3
"""Mean speed below which unwinding is given up and the motor switched off [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class Deployment:
    """Pilot, bench and settings of a deployment."""

    bench: Bench  # An open bench
    pilot: Pilot
    settings: DeploySettings
    goals: Goals
    policy: Policy | None = None  # Named in the log; a hand at the keys is none
    estimate: ForceEstimate | None = None  # Gives the tension where no load cell does
    watch: BallWatch | None = None  # Knows of the ball that a policy turns

    @property
    def estimates(self) -> tuple[ForceEstimate, ...]:
        """One for each servo, where there is one."""
        first = self.estimate
        return () if first is None else (first, *(first.anew() for _ in self.bench.drives[1:]))


class DeployLoop:
    """Lets a pilot drive the servos as long as the rules allow.

    Args:
        deployment: The servos of its bench are configured, and on unless the run is dry.
    """

    def __init__(
        self, deployment: Deployment, keyboard: Keyboard, operator: Operator, stop: StopRequest
    ) -> None:
        self.bench = bench = deployment.bench
        self.servos = tuple(drive.servo for drive in bench.drives)
        self.clock = bench.clock
        self.pilot = deployment.pilot
        self.settings = settings = deployment.settings
        self.goals = goals = deployment.goals
        self.operator = operator
        self.estimates = deployment.estimates
        self.watch = deployment.watch
        self.guard = SafetyGuards(
            settings.servo_limits, [f"servo {servo.identifier}" for servo in self.servos]
        )
        self.ticker = Ticker(self.clock, settings.rate)
        self.senses = DeploySenses(bench, settings, goals, keyboard, operator, stop, self.ticker)
        self.tip = TipWatch(bench)
        self.steps = 0  # Steps of the pilot
        # The latest trips, and when what they ask for had been done [s]
        self.acted: deque[tuple[Trip, float]] = deque(maxlen=100)
        self.first_command: float | None = None  # Instant of the first command [s]
        self.ending: Trip | None = None  # Reason of the run's end; None after its full length
        self._over = False
        self._log: DeployLog | None = None
        self._goal = self._policy_time = 0.0
        self._command = self._jump = (0.0,) * len(self.servos)
        self._output: tuple[float | None, ...] = (None,) * len(self.servos)
        self._sent = -1
        self._unwinding: tuple[float, list[float]] | None = None
        self._next_show = 0.0
        self._told: dict[tuple[str, int, str], float] = {}

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
        senses.hear(self.ticker.start)
        while not self._over:
            tick = self.ticker.wait()
            begin = self.clock.now()
            if count is not None and tick >= count and senses.stop_reason is None:
                senses.stop_reason = COMPLETE
            try:
                self._tick(tick)
                self._note(tick, begin)
            except errors.LogNotWritten as error:
                senses.failure, self._log = str(error), None
            self._show(begin)

    def _tick(self, tick: int) -> None:
        senses = self.senses
        senses.take(tick, self._log)
        if self.watch is not None:
            self.watch.take(None if self._log is None else self._log.session_log)
        due = tick // self.settings.divider != self._sent
        step = self._decision(states) if due and (states := senses.states) else None
        trips = self.guard.judge(senses.glances(self._output, self._jump))
        self._act(step, due=due, begun=bool(trips))
        if due:
            self._sent = tick // self.settings.divider
        for trip in trips:
            self._announce(trip)
        self.tip.take(None if self._log is None else self._log.session_log)

    def _decision(self, states: Sequence[ServoState]) -> PilotStep | None:
        """Let the pilot decide, unless it cannot, which is a rule's business."""
        try:
            return self._decide(states)
        except errors.PolicyFailure as error:
            self.senses.broken = str(error)
            return None

    def _decide(self, states: Sequence[ServoState]) -> PilotStep:
        """Let the pilot look and decide; what it wants holds until the next step."""
        begin = self.clock.now()
        step = self.pilot.step(states, self.goals.value(begin - self.ticker.start))
        befores = self._before(step)
        for servo, estimate, before, state in zip(
            self.senses.servos, self.estimates, befores, states, strict=False
        ):
            servo.estimated = estimate(before, state.position, state.velocity)
        self._goal, self._output = step.goal, step.output
        self._jump = tuple(
            (command - before) * self.settings.policy_rate
            for command, before in zip(step.command, befores, strict=True)
        )
        self._policy_time = self.clock.now() - begin
        self.steps += 1
        return step

    def _before(self, step: PilotStep) -> tuple[float, ...]:
        """Return the last commands [rad]; before there are any, where the spools stand."""
        return step.sample[: len(self.servos)] if self.first_command is None else self._command

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

    def _within(self, step: PilotStep) -> tuple[float, ...]:
        """Return a step's commands within the ranges and no further from the last than allowed."""
        reach = self.settings.limits.command_rate / self.settings.policy_rate
        positions = step.sample[: len(self.servos)]
        return tuple(
            loop.allowed(min(max(command, before - reach), before + reach), position)
            for command, before, loop, position in zip(
                step.command, self._before(step), self.settings.loops, positions, strict=True
            )
        )

    def _send(
        self, commands: Sequence[float], duties: Sequence[float | None] | None = None
    ) -> None:
        """Give each servo a command [rad], or in its place a duty [1], unless the run is dry."""
        instant = self.clock.now()
        self._command = tuple(commands)
        if self.first_command is None:
            self.first_command = instant
        if self.settings.dry or self.senses.states is None:
            return
        wanted = duties or (None,) * len(self.servos)
        sent = [
            self._send_one(place, command, duty, instant)
            for place, (command, duty) in enumerate(zip(commands, wanted, strict=True))
        ]
        if self._log is not None and all(sent):
            self._log.session_log.command(instant, *commands)

    def _send_one(self, place: int, command: float, duty: float | None, instant: float) -> bool:
        """Give one servo its command or duty; return whether it has taken it."""
        servo, senses = self.servos[place], self.senses.servos[place]
        try:
            if duty is None:
                assert senses.state is not None
                duty = self.settings.loops[place].duty(command, senses.state.position)
            duty = servo.command_duty(duty)
            if self._log is not None:
                self._log.session_log.duty(instant, duty, place)
        except (errors.ServoSilent, errors.PortLost):
            return False  # its silence is a rule's business
        except (errors.WatchdogTripped, errors.ServoRefused) as error:
            senses.stopped = str(error)
            return False
        return True

    def _unwind(self) -> None:
        """Let the tendons out slowly; at home, or where that does not work, the run is over."""
        loops, now = self.settings.loops, self.clock.now()
        homes = [loop.position_range[0] for loop in loops]
        positions = [
            home if servo.state is None else servo.state.position
            for servo, home in zip(self.senses.servos, homes, strict=True)
        ]
        if self._unwinding is None:
            self._unwinding = (now, positions)
        begin, starts = self._unwinding
        ways = [max(start - home, 0.0) for start, home in zip(starts, homes, strict=True)]
        left = [p > home + UNWIND_MARGIN for p, home in zip(positions, homes, strict=True)]
        patience = 1.0 + max(ways) / UNWIND_SLOWEST
        if not any(left) or now - begin > patience or not self.settings.unwind:
            self._end()
            return
        stale = self.settings.limits.stale_state
        duties = [  # without motion where nobody knows how far the spool has come: its gear holds
            UNWIND_DUTY if out and now - servo.heard <= stale else 0.0
            for out, servo in zip(left, self.senses.servos, strict=True)
        ]
        self._send(
            [
                position + (duty - loop.offset) / loop.gain
                for position, duty, loop in zip(positions, duties, loops, strict=True)
            ],
            duties,
        )

    def _end(self) -> None:
        """Switch off for good."""
        self._over = True
        self.switch_off()

    def switch_off(self) -> None:
        """Switch the motors off, as far as they can be reached; more than once does no harm."""
        motors_off(self.bench.drives, self.operator.tell)

    def _announce(self, trip: Trip) -> None:
        """Note, log and tell that a rule came into effect, after it was acted upon."""
        now = self.clock.now()
        self.acted.append((trip, now))
        ends = trip.action in ("unwind", "off") and trip.reason != COMPLETE
        if ends and self.ending is None:
            self.ending = trip
        self._tell(trip, now)
        if self._log is not None:
            self._log.trip(trip, alarm=trip.reason != COMPLETE)

    def _tell(self, trip: Trip, now: float) -> None:
        """Tell the operator, but not again and again; a run that is over is no alarm."""
        if trip.reason == COMPLETE:
            self.operator.announce("The run has its full length; the tendon is let out.")
            return
        known = (trip.rule.name, trip.servo, trip.action)
        if now < self._told.get(known, -1.0):
            return
        busy = trip.rule.name == BUSY
        cut = trip.action == "cut"  # as a sound policy is at the ends of its range: told once
        self._told[known] = inf if busy or cut else now + TELL_PERIOD
        if cut:
            self.operator.announce(f"{trip.reason} (told once, the log has each)")
            return
        hint = BUSY_HINT if busy and self.bench.address.virtual else ""
        self.operator.tell(f"{trip.action.upper()}: {trip.reason}{hint}")

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
        servos, elapsed = self.senses.servos, now - self.ticker.start
        warmth = [servo.health.temperature for servo in servos if servo.health is not None]
        forces = [servo.force for servo in servos if servo.force is not None]
        self.operator.show(
            DeployProgress(
                name="deploy",
                elapsed=elapsed,
                duration=self.settings.duration or 0.0,
                rate=self.senses.rows / max(elapsed, 1.0 / self.settings.rate),
                missed=self.senses.missed,
                force=max(forces, default=None),
                temperature=max(warmth, default=None),
                mode=self.guard.mode,
                goal=self._goal,
                turns=self.watch is not None,
                position=tuple(0.0 if s.state is None else s.state.position for s in servos),
                command=self._command,
                estimated=any(servo.forces.force is None for servo in servos),
                late=self.ticker.percentile(0.99),
                skipped=self.ticker.overruns,
            )
        )
