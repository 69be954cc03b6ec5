"""Faults of the load cell while data is collected: the motor must be off in time, with a reason."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.stop_request import StopRequest
from tests.faults import injections as on
from tests.faults.injections import FULL, LONG, let
from tests.hardware.deploy.runs import at_instant
from tests.hardware.silent_operator import SilentOperator

BEGIN = 3.0  # When faults begin, since the bench was opened [s]: the run has begun by then


@dataclass(frozen=True, kw_only=True)
class Collecting:
    """A fault during a recording, and what must come of it."""

    fault: Callable[[Bench, StopRequest], None]
    said: str  # What the reason says; nothing where the run must go on
    allowed: float = 0.15  # From the fault to a motor that is off [s]
    excitation: str = "contact_ramp"

    def examine(self, after: float) -> float | None:
        """Record and require what must come of it; return the time to a motor that is off [s]."""
        address = BenchAddress(bench="finger", port="virtual", load_cell_rate=80, lockstep=True)
        run = PlannedRun(name="run", bench="finger", excitation=self.excitation, duration=8.0)
        operator = SilentOperator()
        with (
            TemporaryDirectory() as folder,
            open_bench(address, operator.tell) as bench,
            StopRequest() as stop,
        ):
            begun = BEGIN + after
            at_instant(bench, begun, lambda: self.fault(bench, stop))
            path = Path(folder) / "run.mcap"
            offs: list[float] = []
            switch_off = bench.servo.disable_torque

            def switched_off() -> None:
                switch_off()
                offs.append(bench.clock.now() - begun)

            bench.servo.disable_torque = switched_off
            outcome = record_run(bench, run, CollectSettings(settle=0.5), path, operator, stop)
            done = offs[-1]
            assert not on.plant(bench).lines[0].registers.torque
        if not self.said:
            assert outcome.finished, outcome.fault
            return None
        assert self.said in str(outcome.fault), outcome.fault
        assert done <= self.allowed, f"{done:.3f} s"
        return done


COLLECTING: dict[str, Collecting] = {
    "a saturated load cell": Collecting(fault=on.stuck(FULL), said="is saturated"),
    "a load cell saturated the other way": Collecting(
        fault=on.stuck(-FULL - 1), said="is saturated"
    ),
    "a saturated load cell with 4 kg on it": Collecting(
        fault=on.both(on.stuck(FULL), on.load), said="is saturated"
    ),
    "a frozen load cell, then 4 kg": Collecting(
        fault=on.both(on.stuck(), on.load), said="the load cell must"
    ),
    "a load cell stuck at 0 counts": Collecting(fault=on.stuck(0), said="the load cell must"),
    "a load cell that does not feel the motor": Collecting(
        fault=let("cell_deaf", duration=LONG), said="must change while", allowed=2.0
    ),
    "a load cell that says 20 N too little": Collecting(
        fault=on.lie(lambda f, t, k: f - 20.0), said="the load cell must"
    ),
    "a loose contact with 4 kg": Collecting(
        fault=on.both(on.lie(lambda f, t, k: f * (k % 2)), on.load), said="must stay below 30 N"
    ),
    "a load cell of half its gain": Collecting(
        fault=on.lie(lambda f, t, k: 0.5 * f), said="as its converter does"
    ),
    "an encoder 0.5 rad ahead": Collecting(
        fault=on.misread(lambda a, t: a + 0.5), said="the spool must move"
    ),
    "a stuck encoder": Collecting(
        fault=on.lag(100.0), said="must", allowed=4.0, excitation="steps_held_1s"
    ),
    "a duty stuck at 0.6": Collecting(fault=on.pull(0.6), said="must", allowed=0.2),
    "a duty of 0.6 and none told": Collecting(
        fault=on.pull(0.6, echo=True),
        said="the spool must move",
        allowed=4.0,
        excitation="steps_held_1s",
    ),
    "too much tension": Collecting(fault=on.load, said="must stay below 30 N"),
    "one spike of the load cell": Collecting(fault=let("cell_spike"), said=""),
    "one saturated reading": Collecting(fault=let("cell_spike", counts=FULL), said=""),
    "a load cell that stays silent": Collecting(
        fault=let("cell_silence", duration=LONG), said="has been silent for 3", allowed=3.2
    ),
}
"""Faults of a recording in lockstep."""
