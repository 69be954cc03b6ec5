"""Let a policy drive a finger, on a real bench or a virtual one, with every tick logged.

Without any hardware, goals from the arrow keys:
  tendon-newton deploy --policy policy.onnx --port virtual

On a bench that is plugged in; first by hand, then with the motor off, then for good:
  tendon-newton deploy --jog --port /dev/ttyUSB0
  tendon-newton deploy --policy policy.onnx --port /dev/ttyUSB0 --dry-run
  tendon-newton deploy --policy policy.onnx --port /dev/ttyUSB0 --load-cell-port /dev/ttyACM0
  --calibration cell.toml --goals stairs

A policy of several servos, all on one bus, with the IDs 1, 2, ...; and one of them by hand:
  tendon-newton deploy --policy policy.onnx --port virtual:finger_antagonist
  tendon-newton deploy --jog --port /dev/ttyUSB0 --servo-id 2

Does this policy still do what it did in that log?
  tendon-newton deploy --policy policy.onnx --replay deployments/policy_0.mcap

Keys: up and down move the goal, 0 to 9 set it; space or q lets the tendon out and ends the run; x
switches the motor off at once. Ctrl-C, a closed terminal and SIGTERM do what the space bar does.
Logs are recordings: `tendon-newton diagnose` and `tendon-newton plot` take them.
"""

from __future__ import annotations

import sys
from contextlib import closing
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from hardware.benches.bench import Bench
    from hardware.benches.bench_address import BenchAddress, DriveAddress
    from hardware.control.goals import Goals
    from hardware.control.operator import Operator
    from hardware.control.policy_runner import Policy
    from hardware.deployment.deploy import DeployOutcome
    from hardware.deployment.deploy_settings import DeploySettings
    from hardware.safety_rules.force_estimate import ForceEstimate
    from hardware.safety_rules.limits import SafetyLimits

JOG_RANGE = (-pi, 2.0 * pi)
"""Spool angles that a hand may reach [rad]: a tendon that begins too tight is let out."""
JOG_STEP = 0.1
"""By which a key moves the spool [rad]: 1.25 mm of tendon."""
JOG_GAIN, JOG_DUTY = 1.0, 0.25
"""Stiffness [1/rad] and greatest duty [1] of the loop under a hand: a press of a key overcomes the
gear's friction, and at standstill it pulls some 18 N at most."""
ROWS_MIN = 80
"""Rows of a log that is worth listing: a second."""


@dataclass(frozen=True, kw_only=True)
class DeployConfig:
    """Which policy, where the bench is, and how far it may go."""

    policy: Path | None = None
    """ONNX file of the policy with its card inside, or TorchScript where torch is installed."""
    port: str | None = None
    """Serial port of the servos, or virtual, or virtual:finger:3 for unit 3, or
    virtual:finger:3:friction (or :spool) for that unit worn."""
    goals: str = "keyboard"
    """Where goals come from: keyboard, stdin, udp:5005, udp:ADDRESS:PORT, stairs, a file of times
    [s] and angles [rad], or one angle [rad]."""
    goals_key: Path | None = None
    """File with a key of 16 bytes or more, with which goals over UDP are signed; those from other
    computers must be."""
    duration: float | None = None
    """Length [s]; without it the run ends with a key."""
    out: Path = Path("deployments")
    """Folder for the log; it becomes a dataset."""
    split: Literal["train", "test"] = "train"
    """Split of the log in that dataset."""
    dry_run: bool = False
    """Read and decide, but leave the motor off."""
    jog: bool = False
    """Move the spool by hand with the arrow keys, without a policy; home is where it stands."""
    replay: Path | None = None
    """Log whose observations are given to the policy again, to compare its actions."""
    trust: bool = False
    """Trust this TorchScript policy from now on; it is a program."""
    force_network: Path | None = None
    """ONNX file of a force network that estimates the tension where no load cell is."""
    bench: str | None = None
    """Bench under assets; unless given the virtual one that the port names, or finger."""
    load_cell_port: str | None = None
    """Serial port of the load cell; a virtual bench brings its own."""
    load_cell: str = "hx711_serial"
    """Kind of the load cell."""
    load_cell_rate: int = 20
    """Readings per second of the load cell: 80, 20 or 10 [Hz]."""
    calibration: Path | None = None
    """Calibration of the load cell; without one the tension is not known."""
    servo: str = "xc330_t288_t"
    """Kind of the servo; the policy's card must name the same."""
    servo_id: int = 1
    """ID of the servo on its bus."""
    further_servo_ids: tuple[int, ...] = ()
    """IDs of further servos, in the order of the asset's tendons; unless given the next ones."""
    further_load_cell_ports: tuple[str, ...] = ()
    """Serial ports of the load cells in their tendons."""
    further_calibrations: tuple[Path, ...] = ()
    """Calibrations of those load cells."""
    baud: int = 1_000_000
    """Rate of the bus [1/s]."""
    retries: int | None = None
    """How often an instruction to the servo is sent again, 4 ms each; 2 unless given."""
    spool_radius: float = 0.0125
    """Of the bench [m]; the policy's card must name the same."""
    rate: float = 80.0
    """Readings of the servo per second [Hz]; the policy's card must name the same."""
    policy_rate: float = 20.0
    """Policy steps per second [Hz]; the policy's card must name the same."""
    force_limit: float = 30.0
    """Tension at which the tendon is let out [N]."""
    temperature_limit: float = 65.0
    """Temperature at which it is let out [degC]."""
    faster_than_real_time: bool = False
    """Whether a virtual bench runs as fast as it can."""
    notes: str = ""
    """What is to be remembered with the log."""


