"""Many recordings in order: a plan, which can be interrupted and taken up again."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect import RunOutcome, record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import BY_HAND, OBSTACLES, PlannedRun
from tendon_hardware.control.operator import Operator
from tendon_hardware.errors import ServoAlert
from tendon_hardware.servos.base import ServoSpec
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.dataset import ListedRecording, Split, list_recording, listed_files
from tendon_newton.data.files.output_folder import make_folder, releasing
from tendon_newton.data.files.toml_file import read_toml, write_toml
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.errors import InvalidOutput, shown

MODEL_FILE = "model.toml"  # Name of the model beside a dataset's recordings
UNKNOWN = ("torque_constant", "resistance")
"""Numbers that every fit may change: the data sheet's are of another voltage, without a spread."""


def starting_model(
    spec: ServoSpec, loop: HostPositionLoop, *, voltage: float, spool_radius: float
) -> Model:
    r"""Return a servo in PWM mode behind the position loop of this computer.

    .. math:: R = V_0 / I_0, \qquad k_t = \tau_0 / I_0

    with stall torque and current at the data sheet's voltage. The motor's greatest force is that at
    stall: an asset's limit is what its gear leaves of that.

    Args:
        voltage: Supply that the servo measures [V].
        spool_radius: Radius of its spool [m].
    """
    values = {
        "duty_per_rad": loop.gain,
        "max_duty": loop.duty_limit,
        "duty_offset": loop.offset,
        "supply_voltage": round(voltage, 2),
        "torque_constant": round(spec.stall_torque / spec.stall_current, 4),
        "resistance": round(spec.supply_voltage / spec.stall_current, 3),
        "armature": spec.armature,
        "spool_radius": spool_radius,
        "force_limit": round(spec.stall_torque / spool_radius, 1),
    }
    return Model(actuator=NamedValues(name="pwm_servo", values=values), fit=UNKNOWN)


COLLECTION_FILE = "collection.toml"
"""Settings that a folder's recordings share; a plan is taken up again only with the same."""
SINGLE_RUNS = "single runs"  # Title of a folder whose recordings follow no plan
AGAIN = re.compile(r"_again\d+$")  # Ending of a recording whose first attempt was interrupted
MISSED_SHARE = 0.02  # Missing rows that the operator is told of [1]
RATE_MARGIN = 0.9  # A load cell below this share of the rows' rate counts as slower [1]


@dataclass(frozen=True, kw_only=True)
class Collection:
    """Recordings of a plan, and how it ended."""

    outcomes: tuple[RunOutcome, ...]  # Runs that were recorded now, finished or not, in order
    kept: int  # Runs that had been recorded before
    left: int  # Runs that are still to be recorded


@releasing()
def collect(
    address: BenchAddress,
    plan: Sequence[PlannedRun],
    settings: CollectSettings,
    out: Path,
    operator: Operator,
    stop: StopRequest,
    *,
    title: str,
) -> Collection:
    """Record the runs of a plan that its folder does not list yet.

    A run that ends before its time keeps its file, unlisted, and is recorded anew under another
    name when the plan is taken up again. After an alert the servo is restarted and the run tried
    once more at once.

    Args:
        address: Ports and servos; each run sets the bench's name.
        title: Name of the plan; a folder holds one, or any number of single runs.

    Raises:
        InvalidOutput: The folder holds another plan, or the same with other settings.
        InvalidParameter: The port names one bench, and the plan has another.
        TendonNewtonError: A bench cannot be opened, or a fault ended a run.
    """
    facts = shared_facts(title, address, settings)
    refuse_others(out, facts)
    addresses = {run.bench: replace(address, bench=run.bench) for run in plan}
    done = recorded_runs(out)
    waiting = [run for run in plan if run.name not in done]
    outcomes: list[RunOutcome] = []
    for name, group in groupby(waiting, key=lambda run: run.bench):
        with open_bench(addresses[name], operator.tell) as bench:
            begin(out, facts, bench, settings)
            mount(bench, operator)
            if bench.controls is not None:
                bench.controls.plant_file(out / f"plant_{name}.toml")
            obstacle = "free"
            for run in group:
                left = waiting[waiting.index(run) :]
                operator.announce(
                    f"run {len(plan) - len(left) + 1} of {len(plan)}: {run.name}, "
                    f"{run.duration:.0f} s; {sum(r.duration for r in left) / 60.0:.1f} min left"
                )
                if not address.virtual and (run.obstacle != obstacle or run.obstacle in BY_HAND):
                    operator.ask(OBSTACLES[run.obstacle])
                obstacle = run.obstacle
                finished = False
                try:
                    outcomes += attempts(bench, run, settings, out, operator, stop)
                    finished = outcomes[-1].finished
                finally:
                    if not finished:
                        operator.tell(
                            f"Runs left: {len(left)} of {len(plan)}. The same command goes on."
                        )
                if not finished:
                    return report(outcomes, plan, done)
    return report(outcomes, plan, done)


def recorded_runs(out: Path) -> set[str]:
    """Return the runs whose recordings a folder lists and has, also those of further attempts."""
    return {AGAIN.sub("", Path(file).stem) for file in listed_files(out) if (out / file).exists()}


