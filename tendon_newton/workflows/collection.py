"""Record a plan or a single run on the bench that options name."""

from dataclasses import replace

from tendon_hardware.benches.bench_address import BenchAddress, DriveAddress
from tendon_hardware.collection.collect_plan import SINGLE_RUNS, Collection, collect, free_name
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import BENCHES, PlannedRun, find_plan
from tendon_hardware.control.operator import Operator
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.servos import find_servo
from tendon_hardware.servos.host_position_loop import HostPositionLoop, no_stronger
from tendon_hardware.stop_request import StopRequest
from tendon_newton.mechanisms.asset_library import asset_files, asset_folder, unknown_asset
from tendon_newton.workflows.options import BenchOptions, CollectOptions

FINGER = BENCHES[0]


def record(options: CollectOptions, operator: Operator) -> Collection:
    """Record what is missing, and return what came of it."""
    plan = planned(options)
    settings = settings_of(options, radius_of(options, operator))
    address = address_of(options, plan[0].bench, port=options.port)
    title = options.plan or SINGLE_RUNS
    with StopRequest() as stop:
        return collect(address, plan, settings, options.out, operator, stop, title=title)


def radius_of(options: CollectOptions, operator: Operator) -> float:
    """Return the radius of the spool [m]: the given one, or the asset's where USD can be read."""
    if options.spool_radius is not None:
        return options.spool_radius
    radius = CollectSettings.spool_radius
    if options.bench in BENCHES:
        return radius
    try:
        from tendon_newton.device_code.quiet import quiet_warp
        from tendon_newton.workflows.importing import spool_radius

        quiet_warp()
        return spool_radius(options.bench)
    except ModuleNotFoundError:
        operator.tell(
            f"USD cannot be read here: the spool of {options.bench} is taken to have a radius of "
            f"{radius:g} m; if it has another one, give --spool-radius."
        )
        return radius


def settings_of(options: CollectOptions, spool_radius: float) -> CollectSettings:
    """Return rates, loop and limits of all recordings, with a spool of some radius [m]."""
    return CollectSettings(
        rate=options.rate,
        command_rate=options.command_rate,
        loop=no_stronger(HostPositionLoop(), find_servo(options.servo)),
        limits=SafetyLimits(force=options.force_limit, temperature=options.temperature_limit),
        seed=options.seed,
        spool_radius=spool_radius,
        notes=options.notes,
    )


def address_of(
    options: BenchOptions,
    bench: str,
    *,
    port: str,
    further: tuple[DriveAddress, ...] = (),
) -> BenchAddress:
    """Return where a bench is.

    Args:
        bench: Name under ``assets/``.
        port: Serial port of the servos, or the word for a virtual bench.
    """
    return BenchAddress(
        bench=bench,
        further=further,
        port=port,
        load_cell_port=options.load_cell_port,
        load_cell=options.load_cell,
        calibration=options.calibration,
        servo=options.servo,
        identifier=options.servo_id,
        baud=options.baud,
        retries=options.retries,
        load_cell_rate=options.load_cell_rate,
        lockstep=options.faster_than_real_time,
    )


def planned(options: CollectOptions) -> tuple[PlannedRun, ...]:
    """Return what is to be recorded; a finger of the user's own stands in a plan for ours."""
    own = options.bench not in BENCHES
    if own and (options.bench not in asset_files() or (asset_folder() / options.bench).is_dir()):
        raise unknown_asset("bench with a tendon", options.bench, BENCHES)
    if options.plan is not None:
        return tuple(
            replace(run, bench=options.bench, name=run.name.replace(FINGER, options.bench, 1))
            if own and run.bench == FINGER
            else run
            for run in find_plan(options.plan)
        )
    words = [options.bench, options.excitation, options.obstacle]
    stem = "_".join(word for word in words if word != "free")
    return (
        PlannedRun(
            name=free_name(options.out, stem),
            bench=options.bench,
            excitation=options.excitation,
            duration=options.duration,
            split=options.split,
            obstacle=options.obstacle,
        ),
    )
