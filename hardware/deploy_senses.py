"""What a deployment knows in a tick: servo, load cell, keys and signals, as far as they answer."""

from __future__ import annotations

from collections import deque

from hardware.bench import Bench
from hardware.deploy_log import DeployLog
from hardware.deploy_settings import DeploySettings
from hardware.errors import (
    PortLost,
    ServoAlert,
    ServoRefused,
    ServoReset,
    ServoSilent,
    WatchdogTripped,
)
from hardware.force_watch import ForceWatch
from hardware.goals import Goals
from hardware.keyboard import KILL_KEYS, STOP_KEYS, Keyboard
from hardware.operator import Operator
from hardware.pacing import Ticker
from hardware.run_loop import LOOK_PERIOD
from hardware.safety import Glance
from hardware.servos.base import ServoHealth, ServoState
from hardware.stop_request import StopRequest

SKIP_WINDOW = 8
"""Ticks among which skipped ones are counted."""


class DeploySenses:
    """Asks everything that can be asked, once a tick, and never waits for an answer for long.

    Args:
        bench: An open bench.
        settings: Rates and limits.
        goals: Takes the keys that are no stop.
        keyboard: The operator's keys.
        operator: Who is told.
        stop: Who may end the run by a signal.
        ticker: Counts skipped ticks.
    """

    def __init__(
        self, bench: Bench, settings: DeploySettings, goals: Goals, keyboard: Keyboard,
        operator: Operator, stop: StopRequest, ticker: Ticker,
    ) -> None:  # fmt: skip
        self.bench = bench
        self.servo = bench.servo
        self.clock = bench.clock
        self.forces = ForceWatch(bench, None, operator)
        self.state: ServoState | None = None
        """The servo's last reading."""
        self.health: ServoHealth | None = None
        self.estimated: float | None = None
        """Tension by a force network [N]."""
        self.rows = self.missed = 0
        """Readings of the servo, and ticks without one."""
        self.stop_reason: str | None = None
        """Why the run should end in an orderly way."""
        self.stopped: str | None = None
        """Why the servo does not drive."""
        self.failure: str | None = None
        """Why the log cannot be written."""
        self.heard = self.clock.now()
        """When the servo last answered [s]."""
        self._divider = settings.divider
        self._goals = goals
        self._keyboard = keyboard
        self._operator = operator
        self._stop = stop
        self._ticker = ticker
        self._kill: str | None = None
        self._alerts = self.servo.counters.alerts
        self._ran: deque[int] = deque()
        self._next_log = 0.0

    @property
    def force(self) -> float | None:
        """Tension, measured or else estimated [N]."""
        return self.estimated if self.forces.force is None else self.forces.force

    def take(self, tick: int, log: DeployLog | None) -> None:
        """Ask everything; health comes half a policy step after the policy's own tick."""
        self._ran.append(tick)
        while self._ran[0] <= tick - SKIP_WINDOW:
            self._ran.popleft()
        self.forces.take(log.session_log if log else None)
        self._read(log)
        alerted = self.servo.counters.alerts > self._alerts
        if alerted or (tick + self._divider // 2) % self._divider == 0:
            self._look(log)
        self._listen()

    def glance(self, output: float | None, jump: float) -> Glance:
        """Gather what is known now, with what the policy wants [rad] and how fast [rad/s]."""
        state, health, now = self.state, self.health, self.clock.now()
        return Glance(
            now=now,
            position=None if state is None else state.position,
            silence=max(now - self.heard, 0.0),
            force=self.force,
            blindness=self.forces.silence,
            current=None if state is None else state.current,
            voltage=None if health is None else health.voltage,
            temperature=None if health is None else health.temperature,
            stopped=self.stopped,
            skipped=min(self._ran[-1] + 1, SKIP_WINDOW) - len(self._ran),
            output=output,
            jump=jump,
            stop=self.stop_reason,
            kill=self._kill,
            failure=self.failure,
        )

    def _read(self, log: DeployLog | None) -> None:
        """Read the servo, where it can be reached."""
        try:
            self.state = state = self.servo.read_state()
        except (ServoSilent, PortLost, ServoRefused):
            self.missed += 1
            return
        self.heard = state.time
        self.rows += 1
        if log is not None:
            log.session_log.state(state)

    def _look(self, log: DeployLog | None) -> None:
        """Look at what changes slowly, and whether the motor still does what it is told."""
        self._alerts = self.servo.counters.alerts
        try:
            self.health = health = self.servo.check()
        except (ServoAlert, ServoReset, WatchdogTripped) as error:
            self.stopped = str(error)
            return
        except (ServoSilent, PortLost, ServoRefused):
            return
        now = self.clock.now()
        if log is not None and now >= self._next_log:
            self._next_log = now + LOOK_PERIOD
            log.session_log.health(
                now, health, self.servo.counters,
                missed=self.missed, skipped=self._ticker.overruns,
            )  # fmt: skip

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
