"""Faults of a bench during a run: nothing crashes, nothing measured is lost, every gap is told.

They run in lockstep with the virtual bench, the same bytes through the same driver.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_hardware.benches.bench import open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun
from tendon_hardware.errors import LogNotWritten, SafetyStop, ServoAlert
from tendon_hardware.logs.mcap_file import McapFile
from tendon_hardware.logs.session_log import BackgroundLog, SessionLog, TimeBase
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.servos.base import ServoState
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench import FaultEvent, Faults
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mcap_file import messages_of
from tests.hardware.recording import Trial, Watcher

NOISE = Faults(dropped_replies=0.01, corrupted_replies=0.01, garbled_lines=0.01)


def struck(folder: Path, length: float = 6.0, **event: Any) -> Trial:
    """Return a run of some length [s] that was recorded while something happened to its bench."""
    faults = Faults(events=(FaultEvent(**event),))
    trial = Trial(path=folder / "run.mcap", duration=length, faults=faults)
    trial.record()
    return trial


def gap_of(trial: Trial) -> float:
    """Longest interval between two rows [s]; there must be no other beside it."""
    steps = np.diff(trial.recording().time)
    assert np.count_nonzero(steps > 0.03) == 1
    return float(steps.max())


def events_of(path: Path) -> list[str]:
    """What the diagnostics of a recording say, in order."""
    return [m.status[0].message for *_, m in messages_of(path, "/servo/diagnostics")]


def test_lost_and_garbled_bytes_cost_hardly_a_row(tmp_path: Path) -> None:
    """With 1 % of the answers lost, 1 % broken and 1 % of the cell's lines garbled, 99 % stays.

    A retry takes 4 ms of the 12.5 ms of a tick, so that only two in a row cost one.
    """
    trial = Trial(path=tmp_path / "run.mcap", duration=20.0, faults=NOISE)
    outcome = trial.record()
    assert outcome.finished
    assert outcome.rows + outcome.missed == 1600
    assert outcome.missed <= 16
    assert 0.97 * 1600 <= outcome.readings <= 1.01 * 1600
    log = trial.recording()
    steps = np.abs(np.diff(log.force[:, 0])) / np.diff(log.time)
    assert steps.max() < 240.0, "a garbled reading would jump by far more than 3 N in a tick"
    assert int(trial.session["counters.servo.retries"]) > 16
    assert int(trial.session["counters.load_cell.rejected"]) > 6


def test_an_unplugged_servo_leaves_a_gap_and_comes_back(tmp_path: Path) -> None:
    """Two seconds without the adapter: no rows there, forces go on, and rows come again after."""
    trial = struck(tmp_path, 4.0, name="unplug", start=0.5, duration=2.0)
    assert trial.outcome.finished
    gap = gap_of(trial)
    # found out at the next attempt, 0.25 s at most, and set up again in some transactions
    assert 2.0 <= gap <= 2.8
    assert trial.recording().time[-1] > 3.9
    assert trial.outcome.readings >= 0.97 * 320.0, "the load cell was read all along"
    assert any("waiting for it" in text for text in trial.said)
    assert any("servo is back after" in text for text in trial.said)
    assert any(text.startswith("no rows between") for text in events_of(trial.path))
    assert trial.session["gaps"]
    assert trial.session["counters.servo.reconnects"] == "1"


def test_a_servo_that_stays_away_ends_the_run(tmp_path: Path) -> None:
    """After ten seconds of silence the run ends with what it has."""
    trial = struck(tmp_path, 30.0, name="unplug", start=0.5, duration=60.0)
    outcome = trial.outcome
    assert isinstance(outcome.fault, SafetyStop)
    assert "silent for 10" in str(outcome.fault)
    ((first, last),) = outcome.gaps
    assert last - first > 10.0, "a gap that nothing ends counts, too"
    assert trial.session["gaps"] == f"{first:.3f} to {last:.3f} s"
    assert trial.recording().duration == pytest.approx(1.0, abs=0.1)
    assert any("SWITCH ITS SUPPLY OFF" in text for text in trial.said)


def test_a_loop_that_hears_nothing_lets_go(tmp_path: Path) -> None:
    """Without answers the host's loop does not know where the spool is, and gives no duty."""
    operator, duties = Watcher(1.0), []
    address = BenchAddress(bench="finger", port="virtual", lockstep=True)
    run = PlannedRun(name="run", bench="finger", excitation="contact_ramp", duration=8.0)
    settings = CollectSettings(limits=SafetyLimits(silence=2.0))
    with open_bench(address, operator.tell) as bench, StopRequest() as stop:
        controls = bench.controls

        def deafen() -> None:
            duties.append(controls.state().duty)
            controls.set_faults(Faults(dropped_replies=1.0))
            operator.act, operator.after = lambda: duties.append(controls.state().duty), 1.4

        operator.act = deafen
        outcome = record_run(bench, run, settings, tmp_path / "run.mcap", operator, stop)
        controls.set_faults(Faults())
    assert isinstance(outcome.fault, SafetyStop)
    assert duties[0] > 0.05
    assert duties[1] == 0.0


def test_an_alert_ends_the_run_with_its_reason(tmp_path: Path) -> None:
    """An overload switches the motor off; the file is closed and says so."""
    trial = struck(tmp_path, name="alert", start=1.0, alert="overload")
    outcome = trial.outcome
    assert isinstance(outcome.fault, ServoAlert)
    assert "overload" in str(outcome.fault)
    assert "overload" in trial.session["ended"]
    # noticed by the alert bit of the next answer, not at the next look
    assert trial.recording().duration == pytest.approx(1.5, abs=0.1)


