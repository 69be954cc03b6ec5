"""One deployment, from an open bench to a closed log."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from tendon_hardware.benches.bench import Bench, counter_facts
from tendon_hardware.benches.bench_address import FILTERS
from tendon_hardware.benches.off_check import still_driven
from tendon_hardware.collection.collect import closed
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.control.operator import Operator
from tendon_hardware.deployment.deploy_log import DeployLog, step_fields
from tendon_hardware.deployment.deploy_loop import UNWIND_DUTY, DeployLoop, Deployment
from tendon_hardware.deployment.deploy_operator import AbsentableOperator
from tendon_hardware.errors import SafetyStop
from tendon_hardware.logs.session import Session, flattened
from tendon_hardware.logs.session_log import SessionLog, open_log
from tendon_hardware.pacing import PacingReport
from tendon_hardware.safety_rules.rules import reach_of, refuse_unreachable
from tendon_hardware.safety_rules.rules_applied import Trip
from tendon_hardware.servos.base import ServoSettings
from tendon_hardware.stop_request import StopRequest
from tendon_newton.errors import TendonNewtonError


@dataclass(frozen=True, kw_only=True)
class DeployOutcome:
    """Log, rows and end of a deployment."""

    path: Path | None  # Log of the run
    rows: int  # Readings of the servo
    missed: int  # Ticks whose reading never came
    steps: int  # Steps of the pilot
    pacing: PacingReport
    trips: dict[str, int]  # Number of times that each safety rule came into effect
    ended: str  # Reason of the end, in words
    fault: TendonNewtonError | None  # Reason of an end against the operator's will
    first_command: float | None  # Instant of the first command on the bench's clock [s]
    # The latest trips of safety rules, and when what they ask for had been done [s]
    acted: tuple[tuple[Trip, float], ...]


def deploy(
    deployment: Deployment,
    path: Path | None,
    keyboard: Keyboard,
    operator: Operator,
    stop: StopRequest,
) -> DeployOutcome:
    """Let a pilot drive; the motors are off before and after it, whatever happens.

    Args:
        path: The log; it must not exist. Without one nothing is kept.

    Raises:
        TendonNewtonError: The run could not begin.
    """
    bench, settings = deployment.bench, deployment.settings
    refuse_blind_rules(deployment)
    read_back = [
        drive.servo.configure(
            watchdog_s=settings.watchdog, duty_limit=max(each.greatest_duty, -UNWIND_DUTY)
        )
        for drive, each in zip(bench.drives, settings.loops, strict=True)
    ]
    loop = DeployLoop(deployment, keyboard, AbsentableOperator(operator), stop)
    session = session_of(deployment, read_back)
    log = None if path is None else opened_log(path, session, bench)
    fault: TendonNewtonError | None = None
    stop.patient = True
    try:
        if not settings.dry:
            for drive in bench.drives:
                drive.servo.enable_torque()
        loop.run(None if log is None else DeployLog(log))
    except TendonNewtonError as error:
        fault = error
    finally:
        stop.patient = False
        loop.switch_off()
        if loop.ending is not None and not loop.complete:
            fault = fault or SafetyStop(loop.ending.reason)
        if not settings.dry:
            driven = still_driven(bench.drives, bench.clock, operator.tell)
            fault = fault or driven
        if log is not None:
            fault = closed(log, session | ending(loop, fault), fault)
    return DeployOutcome(
        path=path,
        rows=loop.senses.rows,
        missed=loop.senses.missed,
        steps=loop.steps,
        pacing=loop.ticker.report(),
        trips=dict(loop.guard.trips),
        ended=ended(loop, fault),
        fault=fault,
        first_command=loop.first_command,
        acted=tuple(loop.acted),
    )


def opened_log(path: Path, session: Mapping[str, str], bench: Bench) -> SessionLog:
    """Open the log of a run on a bench."""
    return open_log(
        path,
        session,
        bench.time_base(),
        background=not bench.lockstep,
        endless=True,
        tendons=len(bench.drives),
    )


def refuse_blind_rules(deployment: Deployment) -> None:
    """Refuse limits that the sensors of this bench can never pass.

    Raises:
        RuleOutOfReach: A rule could not act whatever happens.
    """
    bench = deployment.bench
    for drive, limits in zip(bench.drives, deployment.settings.servo_limits, strict=True):
        refuse_unreachable(limits, reach_of(drive, deployment.estimate))


def session_of(deployment: Deployment, read_back: Sequence[ServoSettings]) -> dict[str, str]:
    """Return what decides a deployment, as a metadata record holds it."""
    bench, settings, policy = deployment.bench, deployment.settings, deployment.policy
    address, (first, *others) = bench.address, bench.drives
    pilot = "jog" if policy is None else policy.path.stem
    session = Session(
        bench=address.bench,
        port=address.port,
        run=pilot,
        excitation="deployment",
        duration=settings.duration or 0.0,
        split="test",
        obstacle="free",
        seed=0,
        rate=settings.rate,
        command_rate=settings.policy_rate,
        host_loop=asdict(settings.loop),
        servo=read_back[0],
        calibration=first.calibration.identifier if first.calibration else None,
        load_cell=first.load_cell.name if first.load_cell else None,
        load_cell_rate=float(address.load_cell_rate) if address.virtual else None,
        load_cell_filter=FILTERS[address.load_cell_rate] if address.virtual else None,
        simulated=address.virtual,
        notes=settings.notes,
    ).text()
    names = step_fields(len(bench.drives), "tip" if policy is None else policy.card.task)
    session |= {"deploy.dry": str(settings.dry), "policy.step_fields": ", ".join(names)}
    session["deploy.limits"] = json.dumps(asdict(settings.limits))
    for place, (drive, found) in enumerate(zip(others, read_back[1:], strict=True), start=1):
        session |= flattened({f"servo_{place}": found})
        session |= flattened({f"host_loop_{place}": settings.loops[place]})
        calibration = drive.calibration
        session[f"calibration_{place}"] = "" if calibration is None else calibration.identifier
    if policy is not None:
        session |= {
            "policy.file": policy.path.name,
            "policy.sha256": policy.sha256,
            "policy.engine": policy.engine,
            "policy.card": policy.card.to_json(),
        }
    return session


def ending(loop: DeployLoop, fault: TendonNewtonError | None) -> dict[str, str]:
    """Return what is known at the end only: counters, pacing, trips, and why it ended."""
    facts = {
        "ended": ended(loop, fault),
        "rows": str(loop.senses.rows),
        "missed": str(loop.senses.missed),
        "pacing": loop.ticker.report().text,
        "safety.trips": json.dumps(loop.guard.trips),
    }
    if loop.watch is not None:
        facts["ball.drops"] = str(loop.watch.drops)
        facts["ball.turned_rad"] = f"{loop.watch.turned:.3f}"
    return facts | counter_facts(loop.bench.drives)


def ended(loop: DeployLoop, fault: TendonNewtonError | None) -> str:
    """Say why a run ended."""
    if fault is not None:
        return str(fault)
    return "complete" if loop.ending is None else loop.ending.reason
