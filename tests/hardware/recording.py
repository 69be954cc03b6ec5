"""Records on virtual benches that run faster than real time, for tests."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect import RunOutcome, record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.control.operator import OperatorProgress
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench import Faults
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mcap_file import read_session
from tendon_newton.data.recording import Recording
from tests.hardware.silent_operator import SilentOperator


class Watcher(SilentOperator):
    """An operator who does something once a run has come far enough."""

    def __init__(self, after: float = 0.0, act: Callable[[], None] | None = None) -> None:
        super().__init__()
        self.after = after
        self.act = act

    def show(self, progress: OperatorProgress) -> None:
        """Keep the figures and act when it is time."""
        super().show(progress)
        if self.act is not None and progress.elapsed >= self.after:
            act, self.act = self.act, None
            act()


@dataclass(kw_only=True)
class Trial:
    """One run on a bench with faults, and what came of it."""

    path: Path
    bench: str = "finger"
    excitation: str = "random_steps"
    duration: float = 6.0
    obstacle: str = "free"
    load_cell_rate: int = 80
    lockstep: bool = True
    settings: CollectSettings = field(default_factory=CollectSettings)
    faults: Faults = field(default_factory=Faults)
    """What goes wrong by chance, from the first row on; events count from there as well."""
    outcome: RunOutcome | None = None
    said: list[str] = field(default_factory=list)
    session: dict[str, str] = field(default_factory=dict)

    def record(self) -> RunOutcome:
        """Record; faults begin with the first look at the figures, half a second in."""
        address = BenchAddress(
            bench=self.bench,
            port="virtual",
            load_cell_rate=self.load_cell_rate,
            lockstep=self.lockstep,
        )
        operator = Watcher()
        run = PlannedRun(
            name="run",
            bench=self.bench,
            excitation=self.excitation,
            duration=self.duration,
            obstacle=self.obstacle,
        )
        with open_bench(address, operator.tell) as bench, StopRequest() as stop:
            operator.act = lambda: begin(bench, self.faults)
            self.outcome = record_run(bench, run, self.settings, self.path, operator, stop)
        self.said = operator.told
        self.session = read_session(self.path)
        return self.outcome

    def recording(self) -> Recording:
        """Read what was recorded."""
        return read_recording_file(self.path, bench=self.bench)


def begin(bench: Bench, faults: Faults) -> None:
    """Let faults begin now; the events' starts count from here [s]."""
    now = bench.controls.state().time
    events = tuple(replace(event, start=now + event.start) for event in faults.events)
    bench.controls.set_faults(replace(faults, events=events))