def test_a_silent_load_cell_leaves_a_gap(tmp_path: Path) -> None:
    """One second without readings: the servo is logged on, and the rows without force are out."""
    trial = struck(tmp_path, name="cell_silence", start=0.5, duration=1.0)
    outcome = trial.outcome
    assert outcome.finished
    assert outcome.rows == 80.0 * trial.duration
    assert gap_of(trial) == pytest.approx(1.0, abs=0.06)
    assert any("load cell is silent" in text for text in trial.said)
    assert any("load cell is back after 1.0" in text for text in trial.said)
    assert {"silent", "readings were missing"} <= set(events_of(trial.path))


def test_a_servo_that_restarts_is_set_up_again(tmp_path: Path) -> None:
    """A servo that restarts forgets its settings; it is noticed, told and mended in the run."""
    trial = struck(tmp_path, name="reboot", start=1.0)
    assert trial.outcome.finished
    assert any("set up again" in text for text in trial.said)
    assert trial.session["counters.servo.resets"] == "1"
    log = trial.recording()
    assert log.duration > 5.9
    # the turns that it forgot are put back: the spool does not jump
    assert np.abs(np.diff(log.motor_position[:, 0])).max() < 0.5


def test_a_full_disk_keeps_what_is_written(tmp_path: Path) -> None:
    """Where no byte more fits the run stops, the motor is off, and the file is readable."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    trial = Trial(path=tmp_path / "run.mcap", duration=20.0)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limit[1]))
    try:
        outcome = trial.record()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert isinstance(outcome.fault, LogNotWritten)
    assert "File too large" in str(outcome.fault)
    # 100 kB take 5 to 7 s; the last chunk of 4 kB and what was not flushed, 0.5 s, are lost
    assert 4.0 <= trial.recording().duration <= 8.0


def test_a_full_disk_stops_a_loop_that_writes_beside_it(tmp_path: Path) -> None:
    """The thread that writes hands its failure to the loop at the next message."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = SessionLog(
        BackgroundLog(McapFile(tmp_path / "run.mcap", {})), TimeBase(start=0.0, epoch=0)
    )
    rng = np.random.default_rng(0)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limit[1]))
    try:
        with pytest.raises(LogNotWritten, match="File too large"):
            fill(log, rng)
        with pytest.raises(LogNotWritten):
            log.finish({})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    log.close()


def fill(log: SessionLog, rng: np.random.Generator) -> None:
    """Write 140 kB of readings that hardly compress, over two seconds."""
    for k in range(2000):
        position, velocity = rng.normal(size=2)
        log.state(ServoState(time=k / 80.0, position=position, velocity=velocity, current=0.0))
        time.sleep(0.001)


CHILDREN = """
import json, os, sys, time
from pathlib import Path
from tendon_hardware.logs.session_log import BackgroundLog
from tendon_hardware.benches.bench import open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.logs.mcap_file import McapFile
from tendon_hardware.logs.ros_messages import DEFINITIONS
from tendon_hardware.servos.base import ServoState
from tendon_hardware.logs.session_log import SessionLog, TimeBase
import mcap_ros2.writer
folder = Path(sys.argv[1])
children = []
for place in range(int(sys.argv[2])):
    child = os.fork()
    if child:
        children.append(child)
        continue
    log = SessionLog(BackgroundLog(McapFile(folder / f"{place}.mcap", {})),
                     TimeBase(start=0.0, epoch=0))
    start, k = time.monotonic(), 0
    while True:
        due = start + k / 80.0
        time.sleep(max(0.0, due - time.monotonic()))
        log.command(due, 0.001 * k)
        log.state(ServoState(time=due, position=0.001 * k, velocity=0.0, current=0.0))
        k += 1
print(json.dumps(children), flush=True)
for child in children:
    os.waitpid(child, 0)
"""
"""Twenty processes that log a row every 12.5 ms until they are killed."""


def test_killed_processes_lose_less_than_a_second(tmp_path, rng, caplog) -> None:
    """``kill -9`` at twenty random moments: of all rows older than 1 s, 99 % are in the file."""
    moments = np.sort(rng.uniform(1.5, 4.5, 20))
    parent = subprocess.Popen(
        [sys.executable, "-c", CHILDREN, str(tmp_path), str(moments.size)], stdout=subprocess.PIPE
    )
    children = json.loads(parent.stdout.readline())
    begin, killed = time.monotonic(), []
    for child, moment in zip(children, moments, strict=True):
        time.sleep(max(0.0, begin + moment - time.monotonic()))
        killed.append(time.monotonic())
        os.kill(child, signal.SIGKILL)
    assert parent.wait(10.0) == 0
    parent.stdout.close()
    for place, instant in enumerate(killed):
        path = tmp_path / f"{place}.mcap"
        log = read_recording_file(path, bench="finger")
        first = first_stamp(path)
        old = int((instant - 1.0 - first) * 80.0)
        assert np.count_nonzero(first + log.time < instant - 1.0) >= 0.99 * old
        np.testing.assert_allclose(log.motor_position[:, 0], 0.001 * np.arange(log.sample_count))
    assert "the file breaks off" in caplog.text


def first_stamp(path: Path) -> float:
    """Instant of the first row on the clock that all processes share [s]."""
    _, stamp, _ = next(messages_of(path, "/servo/state"))
    return 1e-9 * stamp
