"""Let a policy drive a bench that options name, and keep its log as a recording."""

import sys
from contextlib import ExitStack, closing
from dataclasses import replace
from math import pi
from pathlib import Path

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.benches.bench_address import BenchAddress, DriveAddress
from tendon_hardware.collection.collect_plan import enlist, free_name, mount
from tendon_hardware.control.goals import FixedGoal, Goals, open_goals
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.control.operator import Operator
from tendon_hardware.control.pilot import BallPilot, JogPilot, Pilot, PolicyPilot
from tendon_hardware.control.policy_runner import Policy, load_policy
from tendon_hardware.deployment.ball_watch import BallWatch
from tendon_hardware.deployment.deploy import Deployment, DeployOutcome, deploy
from tendon_hardware.deployment.deploy_replay import DIFFERENCE, replay_log
from tendon_hardware.deployment.deploy_settings import DeploySettings, loops_of, refuse_mismatch
from tendon_hardware.deployment.turning_report import turning_text
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.force_estimate import load_estimate
from tendon_hardware.safety_rules.rule_limits import limits_for
from tendon_hardware.servos import find_servo
from tendon_hardware.servos.host_position_loop import HostPositionLoop, no_stronger
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench.process import DEFAULT_BENCH, WORD
from tendon_newton.data.dataset import FILE_NAME, listed_files
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.formats.mcap_file import breaks_off
from tendon_newton.errors import InvalidParameter, InvalidRecording, TendonNewtonError
from tendon_newton.mechanisms.asset_library import asset_files, unknown_asset
from tendon_newton.workflows.collection import address_of
from tendon_newton.workflows.options import DeployOptions, policy_file

JOG_RANGE = (-pi, 2.0 * pi)
"""Spool angles that a hand may reach [rad]: a tendon that begins too tight is let out."""
JOG_STEP = 0.1  # By which a key moves the spool [rad]: 1.25 mm of tendon
JOG_GAIN, JOG_DUTY = 1.0, 0.25
"""Stiffness [1/rad] and greatest duty [1] of the loop under a hand: a press of a key overcomes the
gear's friction, and at standstill it pulls some 18 N at most."""
ROWS_MIN = 80  # Rows of a log that is worth listing: a second


def drive(options: DeployOptions, operator: Operator) -> DeployOutcome:
    """Let a policy, or a hand at the keys, drive the bench; its log becomes a recording.

    Raises:
        InvalidParameter: Options contradict each other.
        InvalidPolicyFile: The policy is none, or not one for this bench.
        TendonNewtonError: What ended the run against the operator's will, told last.
    """
    policy = read_policy(options)
    address = bench_address(options, policy)
    settings = settings_of(options, policy)
    if policy is not None:
        refuse_mismatch(policy.card, settings, address)
        if (trained := policy.card.training.finger) not in (address.bench, None):
            operator.tell(f"The policy was trained for {trained}; this bench is {address.bench}.")
    network, servo = options.force_network, options.servo
    estimate = None if network is None else load_estimate(network, options.policy_rate, servo)
    with (
        closing(goals_of(options, policy, settings)) as goals,
        StopRequest() as stop,
        open_bench(address, operator.tell) as bench,
        ExitStack() as stack,
    ):
        if settings.duration is None:
            settings = replace(settings, duration=goals.length)
        get_ready(bench, operator)
        watch = None
        if policy is not None and policy.card.turning is not None:
            watch = BallWatch(bench, policy.card.turning, operator)
            watch.open()
            stack.callback(watch.close)
        deployment = Deployment(
            bench=bench,
            pilot=pilot_of(policy, settings, watch),
            settings=settings,
            goals=goals,
            policy=policy,
            estimate=estimate,
            watch=watch,
        )
        with Keyboard() as keyboard:
            if settings.duration is None and not keyboard.there:
                tell_endless(options, operator)
            outcome = deploy(deployment, free_log(options, operator), keyboard, operator, stop)
    if policy is not None and policy.card.turning is not None and outcome.path is not None:
        operator.announce(turning_text(outcome.path, policy.card.turning))
    conclude(options, address.bench, outcome, operator)
    return outcome


