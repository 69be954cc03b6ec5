"""Faults around a run: settings that blind a rule, strangers, two servos with one ID, a full disk.

Each takes the number of its run and fails where nothing was done against the fault; those that can
be timed return the time [s].
"""

import contextlib
import os
import resource
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect_plan import COLLECTION_FILE, collect
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.control.goal_lines import LineGoals
from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.errors import RuleOutOfReach, SharedIdentifier
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.force_estimate import ForceEstimate
from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench import Faults, LockstepBench
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.errors import InvalidOutput
from tests.faults import injections as on
from tests.faults.cases import ALLOWED, SETTINGS
from tests.hardware.deploy.runs import Flight
from tests.hardware.silent_operator import SilentOperator
from tests.train.actuator.network_files import card_of as network_card

CALM = ForceEstimate(network_card("mlp"), lambda window: 0.0)
STEP = 0.05  # Policy step, and with it the greatest age of a goal [s]
LATE = 0.03  # What a busy machine may add to an age [s]


def key(word: bytes, rule: str, k: int) -> float:
    """Press a key on a terminal."""
    master, slave = os.openpty()
    try:
        flight = Flight(settings=SETTINGS, keyboard=Keyboard(slave), after=0.4 + 0.0137 * k)
        flight.fault = lambda bench, stop: os.write(master, word) and None
        outcome = flight.fly()
    finally:
        os.close(master)
        os.close(slave)
    assert outcome.fault is None
    assert not flight.torque_after
    assert flight.latency(rule) <= ALLOWED
    return flight.latency(rule)


@contextlib.contextmanager
def full_disk(size: int) -> Iterator[None]:
    """Let no file grow beyond a size [bytes]."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limit[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)


def full_log(k: int) -> None:
    """A log that cannot grow: the tendon is let out, and the reason names the file."""
    with TemporaryDirectory() as folder:
        flight = Flight(settings=SETTINGS, path=Path(folder) / "run.mcap")
        with full_disk(50_000 + 1000 * k):
            outcome = flight.fly()
    assert "run.mcap" in str(outcome.fault)
    assert outcome.trips["log"] == 1
    assert flight.angle_after < 0.1
    assert not flight.torque_after


def full_folder(k: int) -> None:
    """A folder on a full disk: the error names the file, and the folder can be used afterwards."""
    run = PlannedRun(name="run", bench="finger", excitation="sine", duration=1.0 + 0.01 * k)
    address = BenchAddress(bench="finger", port="virtual", lockstep=True)
    with TemporaryDirectory() as folder, StopRequest() as stop:
        words = (address, [run], CollectSettings(settle=0.0), Path(folder), SilentOperator(), stop)
        with full_disk(k % 10), pytest.raises(InvalidOutput, match=COLLECTION_FILE):
            collect(*words, title="short")
        assert list(Path(folder).iterdir()) == []
        assert collect(*words, title="short").left == 0


def two_from_the_start(k: int) -> None:
    """Two servos with one ID: named as that before the motor is on."""
    bench = LockstepBench(draw_unit("finger", k), faults=Faults(doubled_replies=1.0))
    servo = BusServo(SERVOS["xc330_t288_t"], bench.servo_port(), clock=bench.clock)
    with pytest.raises(SharedIdentifier, match="two answer as 1"):
        servo.open()


def two_in_the_run(k: int) -> None:
    """A second servo that is plugged in during a run: named, and the motor is off."""
    flight = Flight(settings=SETTINGS, after=0.4 + 0.0137 * k, fault=on.worse(doubled_replies=1.0))
    outcome = flight.fly()
    assert isinstance(outcome.fault, SharedIdentifier), outcome.ended
    assert not flight.torque_after


def refused(limits: DeployLimits, said: str, **words: object) -> None:
    """Require that a deployment is refused before the motor is on, by a rule's name."""
    flight = Flight(settings=DeploySettings(duration=1.0, limits=limits), **words)  # pyright: ignore
    with pytest.raises(RuleOutOfReach, match=said):
        flight.fly()


def blind_rules(k: int) -> None:
    """Limits beyond what a sensor can say are refused, each by the rule's name."""
    more = 0.1 * k
    refused(
        DeployLimits(bench=SafetyLimits(force=21.0 + more)),
        "tension",
        load_cell=False,
        estimate=CALM,
    )
    refused(DeployLimits(bench=SafetyLimits(temperature=70.0 + more)), "temperature")
    refused(DeployLimits(current=0.8 + more), "current")
    refused(DeployLimits(voltage=(6.5, 7e3 + more)), "voltage")
    refused(DeployLimits(voltage=(0.0, 12.0 + more)), "voltage")
    refused(DeployLimits(skipped_ticks=7 + k), "loop_overrun")
    refused(DeployLimits(bench=SafetyLimits(position=(-0.5, 4e6 + k))), "position_window")


def absurd_words(k: int) -> None:
    """Absurd limits and unknown benches are refused in one line before a port is opened."""
    for words, said in (
        (["--force-limit", f"1e{3 + k % 9}"], "limit of force"),
        (["--temperature-limit", f"1e{3 + k % 9}"], "limit of temperature"),
        (["--bench", "nonsense"], "No bench named 'nonsense'"),
    ):
        assert said in program("deploy", "--jog", "--port", "/dev/no_such_port", *words)


def closed_stream(k: int) -> None:
    """A closed standard stream is one line, not a traceback."""
    for closed in ("0<&-", "1>&-"):
        assert "must be open" in program("deploy", "--jog", "--port", "virtual", shell=closed)


def program(*words: str, shell: str = "") -> str:
    """Run the program, require that it fails with one line, and return it."""
    command = [sys.executable, "-m", "tendon_newton", *words]
    if shell:
        command = ["sh", "-c", f'exec "$@" {shell}', "sh", *command]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120.0, check=False)
    assert done.returncode == 2, done
    (line,) = done.stderr.splitlines()
    return line


def many_goals(k: int) -> float:
    """A planner that sends 500 to 2,400 goals a second: none is older than a policy step."""
    end, planner = os.pipe()
    goals = LineGoals(0.0, end)
    ending = threading.Event()
    start = time.monotonic()

    def send() -> None:
        while not ending.wait(1.0 / (500.0 + 100.0 * k)):
            os.write(planner, f"{time.monotonic() - start:.6f}\n".encode())

    sending = threading.Thread(target=send)
    sending.start()
    ages = []
    try:
        while time.monotonic() - start < 1.0:
            time.sleep(STEP)
            goal = goals.value(0.0)
            ages.append(time.monotonic() - start - goal)
    finally:
        ending.set()
        sending.join()
        os.close(planner)
        os.close(end)
    assert max(ages) <= STEP + LATE, f"{max(ages):.3f} s"
    return max(ages)


OUTSIDE: dict[str, Callable[[int], float | None]] = {
    "key x": lambda k: key(b"x", "kill", k),
    "the space bar": lambda k: key(b" ", "operator", k),
    "key q": lambda k: key(b"q", "operator", k),
    "a log on a full disk": full_log,
    "a folder on a full disk": full_folder,
    "two servos with one ID": two_from_the_start,
    "a second servo with the ID, in the run": two_in_the_run,
    "limits beyond their sensors": blind_rules,
    "absurd limits, unknown benches": absurd_words,
    "a closed standard stream": closed_stream,
    "500 goals a second and more": many_goals,
}
"""Faults beside those of a run in lockstep."""