def main(config: DeployConfig) -> None:
    """Deploy, replay or jog, and say what came of it."""
    from hardware.benches.bench import open_bench
    from hardware.control.keyboard import Keyboard
    from hardware.control.pilot import JogPilot, PolicyPilot
    from hardware.deployment.deploy import Deployment, deploy
    from hardware.stop_request import StopRequest
    from tendon_newton.cli.collect import Terminal

    policy = read_policy(config)
    if config.replay is not None:
        compare(policy, config.replay)
        return
    address = address_of(config, 1 if policy is None else policy.card.servo_count)
    settings = settings_of(config, policy)
    if policy is not None:
        from hardware.deployment.deploy_settings import refuse_mismatch

        refuse_mismatch(policy.card, settings, address)
        pilot = PolicyPilot(policy)
    else:
        pilot = JogPilot(settings.policy_rate, settings.loop.position_range)
    operator = Terminal()
    with (
        closing(goals_of(config, policy, settings)) as goals,
        StopRequest() as stop,
        operator,
        open_bench(address, operator.tell) as bench,
    ):
        get_ready(bench, operator)
        deployment = Deployment(
            bench=bench,
            pilot=pilot,
            settings=settings,
            goals=goals,
            policy=policy,
            estimate=estimate_of(config),
        )
        with Keyboard() as keyboard:
            if config.goals == "keyboard" and not keyboard.there and config.duration is None:
                operator.tell("No terminal: no keys move the goal; a signal ends the run.")
            outcome = deploy(deployment, free_log(config), keyboard, operator, stop)
    conclude(config, outcome)


def read_policy(config: DeployConfig) -> Policy | None:
    """Load the policy, or refuse words that contradict each other."""
    from hardware.control.policy_runner import load_policy
    from tendon_newton.errors import InvalidParameter

    if config.jog and (config.policy is not None or config.replay is not None):
        raise InvalidParameter("--jog moves the spool by hand; it takes neither policy nor replay")
    if config.jog and config.further_servo_ids:
        raise InvalidParameter("--jog moves one servo by hand; name it with --servo-id alone")
    if not config.jog and config.policy is None:
        raise InvalidParameter("a deployment needs --policy FILE, or --jog to move by hand")
    if config.port is None and config.replay is None:
        raise InvalidParameter("a deployment needs --port; without hardware: --port virtual")
    if config.policy is None:
        return None
    return load_policy(config.policy, trust=config.trust)


def bench_of(config: DeployConfig) -> str:
    """Return the bench's name under assets."""
    from hardware.virtual_bench.process import DEFAULT_BENCH, WORD

    kind, *named = (config.port or "").split(":")
    return config.bench or (named[0] if kind == WORD and named else "") or DEFAULT_BENCH


def address_of(config: DeployConfig, servos: int) -> BenchAddress:
    """Return where the bench is, with as many servos as the policy drives."""
    from hardware.benches.bench_address import BenchAddress
    from tendon_newton.errors import unknown_name
    from tendon_newton.mechanisms.asset_library import asset_files

    bench = bench_of(config)
    if bench not in (assets := asset_files()):
        raise unknown_name("bench", bench, assets)
    return BenchAddress(
        bench=bench,
        further=further_drives(config, servos),
        port=config.port or "",
        load_cell_port=config.load_cell_port,
        load_cell=config.load_cell,
        calibration=config.calibration,
        servo=config.servo,
        identifier=config.servo_id,
        baud=config.baud,
        retries=config.retries,
        load_cell_rate=config.load_cell_rate,
        lockstep=config.faster_than_real_time,
    )


def further_drives(config: DeployConfig, servos: int) -> tuple[DriveAddress, ...]:
    """Return where the servos behind the first are, with their load cells."""
    from hardware.benches.bench_address import DriveAddress
    from tendon_newton.errors import InvalidParameter

    own = range(config.servo_id + 1, config.servo_id + servos)
    identifiers = config.further_servo_ids or tuple(own)
    ports, calibrations = config.further_load_cell_ports, config.further_calibrations
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


