"""The whole program beside a virtual bench in real time: steady, and stopped when it is killed."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from hardware.deploy_settings import DeploySettings
from hardware.virtual_bench import Faults, VirtualPorts
from tests.hardware.deploy.policies import Proportional, card_of, write_onnx
from tests.hardware.deploy.runs import Flight, calibration_files

START = 60.0
"""Longest start of the program on a busy machine [s]."""


ATTEMPTS = 3
"""Runs before a busy machine is no excuse: it may stop any of them for 0.2 s, which is a rule."""
BUSY = ("no instruction came for", "has been silent for", "must answer to")
"""What a run says that such a machine has ended."""


def test_five_seconds_under_packet_loss(tmp_path: Path) -> None:
    """With 1 % of the answers lost the loop keeps its rate and the run its length.

    Ticks that the scheduler of a busy machine takes are counted apart.
    """
    for attempt in range(ATTEMPTS):
        flight = Flight(
            path=tmp_path / f"{attempt}.mcap", lockstep=False,
            settings=DeploySettings(duration=5.0),
            fault=lambda bench, stop: bench.controls.set_faults(Faults(dropped_replies=0.01)),
        )  # fmt: skip
        outcome = flight.fly()
        if not any(word in outcome.ended for word in BUSY):
            break
    assert outcome.fault is None, outcome.ended
    assert outcome.missed <= 0.01 * outcome.pacing.ticks
    assert outcome.pacing.ticks + outcome.pacing.overruns >= 400


class Program:
    """The program in a process of its own, on the ports of a bench that outlives it."""

    def __init__(self, ports: VirtualPorts, policy: Path, out: Path, *words: str) -> None:
        self.ports = ports
        self.begin = time.monotonic()
        command = [
            *(sys.executable, "-m", "tendon_newton", "deploy", "--policy", str(policy)),
            *("--port", ports.servo_port, "--load-cell-port", ports.load_cell_port),
            *("--calibration", str(calibration_files("finger", 80)[0]), "--load-cell-rate", "80"),
            *("--goals", "1.0", "--out", str(out), "--retries", "8", *words),
        ]
        self.process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    def await_motion(self) -> bool:
        """Wait until the motor is driven; return whether it is, or the program has ended."""
        while self.ports.state().duty == 0.0:
            took = time.monotonic() - self.begin
            assert took < START
            if self.process.poll() is not None:
                return False
            time.sleep(0.01)
        return True

    def kill(self) -> float:
        """Kill it without warning; return how long the motor ran on, on the bench's clock [s]."""
        begin = self.ports.state().time
        self.process.kill()
        self.process.wait()
        while (state := self.ports.state()).duty != 0.0 and state.time - begin < 2.0:
            time.sleep(0.002)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return state.time - begin


def moving(ports: VirtualPorts, policy: Path, out: Path) -> Program:
    """Start the program and wait until it drives the motor."""
    for _ in range(ATTEMPTS):
        program = Program(ports, policy, out)
        if program.await_motion():
            return program
        said = program.process.communicate()[0].decode()
        assert any(word in said for word in BUSY), said
    raise AssertionError(f"the program did not start {ATTEMPTS} times: {said}")


@pytest.mark.parametrize("count", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_a_killed_program_leaves_a_motor_that_stops(tmp_path: Path, count: int) -> None:
    """The servo's bus watchdog stops it 250 ms after ``kill -9`` at the latest."""
    policy = write_onnx(tmp_path / "policy.onnx", Proportional(), card_of().to_json())
    with VirtualPorts(load_cell_rate=80) as ports:
        for run in range(count):
            program = moving(ports, policy, tmp_path / str(run))
            time.sleep(0.3 + 0.01 * run)
            assert program.kill() <= 0.25


def test_a_terminated_program_lets_the_tendon_out(tmp_path: Path) -> None:
    """SIGTERM, as a service manager sends it: the log is closed, the motor off, the exit code 0."""
    policy = write_onnx(tmp_path / "policy.onnx", Proportional(), card_of().to_json())
    with VirtualPorts(load_cell_rate=80) as ports:
        for attempt in range(ATTEMPTS):
            program = moving(ports, policy, tmp_path / str(attempt))
            time.sleep(0.5)
            program.process.terminate()
            said, _ = program.process.communicate(timeout=60.0)
            if not any(word in said.decode() for word in BUSY):
                break
        assert program.process.returncode == 0, said
        assert b"ended: stopped by SIGTERM" in said
        assert ports.state().duty == 0.0
        assert ports.state().angle < 0.2
    assert (tmp_path / str(attempt) / "policy_0.mcap").exists()
