"""One recording, from a planned run to a file."""

from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path

from tendon_hardware.benches.bench import Bench, counter_facts, motors_off
from tendon_hardware.benches.bench_address import FILTERS
from tendon_hardware.benches.off_check import still_driven
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.collection.run_loop import COASTED, RunLoop
from tendon_hardware.control.operator import Operator
from tendon_hardware.errors import LogNotWritten, SafetyStop
from tendon_hardware.logs.session import Session
from tendon_hardware.logs.session_log import SessionLog, open_log
from tendon_hardware.pacing import PacingReport
from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tendon_hardware.safety_rules.rules import COLLECTION_RULES, reach_of, refuse_unreachable
from tendon_hardware.servos.base import ServoSettings
from tendon_hardware.stop_request import StopRequest
from tendon_newton.errors import TendonNewtonError


@dataclass(frozen=True, kw_only=True)
class RunOutcome:
    """File, rows and end of a run."""

    path: Path
    rows: int  # Readings of the servo in the file
    missed: int  # Ticks whose reading never came
    readings: int  # Readings of the load cell in the file
    load_cell_rate: float | None  # Measured [Hz]
    # First and last instant of each gap, since the first row [s]
    gaps: tuple[tuple[float, float], ...]
    pacing: PacingReport
    fault: TendonNewtonError | None  # Reason of an end before its time
    interrupted: str | None  # Signal that ended it before its time

    @property
    def finished(self) -> bool:
        """Whether it has its full length."""
        return self.fault is None and self.interrupted is None


def record_run(
    bench: Bench,
    run: PlannedRun,
    settings: CollectSettings,
    path: Path,
    operator: Operator,
    stop: StopRequest,
) -> RunOutcome:
    """Record one run; the motor is off before and after it.

    What goes wrong on the bench ends the run and comes back with the outcome; the file is closed
    and stays readable. A string that pulls throws its spool out once the motor is off: after a
    sound run it is braked before it is too far out for the next one to begin.

    Args:
        path: The file; it must not exist.

    Raises:
        TendonNewtonError: The run could not begin: no row was recorded.
    """
    log = fault = None
    session, sound = dict[str, str](), False
    refuse_unreachable(
        DeployLimits(bench=settings.limits), reach_of(bench.drives[0]), COLLECTION_RULES
    )
    command = run.command(settings.seed, settings.rate)
    read_back = bench.servo.configure(duty_limit=settings.loop.greatest_duty)
    if bench.controls is not None:
        bench.controls.set_obstacle(run.obstacle)
    stop.patient = True
    loop = RunLoop(bench, settings, operator, stop)
    try:
        loop.approach(float(command[0]))
        session = session_of(bench, run, settings, read_back, loop).text()
        log = open_log(path, session, bench.time_base(), background=not bench.lockstep)
        loop.record(run, command, log)
        sound = stop.signal is None
    except TendonNewtonError as error:
        fault = error
    finally:
        stop.patient = False
        motors_off(bench.drives[:1], operator.tell)
        farthest = settings.limits.position[0] - COASTED if sound else -inf
        driven = still_driven(bench.drives[:1], bench.clock, operator.tell, farthest)
        fault = fault or driven
        if log is not None:
            fault = closed(log, session | ending(bench, loop, fault, stop), fault)
    if log is None:
        raise fault or SafetyStop("stopped before the first row")
    return RunOutcome(
        path=path,
        rows=loop.rows,
        missed=loop.missed,
        readings=loop.forces.readings,
        load_cell_rate=loop.forces.rate,
        gaps=tuple(loop.gaps.gaps),
        pacing=loop.ticker.report(),
        fault=fault,
        interrupted=stop.signal,
    )


def session_of(
    bench: Bench,
    run: PlannedRun,
    settings: CollectSettings,
    read_back: ServoSettings,
    loop: RunLoop,
) -> Session:
    """Gather what the metadata says."""
    address = bench.address
    drive = bench.drives[0]
    return Session(
        bench=run.bench,
        port=address.port,
        run=run.name,
        excitation=run.excitation,
        duration=run.duration,
        split=run.split,
        obstacle=run.obstacle,
        seed=settings.seed,
        rate=settings.rate,
        command_rate=settings.commands,
        host_loop=asdict(settings.loop),
        servo=read_back,
        calibration=drive.calibration.identifier if drive.calibration else None,
        load_cell=drive.load_cell.name if drive.load_cell else None,
        load_cell_rate=loop.forces.rate and round(loop.forces.rate, 2),
        load_cell_filter=FILTERS[address.load_cell_rate] if address.virtual else None,
        simulated=address.virtual,
        notes=settings.notes,
    )


def ending(
    bench: Bench, loop: RunLoop, fault: TendonNewtonError | None, stop: StopRequest
) -> dict[str, str]:
    """Return what is known at the end only: counters, gaps, pacing, and why it ended."""
    facts = {
        "ended": str(fault) if fault else stop.signal or "complete",
        "rows": str(loop.rows),
        "missed": str(loop.missed),
        "gaps": "; ".join(f"{start:.3f} to {end:.3f} s" for start, end in loop.gaps.gaps),
        "pacing": loop.ticker.report().text,
    }
    return facts | counter_facts(bench.drives[:1])


def closed(
    log: SessionLog, session: dict[str, str], fault: TendonNewtonError | None
) -> TendonNewtonError | None:
    """Close the log; a disk that is full is the fault unless there was one before."""
    try:
        log.finish(session)
    except LogNotWritten as error:
        log.close()
        return fault or error
    return fault
