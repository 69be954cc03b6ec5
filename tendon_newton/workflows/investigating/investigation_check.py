"""Refuse an investigation that cannot be made, before anything is written."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import BENCHES
from tendon_hardware.control.operator import Operator
from tendon_hardware.doctor import examine, ports_of
from tendon_hardware.errors import BenchNotReady
from tendon_hardware.load_cells.calibration import load_calibration
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.designed_command import check_run_length
from tendon_newton.diagnosis.next_experiment.task_file import read_task
from tendon_newton.errors import InvalidParameter, listed, unknown_name
from tendon_newton.workflows.collection import address_of, settings_of
from tendon_newton.workflows.options import InvestigateOptions

SERIAL = "a serial port"
"""Stands for the port of a real bench, which may have another name after it was unplugged."""


@dataclass(frozen=True, kw_only=True)
class Ready:
    """How all runs of an investigation are recorded."""

    settings: CollectSettings
    addresses: Mapping[str, BenchAddress]  # Address of each bench, by its name


def check(options: InvestigateOptions, *, budget: float) -> Ready:
    """Look at all options before the first of them is used.

    Args:
        budget: Time that recordings may take [s].

    Raises:
        TendonNewtonError: An option cannot be what it must be, or two contradict each other.
    """
    check_run_length(options.run_length)
    check_benches(options.benches)
    fewest = (1 + len(first_runs(options.benches))) * options.run_length
    if budget < fewest:
        raise InvalidParameter(
            f"--budget must hold the first runs on {listed(options.benches)} and one to test, "
            f"which take {fewest:g} s with --run-length {options.run_length:g}; it is {budget:g} s"
        )
    addresses = {
        bench: address_of(
            options, bench, port=options.port, load_cell_rate=options.virtual_load_cell_rate
        )
        for bench in options.benches
    }
    for address in addresses.values():
        if address.virtual:
            _ = address.unit  # a word without a unit is refused here
    if options.calibration is not None:
        load_calibration(options.calibration)
    if options.known is not None:
        load_model(options.known)
    if options.task is not None:
        read_task(options.task, Setting(bench=options.benches[0]))
    return Ready(settings=settings_of(options, seed=options.seed), addresses=addresses)


def first_runs(benches: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Return bench and excitation of the first runs that are learned from.

    Each bench is seen once, since a cause may show on one alone. A bench that stands alone is seen
    twice: one recording does not tell how much another would differ.
    """
    if len(benches) == 1:
        return tuple((benches[0], excitation) for excitation in ("random_steps", "ramps"))
    return tuple((bench, "random_steps") for bench in benches)


def check_benches(benches: tuple[str, ...]) -> None:
    """Refuse names of no bench, and one that is given twice."""
    if not benches:
        raise InvalidParameter(
            f"--benches must name the bench that is mounted, and others that you have, of "
            f"{listed(BENCHES)}; it names none"
        )
    for bench in benches:
        if bench not in BENCHES:
            raise unknown_name("bench with a tendon for --benches", bench, BENCHES)
    if len(set(benches)) < len(benches):
        raise InvalidParameter(f"--benches names each bench once; it is {listed(benches)}")


def examine_bench(options: InvestigateOptions, operator: Operator) -> None:
    """Look at ports, servo, load cell and clock, as the verb ``doctor`` does; no motor moves.

    Raises:
        BenchNotReady: Something must be mended before data is worth taking.
    """
    clock, port, cell = ports_of(options.port, options.load_cell_port, options.servo)
    faults: list[str] = []
    for seen in examine(port, cell, clock=clock):
        if seen.verdict != "good":
            operator.announce(f"  {seen.subject}: {seen.found}")
        if seen.verdict == "fix":
            faults.append(f"{seen.subject}: {seen.found}; {seen.remedy}")
    if faults:
        raise BenchNotReady(f"the bench must be mended before it is recorded: {'; '.join(faults)}")


def binding(options: InvestigateOptions) -> dict[str, Any]:
    """Return the options that all runs of an investigation share, by their names."""
    return {
        "port": options.port if options.port.startswith("virtual") else SERIAL,
        "benches": list(options.benches),
        "run-length": options.run_length,
        "servo": options.servo,
        "rate": options.rate,
        "spool-radius": options.spool_radius,
        "seed": options.seed,
    }