def pilot_of(policy: Policy | None, settings: DeploySettings, watch: BallWatch | None) -> Pilot:
    """Return who drives: a policy, with a ball or without, or a hand at the keys."""
    if policy is None:
        return JogPilot(settings.policy_rate, settings.loop.position_range)
    return PolicyPilot(policy) if watch is None else BallPilot(policy, watch)


def tell_endless(options: DeployOptions, operator: Operator) -> None:
    """Say what ends a run that nobody's keys can end; refuse one that would fill the disk.

    Raises:
        InvalidParameter: The run is as fast as the computer, and nothing would end it.
    """
    if options.faster_than_real_time:
        raise InvalidParameter(
            "--duration must say how long a run faster than real time lasts where no terminal's "
            "keys can end it and its goals have no end"
        )
    if options.goals == "keyboard":
        operator.tell("No terminal: no keys move the goal; a signal ends the run.")


def replay(options: DeployOptions, operator: Operator) -> None:
    """Give a policy the observations of a log again, and tell how its actions compare.

    Raises:
        InvalidRecording: They are others.
    """
    policy, path = read_policy(options), options.replay
    assert policy is not None
    assert path is not None
    report = replay_log(policy, path)
    operator.announce(f"{path}: {report.text}")
    if not report.same:
        raise InvalidRecording(
            f"{path}: the policy must want what stands in its log within {DIFFERENCE:g} rad; it "
            "does not: another file, or another engine"
        )


def read_policy(options: DeployOptions) -> Policy | None:
    """Load the policy, or refuse words that contradict each other."""
    if options.jog and (options.policy is not None or options.replay is not None):
        raise InvalidParameter("--jog moves the spool by hand; it takes neither policy nor replay")
    if options.jog and options.further_servo_ids:
        raise InvalidParameter("--jog moves one servo by hand; name it with --servo-id alone")
    if not options.jog and options.policy is None:
        raise InvalidParameter("a deployment needs --policy FILE, or --jog to move by hand")
    if options.port is None and options.replay is None:
        raise InvalidParameter("a deployment needs --port; without hardware: --port virtual")
    if options.policy is None:
        return None
    return load_policy(policy_file(options.policy), trust=options.trust)


def bench_address(options: DeployOptions, policy: Policy | None) -> BenchAddress:
    """Return where the bench is, with as many servos as the policy drives."""
    kind, *named = (options.port or "").split(":")
    assets, trained = asset_files(), None if policy is None else policy.card.training.finger
    found = (*named, "")[0] if kind == WORD else trained if trained in assets else None
    bench = options.bench or found or DEFAULT_BENCH
    if bench not in assets:
        raise unknown_asset("bench", bench)
    servos = 1 if policy is None else policy.card.servo_count
    address = address_of(
        options,
        bench,
        port=options.port or "",
        further=further_drives(options, servos),
    )
    return replace(address, camera_port=options.camera_port)


def further_drives(options: DeployOptions, servos: int) -> tuple[DriveAddress, ...]:
    """Return where the servos behind the first are, with their load cells."""
    own = range(options.servo_id + 1, options.servo_id + servos)
    identifiers = options.further_servo_ids or tuple(own)
    ports, calibrations = options.further_load_cell_ports, options.further_calibrations
    for words, given in (("load-cell-ports", ports), ("calibrations", calibrations)):
        if len(given) not in (0, len(identifiers)):
            raise InvalidParameter(
                f"--further-{words} has one for each of {len(identifiers)} further servos; "
                f"{len(given)} are given"
            )
    return tuple(
        DriveAddress(
            identifier=identifier,
            load_cell_port=ports[place] if ports else None,
            calibration=calibrations[place] if calibrations else None,
        )
        for place, identifier in enumerate(identifiers)
    )


