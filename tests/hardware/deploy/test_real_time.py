"""The whole program beside a virtual bench in real time: steady, and stopped when it is killed."""

import time
from pathlib import Path

import pytest

from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.virtual_bench import Faults, VirtualPorts
from tests.faults.kill import ATTEMPTS, BUSY, HARMS, WAYS, Program, policy_file, released
from tests.hardware.deploy.policies import card_of, network, write_onnx
from tests.hardware.deploy.runs import Flight
from tests.interpreters import run_without


def test_five_seconds_under_packet_loss(tmp_path: Path) -> None:
    """With 1 % of the answers lost the loop keeps its rate and the run its length."""
    for attempt in range(ATTEMPTS):
        flight = Flight(
            path=tmp_path / f"{attempt}.mcap",
            lockstep=False,
            settings=DeploySettings(duration=5.0),
            fault=lambda bench, stop: bench.controls.set_faults(Faults(dropped_replies=0.01)),
        )
        outcome = flight.fly()
        if not any(word in outcome.ended for word in BUSY):
            break
    assert outcome.fault is None, outcome.ended
    assert outcome.missed <= 0.01 * outcome.pacing.ticks
    assert outcome.pacing.ticks + outcome.pacing.overruns >= 400


LOADING = {"evaluate-policy"}
"""What loads the simulator first, for seconds, and drives as `deploy` and `collect` do."""


@pytest.mark.parametrize(
    "way",
    [
        *sorted(WAYS.keys() - LOADING),
        *(pytest.param(way, marks=pytest.mark.slow) for way in sorted(LOADING)),
    ],
)
def test_a_killed_program_leaves_a_motor_without_force(tmp_path: Path, way: str) -> None:
    """The servo's bus watchdog stops it 250 ms after ``kill -9`` at the latest, whoever drove."""
    with VirtualPorts(load_cell_rate=80) as ports:
        released(ports, WAYS[way], HARMS["killed"], tmp_path, 0.3)


def test_a_recording_that_was_stopped_stays_off(tmp_path: Path) -> None:
    """Stopped for two seconds and let go on: nobody has asked for the motor."""
    with VirtualPorts(load_cell_rate=80) as ports:
        released(ports, WAYS["collect"], HARMS["stopped for 2 s"], tmp_path, 0.3)


@pytest.mark.parametrize(
    "harm", ["unplugged for 1.5 s and killed", "killed with its keeper", "robbed of its keeper"]
)
def test_a_motor_without_a_watchdog_lets_go(tmp_path: Path, harm: str) -> None:
    """Where nobody can reach a Feetech servo its own firmware ends a pull, within 0.6 s."""
    with VirtualPorts(servo="sts3215") as ports:
        released(ports, WAYS["collect"], HARMS[harm], tmp_path, 0.3, "sts3215")


def test_a_terminated_program_lets_the_tendon_out(tmp_path: Path) -> None:
    """SIGTERM, as a service manager sends it: the log is closed, the motor off, the exit code 0."""
    policy = policy_file(tmp_path)
    with VirtualPorts(load_cell_rate=80) as ports:
        for attempt in range(ATTEMPTS):
            out = tmp_path / str(attempt)
            with Program(ports=ports, way=WAYS["deploy"], out=out, policy=policy) as program:
                program.await_pull()
                time.sleep(0.5)
                program.process.terminate()
                said = program.end()
            if not any(word in said for word in BUSY):
                break
        assert program.process.returncode == 0, said
        assert "ended: stopped by SIGTERM" in said
        assert ports.state().duty == 0.0
        assert ports.state().angle < 0.2
    assert (out / "policy_0.mcap").exists()


MEMORY_MAX = 150.0  # Resident memory of a deployment [MB]; a Pi with 2 GB has other things to do


def test_a_deployment_runs_and_is_drawn_without_anything_else(tmp_path: Path) -> None:
    """Policy, log, replay and picture in an interpreter without torch, in 150 MB."""
    policy = write_onnx(tmp_path / "policy.onnx", network(), card_of().to_json())
    said = run_without(f"""
import re
from pathlib import Path
from tendon_newton.cli import main
words = ["deploy", "--policy", {str(policy)!r}, "--port", "virtual", "--faster-than-real-time"]
words += ["--goals", "1.0", "--duration", "2", "--out", {str(tmp_path / "runs")!r}]
assert main(words) == 0
log = {str(tmp_path / "runs" / "policy_0.mcap")!r}
assert main(["deploy", "--policy", {str(policy)!r}, "--replay", log]) == 0
assert main(["plot", log]) == 0
print(int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1e3)
""")
    assert float(said.splitlines()[-1]) < MEMORY_MAX
    assert (tmp_path / "runs" / "policy_0.svg").exists()
