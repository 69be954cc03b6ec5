"""What a deployment knows in a tick: servo, load cell, keys and signals, as far as they answer."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from tendon_hardware import errors
from tendon_hardware.benches.bench import Bench
from tendon_hardware.collection.run_loop import LOOK_PERIOD
from tendon_hardware.control.goals import Goals
from tendon_hardware.control.keyboard import KILL_KEYS, STOP_KEYS, Keyboard
from tendon_hardware.control.operator import Operator
from tendon_hardware.deployment.deploy_log import DeployLog
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.load_cells.cell_plugs import CellPlugs
from tendon_hardware.pacing import Ticker
from tendon_hardware.safety_rules.force_watch import ForceWatch
from tendon_hardware.safety_rules.motion_watch import MotionWatch
from tendon_hardware.safety_rules.rule_limits import SKIP_WINDOW
from tendon_hardware.safety_rules.rules import Glance
from tendon_hardware.servos.base import ServoHealth, ServoState
from tendon_hardware.stop_request import StopRequest


class ServoSenses:
    """What is known of one servo and of the load cell in its tendon."""

    def __init__(
        self, bench: Bench, settings: DeploySettings, operator: Operator, place: int
    ) -> None:
        self.servo = bench.drives[place].servo
        self.clock = bench.clock
        radius = settings.spool_radius
        self.forces = ForceWatch(bench, None, operator, radius, place)
        self.motion = MotionWatch(bench.drives[place], radius, settings.limits.bench.force)
        self.state: ServoState | None = None  # Last reading of the servo
        self.health: ServoHealth | None = None
        self.estimated: float | None = None  # Tension by a force network [N]
        self.stopped: str | None = None  # Reason why the servo does not drive
        self.heard = self.clock.now()  # When it last answered [s]
        self._alerts = self.servo.counters.alerts

    @property
    def force(self) -> float | None:
        """Tension, measured or else estimated [N]."""
        return self.estimated if self.forces.force is None else self.forces.force

    @property
    def sure_force(self) -> float | None:
        """Tension that no single wrong reading of the load cell can have made [N]."""
        return self.estimated if self.forces.force is None else self.forces.agreed

    @property
    def alerted(self) -> bool:
        """Whether an answer since the last look told of an alert."""
        return self.servo.counters.alerts > self._alerts

    def read(self, others: Sequence[float]) -> ServoState | None:
        """Read the servo, where it can be reached; other spools were last at these angles [rad]."""
        try:
            self.state = state = self.servo.read_state()
        except (errors.ServoSilent, errors.PortLost, errors.ServoRefused):
            return None
        self.heard = state.time
        self.motion.take(state, self.forces.force, others)
        return state

    def look(self) -> ServoHealth | None:
        """Look at what changes slowly, and whether the motor still does what it is told."""
        self._alerts = self.servo.counters.alerts
        try:
            self.health = health = self.servo.check()
        except (errors.ServoAlert, errors.ServoReset, errors.WatchdogTripped) as error:
            self.stopped = str(error)
            return None
        except (errors.ServoSilent, errors.PortLost, errors.ServoRefused):
            return None
        return health

    def glance(self, common: Glance, output: float | None, jump: float) -> Glance:
        """Add to what is known now all that belongs to this servo."""
        state, health = self.state, self.health
        return replace(
            common,
            position=None if state is None else state.position,
            strayed=self.motion.strayed,
            disobeyed=self.motion.disobeyed,
            stuck=self.motion.stuck,
            silence=max(common.now - self.heard, 0.0),
            force=self.sure_force,
            pull=self.forces.pull,
            blindness=self.forces.silence,
            doubt=self.forces.fault or common.doubt,
            current=None if state is None else state.current,
            voltage=None if health is None else health.voltage,
            temperature=None if health is None else health.temperature,
            stopped=self.stopped,
            output=output,
            jump=jump,
        )


class DeploySenses:
    """Asks everything that can be asked, once a tick, and never waits for an answer for long.

    Args:
        goals: Takes the keys that are no stop.
    """

    def __init__(
        self,
        bench: Bench,
        settings: DeploySettings,
        goals: Goals,
        keyboard: Keyboard,
        operator: Operator,
        stop: StopRequest,
        ticker: Ticker,
    ) -> None:
        self.clock = bench.clock
        self.servos = tuple(
            ServoSenses(bench, settings, operator, place) for place in range(len(bench.drives))
        )
        self._plugs = CellPlugs([drive.calibration for drive in bench.drives])
        self.rows = self.missed = 0  # Readings of all servos, and ticks in which one was missed
        self.stop_reason: str | None = None  # Reason for an orderly end of the run
        self.failure: str | None = None  # Reason why the log cannot be written
        self.broken: str | None = None  # Reason why the pilot cannot decide
        self._divider = settings.divider
        self._goals = goals
        self._keyboard = keyboard
        self._operator = operator
        self._stop = stop
        self._ticker = ticker
        self._kill: str | None = None
        self._ran: deque[int] = deque()
        self._next_log = 0.0

    @property
    def states(self) -> list[ServoState] | None:
        """The last reading of each servo, once all have been read."""
        states = [servo.state for servo in self.servos if servo.state is not None]
        return states if len(states) == len(self.servos) else None

    def hear(self, instant: float) -> None:
        """Count every servo's silence from an instant [s]."""
        for servo in self.servos:
            servo.heard = instant

    def take(self, tick: int, log: DeployLog | None) -> None:
        """Ask everything; health comes half a policy step after the policy's own tick."""
        self._ran.append(tick)
        while self._ran[0] <= tick - SKIP_WINDOW:
            self._ran.popleft()
        for servo in self.servos:
            servo.forces.take(log.session_log if log else None)
        self._read(log)
        due = (tick + self._divider // 2) % self._divider == 0
        chosen = [servo for servo in self.servos if due or servo.alerted]
        if chosen:
            self._look(chosen, log)
        self._listen()

    def glances(self, outputs: Sequence[float | None], jumps: Sequence[float]) -> list[Glance]:
        """Gather what is known of each servo, with what the policy wants [rad] and how fast."""
        common = Glance(
            now=self.clock.now(),
            skipped=min(self._ran[-1] + 1, SKIP_WINDOW) - len(self._ran),
            stop=self.stop_reason,
            kill=self._kill,
            failure=self.failure,
            broken=self.broken,
        )
        return [
            servo.glance(replace(common, doubt=doubt), output, jump)
            for servo, doubt, output, jump in zip(
                self.servos, self._plugs.faults, outputs, jumps, strict=True
            )
        ]

    def _read(self, log: DeployLog | None) -> None:
        """Read the servos, where they can be reached."""
        latest = [math.nan if each.state is None else each.state.position for each in self.servos]
        states = [servo.read(latest[:k] + latest[k + 1 :]) for k, servo in enumerate(self.servos)]
        whole = [state for state in states if state is not None]
        if len(whole) < len(states):
            self.missed += 1
            return
        self.rows += 1
        spools = [state.position for state in whole]
        for k, (servo, state) in enumerate(zip(self.servos, whole, strict=True)):
            servo.forces.move(state, spools[:k] + spools[k + 1 :])
        told = [servo.forces.told for servo in self.servos if servo.forces.told is not None]
        if len(told) == len(whole):
            self._plugs.hear([counts for counts, _ in told])
            self._plugs.take(self.clock.now(), spools, [tension for _, tension in told])
        if log is not None:
            log.session_log.state(*whole)

    def _look(self, chosen: Sequence[ServoSenses], log: DeployLog | None) -> None:
        """Look at what changes slowly; what was seen of all servos is logged now and then."""
        looks = [(servo.look(), servo.servo.counters) for servo in chosen]
        seen = [(health, counters) for health, counters in looks if health is not None]
        now = self.clock.now()
        if log is not None and len(seen) == len(self.servos) and now >= self._next_log:
            self._next_log = now + LOOK_PERIOD
            (health, counters), *further = seen
            log.session_log.health(
                now, health, counters, *further, missed=self.missed, skipped=self._ticker.overruns
            )

    def _listen(self) -> None:
        """Take signals and keys."""
        if self._stop.signal is not None and self.stop_reason is None:
            self.stop_reason = f"stopped by {self._stop.signal}"
        for key in self._keyboard.pressed():
            if key in STOP_KEYS:
                self.stop_reason = self.stop_reason or f"stopped by {STOP_KEYS[key]}"
            elif key in KILL_KEYS:
                self._kill = f"switched off by {KILL_KEYS[key]}"
            else:
                self._goals.key(key)
        while self._goals.notes:
            self._operator.tell(self._goals.notes.pop(0))