def settings_of(options: DeployOptions, policy: Policy | None) -> DeploySettings:
    """Return rates and limits; the command range is the policy's, or a hand's."""
    spec = find_servo(options.servo)
    by_hand = HostPositionLoop(
        gain=JOG_GAIN, duty_limit=JOG_DUTY, offset=0.0, position_range=JOG_RANGE
    )
    by_hand = no_stronger(by_hand, spec)
    loop, *further = (by_hand,) if policy is None else loops_of(policy.card)
    low, high = SafetyLimits().position
    if policy is None:  # a hand may let the tendon out beyond home
        low = JOG_RANGE[0] - 0.5
    limits = limits_for(
        spec,
        SafetyLimits(
            force=options.force_limit, temperature=options.temperature_limit, position=(low, high)
        ),
        clip=JOG_RANGE[1] if policy is None else policy.card.action_clip,
        load_cell_rate=float(options.load_cell_rate),
    )
    return DeploySettings(
        rate=options.rate,
        policy_rate=options.policy_rate,
        spool_radius=options.spool_radius,
        loop=loop,
        further_loops=tuple(further),
        limits=limits,
        duration=options.duration,
        dry=options.dry_run,
        unwind=policy is not None,
        notes=options.notes,
    )


def goals_of(options: DeployOptions, policy: Policy | None, settings: DeploySettings) -> Goals:
    """Return where goals come from; a hand's goal is the spool angle."""
    if policy is None:
        return FixedGoal(0.0, settings.loop.position_range, JOG_STEP)
    return open_goals(options.goals, policy.card.goal_range)


def get_ready(bench: Bench, operator: Operator) -> None:
    """Ask for the bench to be made ready; without a terminal say what is taken for granted."""
    if sys.stdin.isatty():
        mount(bench, operator)
    elif not bench.address.virtual:
        operator.tell("Home is where the spool stands now: the tendon must be just taut.")
    for drive in bench.drives:
        if drive.load_cell is None or drive.calibration is None:
            of = f" of servo {drive.servo.identifier}" if len(bench.drives) > 1 else ""
            operator.tell(f"No calibrated load cell: the tension{of} is not measured.")


def free_log(options: DeployOptions, operator: Operator) -> Path:
    """Return a path for the log that nothing has yet; tell what killed deployments have left."""
    # benches side by side log into one
    folder = make_folder(options.out, shared=True, dataset=True)
    files = listed_files(folder)  # a list that cannot be read is told before a motor runs
    for log in sorted(folder.glob("*.mcap")):
        if log.name not in files and breaks_off(log):
            operator.tell(
                f"{log}: is in no {FILE_NAME}, as its deployment was killed or goes on; once it is "
                "over, list it there to use it"
            )
    stem = "jog" if options.policy is None else options.policy.stem
    return folder / f"{free_name(folder, stem)}.mcap"


def conclude(
    options: DeployOptions, bench: str, outcome: DeployOutcome, operator: Operator
) -> None:
    """Say what came of it, and list the log as a recording; what ended it is raised last."""
    trips = ", ".join(f"{name} {count}" for name, count in outcome.trips.items()) or "none"
    operator.announce(
        f"{outcome.path}: {outcome.rows} rows, {outcome.missed} missed, {outcome.steps} steps; "
        f"ended: {outcome.ended}\npacing: {outcome.pacing.text}\nsafety rules: {trips}"
    )
    try:
        if outcome.path is not None and outcome.rows >= ROWS_MIN and not options.dry_run:
            forces = options.calibration is not None or (options.port or "").startswith(WORD)
            cell_rate = float(options.load_cell_rate) if forces else None
            enlist(outcome.path, bench, options.split, options.rate, cell_rate)
    except TendonNewtonError as error:
        if outcome.fault is None:
            raise
        operator.tell(str(error))
    if outcome.fault is not None:
        raise outcome.fault