def settings_of(config: DeployConfig, policy: Policy | None) -> DeploySettings:
    """Return rates and limits; the command range is the policy's, or a hand's."""
    from hardware.deployment.deploy_settings import DeploySettings, loops_of
    from hardware.safety_rules.safety_limits import limits_for
    from hardware.servos import SERVOS
    from hardware.servos.host_position_loop import HostPositionLoop
    from tendon_newton.errors import unknown_name

    if config.servo not in SERVOS:
        raise unknown_name("servo", config.servo, SERVOS)
    by_hand = HostPositionLoop(
        gain=JOG_GAIN, duty_limit=JOG_DUTY, offset=0.0, position_range=JOG_RANGE
    )
    loop, *further = (by_hand,) if policy is None else loops_of(policy.card)
    limits = limits_for(
        SERVOS[config.servo],
        bench_limits(config, jog=policy is None),
        clip=JOG_RANGE[1] if policy is None else policy.card.action_clip,
        load_cell_rate=float(config.load_cell_rate),
    )
    return DeploySettings(
        rate=config.rate,
        policy_rate=config.policy_rate,
        spool_radius=config.spool_radius,
        loop=loop,
        further_loops=tuple(further),
        limits=limits,
        duration=config.duration,
        dry=config.dry_run,
        unwind=policy is not None,
        notes=config.notes,
    )


def bench_limits(config: DeployConfig, *, jog: bool) -> SafetyLimits:
    """Return force, temperature and window; a hand may let the tendon out beyond home."""
    from hardware.safety_rules.limits import SafetyLimits

    low, high = SafetyLimits().position
    return SafetyLimits(
        force=config.force_limit,
        temperature=config.temperature_limit,
        position=(JOG_RANGE[0] - 0.5 if jog else low, high),
    )


def goals_of(config: DeployConfig, policy: Policy | None, settings: DeploySettings) -> Goals:
    """Return where goals come from; a hand's goal is the spool angle."""
    from hardware.control.goals import FixedGoal, open_goals

    if policy is None:
        return FixedGoal(0.0, settings.loop.position_range, JOG_STEP)
    return open_goals(config.goals, policy.card.goal_range, config.goals_key)


def estimate_of(config: DeployConfig) -> ForceEstimate | None:
    """Return what estimates the tension, if anything."""
    if config.force_network is None:
        return None
    from hardware.safety_rules.force_estimate import load_estimate

    return load_estimate(config.force_network, config.policy_rate)


def get_ready(bench: Bench, operator: Operator) -> None:
    """Ask for the bench to be made ready; without a terminal say what is taken for granted."""
    from hardware.collection.collect_plan import mount

    if sys.stdin.isatty():
        mount(bench, operator)
    elif not bench.address.virtual:
        operator.tell("Home is where the spool stands now: the tendon must be just taut.")
    for drive in bench.drives:
        if drive.load_cell is None or drive.calibration is None:
            of = f" of servo {drive.servo.identifier}" if bench.further else ""
            operator.tell(f"No calibrated load cell: the tension{of} is not measured.")


def free_log(config: DeployConfig) -> Path:
    """Return a path for the log that nothing has yet."""
    from hardware.collection.collect_plan import free_name
    from tendon_newton.cli.output import make_folder

    folder = make_folder(config.out)
    stem = "jog" if config.policy is None else config.policy.stem
    return folder / f"{free_name(folder, stem)}.mcap"


def compare(policy: Policy | None, path: Path) -> None:
    """Say how a policy's actions compare with those in a log."""
    from hardware.deployment.deploy_replay import DIFFERENCE, replay_log
    from tendon_newton.errors import InvalidRecording

    assert policy is not None
    report = replay_log(policy, path)
    print(f"{path}: {report.text}")
    if not report.same:
        raise InvalidRecording(
            f"{path}: the policy must want what stands in its log within {DIFFERENCE:g} rad; it "
            "does not: another file, or another engine"
        )


def conclude(config: DeployConfig, outcome: DeployOutcome) -> None:
    """Say what came of it, and list the log as a recording; what ended it is said last."""
    from tendon_newton.errors import TendonNewtonError

    trips = ", ".join(f"{name} {count}" for name, count in outcome.trips.items()) or "none"
    print(
        f"{outcome.path}: {outcome.rows} rows, {outcome.missed} missed, {outcome.steps} steps; "
        f"ended: {outcome.ended}\npacing: {outcome.pacing.text}\nsafety rules: {trips}"
    )
    try:
        if outcome.path is not None and outcome.rows >= ROWS_MIN and not config.dry_run:
            enlist(config, outcome.path.name)
    except TendonNewtonError as error:
        if outcome.fault is None:
            raise
        print(f"!! {error}")
    if outcome.fault is not None:
        raise outcome.fault


def enlist(config: DeployConfig, file: str) -> None:
    """List a log as a recording of its folder."""
    from tendon_newton.data.dataset import list_recording

    slow = config.calibration is not None or (config.port or "").startswith("virtual")
    list_recording(
        config.out,
        file,
        bench=bench_of(config),
        split=config.split,
        start="first_row",
        load_cell_rate=float(config.load_cell_rate)
        if slow and config.load_cell_rate < 0.9 * config.rate
        else None,
    )