def report(
    outcomes: Sequence[RunOutcome], plan: Sequence[PlannedRun], done: set[str]
) -> Collection:
    """Count what was recorded now and before, and what is left."""
    kept = sum(run.name in done for run in plan)
    finished = sum(outcome.finished for outcome in outcomes)
    return Collection(outcomes=tuple(outcomes), kept=kept, left=len(plan) - kept - finished)


def attempts(
    bench: Bench,
    run: PlannedRun,
    settings: CollectSettings,
    out: Path,
    operator: Operator,
    stop: StopRequest,
) -> list[RunOutcome]:
    """Record a run and list it; after an alert restart the servo and try once more."""
    outcome = record_run(bench, run, settings, free_path(out, run.name), operator, stop)
    outcomes = [outcome]
    if isinstance(outcome.fault, ServoAlert):
        operator.tell(f"{run.name}: {outcome.fault}")
        operator.ask("Remove the cause. The servo is then restarted and the run recorded anew.")
        bench.servo.reboot()
        outcome = record_run(bench, run, settings, free_path(out, run.name), operator, stop)
        outcomes.append(outcome)
    if outcome.missed > MISSED_SHARE * (outcome.rows + outcome.missed):
        operator.tell(
            f"{run.name} misses {outcome.missed} of {outcome.rows + outcome.missed} rows, "
            f"{outcome.pacing.overruns} of them because this computer was too busy."
        )
    if outcome.finished:
        rate = None if bench.drives[0].calibration is None else outcome.load_cell_rate
        enlist(outcome.path, run.bench, run.split, settings.rate, rate)
    return outcomes


def enlist(path: Path, bench: str, split: Split, rate: float, load_cell_rate: float | None) -> None:
    """Add a recording to its folder's ``dataset.toml``.

    The recording starts from its first row. Gears hold the spool, so that a servo does not rest in
    the friction-free equilibrium of a command.

    Args:
        rate: Rows per second [Hz].
        load_cell_rate: Readings per second [Hz], where they are tensions.
    """
    slow = load_cell_rate is not None and load_cell_rate < RATE_MARGIN * rate
    entry = ListedRecording(
        file=path.name,
        bench=bench,
        split=split,
        start="first_row",
        load_cell_rate=float(round(load_cell_rate)) if load_cell_rate and slow else None,
    )
    list_recording(path.parent, entry)


def free_path(out: Path, name: str) -> Path:
    """Return where a run goes: what an interrupted attempt has left is never overwritten."""
    path, attempt = out / f"{name}.mcap", 0
    while path.exists():
        attempt += 1
        path = out / f"{name}_again{attempt}.mcap"
    return path


def free_name(out: Path, stem: str) -> str:
    """Return the first numbered name that no file of a folder has."""
    number = 0
    while any(out.glob(f"{stem}_{number}[._]*")):
        number += 1
    return f"{stem}_{number}"


def mount(bench: Bench, operator: Operator) -> None:
    """Ask for a bench to be made ready while its motor is off; a virtual one is."""
    if not bench.address.virtual:
        operator.ask(
            f"Mount the bench {bench.address.bench!r}, with nothing in its way. Let it rest and "
            "wind the spool by hand until the tendon is just taut: there the angle is zero."
        )


def shared_facts(title: str, address: BenchAddress, settings: CollectSettings) -> dict[str, Any]:
    """Return what all recordings of a folder have in common."""
    facts: dict[str, Any] = {
        "plan": title,
        "virtual": address.virtual,
        "servo": address.servo,
        "spool_radius_m": settings.spool_radius,
    }
    if address.virtual:  # its true numbers stand beside the recordings
        facts |= {"unit": address.unit, "worn": address.wear}
    if title != SINGLE_RUNS:
        facts |= {
            "seed": settings.seed,
            "mode": "pwm",  # a folder from when the servo's own loop could run is not mixed
            "rate_hz": settings.rate,
            "command_rate_hz": settings.commands,
        }
    return facts


def refuse_others(out: Path, facts: Mapping[str, Any]) -> None:
    """Refuse to mix recordings of another kind among those that a folder lists."""
    if out.is_dir():
        make_folder(
            out, dataset=True
        )  # before it is read; another one is made when a bench answers
    if not listed_files(out):
        return
    path = out / COLLECTION_FILE
    if not path.exists():
        raise InvalidOutput(f"{out}: holds a dataset of another origin; give another folder")
    there = read_toml(path, InvalidOutput, "a collection is a TOML file")
    for key, value in facts.items():
        if there.get(key, value) != value:  # earlier versions did not write every key
            raise InvalidOutput(
                f"{out}: its recordings have {key} = {shown(there[key])}; asked for is "
                f"{shown(value)}: take them up with the same settings or give another folder"
            )


def begin(out: Path, facts: Mapping[str, Any], bench: Bench, settings: CollectSettings) -> None:
    """Make the folder of a bench that answers, with what its recordings share and its model."""
    make_folder(out, dataset=True)
    write_toml(out / COLLECTION_FILE, facts)
    voltage, radius = bench.servo.read_health().voltage, settings.spool_radius
    model = starting_model(bench.servo.spec, settings.loop, voltage=voltage, spool_radius=radius)
    if not (out / MODEL_FILE).exists():  # one that is there may be edited by hand
        write_model(out / MODEL_FILE, model)
