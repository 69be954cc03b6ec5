"""What the doctor finds on a bench, and what it says to do.

Speeds depend on how busy this computer is, so that no verdict about them is tested here.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.clock import MonotonicClock
from tendon_hardware.doctor import port_checks
from tendon_hardware.doctor.examination import check_waiting, examine
from tendon_hardware.doctor.load_cell_checks import check_counts, check_load_cell, check_stream
from tendon_hardware.doctor.observation import Observation
from tendon_hardware.doctor.port_checks import check_latency, check_port, check_search
from tendon_hardware.doctor.servo_checks import check_health, check_rate, check_servo, check_speed
from tendon_hardware.doctor.servo_search import (
    FoundServo,
    find_servos,
    reboot_servos,
    set_baud,
    set_identifier,
)
from tendon_hardware.errors import ServoSilent
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.base import ServoHealth
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.virtual_bench import FaultEvent, Faults, LockstepBench, VirtualPorts
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.cli import main
from tendon_newton.cli.bench.doctor import coloured
from tests.hardware.load_cells.streams import StillClock, WrittenStream, lines
from tests.hardware.servos.virtual_servo import VirtualServo

SPEC = SERVOS["xc330_t288_t"]
WELL = ServoHealth(
    voltage=11.1, temperature=30.0, hardware_error=0, torque_enabled=False, watchdog_tripped=False
)


@pytest.fixture(scope="module")
def ports() -> Iterator[VirtualPorts]:
    """One bench in real time for all tests of this file."""
    with VirtualPorts("finger", 2) as ports:
        yield ports


@pytest.fixture
def bench() -> LockstepBench:
    """A bench whose clock goes on while its user waits: a search asks at many rates."""
    return LockstepBench(draw_unit("finger", 2))


def quiet(text: str) -> None:
    """Show nothing."""
    del text


def verdicts(observations: Iterator[Observation]) -> dict[str, str]:
    """Return the verdict on each subject, the worst where there are several."""
    found: dict[str, str] = {}
    for observation in observations:
        found[observation.subject] = max(
            found.get(observation.subject, "good"),
            observation.verdict,
            key=["good", "note", "fix"].index,
        )
    return found


def test_a_bench_is_examined_from_the_clock_to_the_load_cell(ports: VirtualPorts) -> None:
    """Everything is looked at once; nothing that a computer's load cannot touch is wrong."""
    found = verdicts(examine(ports.servo_port, ports.load_cell_port, clock=MonotonicClock()))
    assert {"clock", "servo port", "latency timer", "load cell port", "load cell"} <= found.keys()
    assert {"servo 1", "servo 1 settings", "servo 1 supply", "servo 1 alerts"} <= found.keys()
    touched = {"clock", "servo 1 speed", "load cell gaps", "load cell clock", "servo 1 settings"}
    assert {found[subject] for subject in found.keys() - touched} == {"good"}


def test_exchanged_ports_are_thought_of(ports: VirtualPorts) -> None:
    """Each port is there and free, and answers nothing that is understood."""
    found = [*examine(ports.load_cell_port, ports.servo_port, clock=MonotonicClock())]
    mended = [seen for seen in found if seen.verdict == "fix" and seen.subject != "clock"]
    assert [seen.subject for seen in mended] == ["servo", "load cell"]
    assert all("exchanged" in seen.remedy for seen in mended)


def test_the_verb_prints_a_table_and_the_exit_code_tells(capsys) -> None:
    """What is not there is one row with its remedy, and code 1."""
    assert main(["doctor", "--port", "/dev/no_such_port"]) == 1
    out = capsys.readouterr().out
    assert "fix   servo port" in out
    assert "-> plug it in; ls -l /dev/serial/by-id" in out
    *rows, last = out.splitlines()
    mends = [row for row in rows if row.startswith("fix")]
    assert last == f"{len(mends)} to mend"
    assert [row.split()[1] for row in mends if "clock" not in row] == ["servo"]  # a busy computer


def test_a_virtual_bench_is_well_however_busy_this_computer_is(capsys) -> None:
    """In lockstep the bench waits: no verdict depends on the load, and all is said to be well."""
    assert main(["doctor", "--port", "virtual:finger:3"]) == 0
    first = capsys.readouterr().out
    assert "good  servo 1 speed" in first
    assert first.splitlines()[-1] == "nothing to mend"
    assert "\033[" not in first, "colours are for terminals"
    assert main(["doctor", "--port", "virtual:finger:3", "--set-id", "7"]) == 0
    assert "has the ID 7" in capsys.readouterr().out


def test_verdicts_have_colours_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Green on one, plain where NO_COLOR asks for it."""
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert coloured("good", 32) == "\033[32mgood\033[0m"
    monkeypatch.setenv("NO_COLOR", "1")
    assert coloured("good", 32) == "good"


def test_a_busy_computer_is_blamed_once() -> None:
    """By the clock; what comes late from the servo then says nothing of its bus."""
    assert check_waiting([1e-4] * 100).verdict == "good"
    assert check_waiting([1e-4] * 90 + [2e-3] * 10).verdict == "note"
    busy = check_waiting([1e-4] * 90 + [2e-2] * 10)
    assert (busy.verdict, "too busy" in busy.remedy) == ("fix", True)
    rig = VirtualServo()
    rig.bench.set_faults(Faults(extra_latency=6e-3))
    late = check_speed("servo 1", rig.servo, rig.clock, busy=True)
    assert (late.verdict, "latency timer" in late.remedy) == ("note", False)
    assert "see clock" in late.remedy
    rig.bench.set_faults(Faults(corrupted_replies=0.2))
    assert check_speed("servo 1", rig.servo, rig.clock, busy=True).verdict == "fix"


def test_changing_a_servo_needs_its_port(capsys: pytest.CaptureFixture[str]) -> None:
    """One line, code 2."""
    assert main(["doctor", "--set-baud", "1000000"]) == 2
    assert "--port must name the servo's port" in capsys.readouterr().err


def test_a_second_opener_is_named_and_a_virtual_bench_is_not(ports: VirtualPorts) -> None:
    """The bench's own process holds the port; a foreign one would take the answers."""
    assert verdicts([check_port("servo port", ports.servo_port)]) == {"servo port": "good"}
    code = "import os, sys, time; os.open(sys.argv[1], os.O_RDWR); print('open', flush=True)"
    with subprocess.Popen(
        [sys.executable, "-c", f"{code}; time.sleep(60)", ports.servo_port], stdout=subprocess.PIPE
    ) as other:
        assert other.stdout.readline() == b"open\n"
        observation = check_port("servo port", ports.servo_port)
        other.kill()
    assert observation.verdict == "fix"
    assert f"process {other.pid}" in observation.found
    assert observation.remedy.endswith(f"end it: kill {other.pid}")


def test_a_file_that_is_no_port_is_told_apart(tmp_path: Path) -> None:
    """A slip of the keyboard, before anything opens it."""
    (tmp_path / "notes").touch()
    for path in (tmp_path / "notes", Path("/dev/null")):
        observation = check_port("servo port", str(path))
        assert (observation.verdict, "no serial port" in observation.found) == ("fix", True)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open everything")
def test_a_port_that_may_not_be_opened_names_the_group(tmp_path: Path) -> None:
    """The usual slip on a fresh system."""
    port = tmp_path / "port"
    port.touch(mode=0o000)
    observation = check_port("servo port", str(port))
    assert "usermod -aG dialout" in observation.remedy


@pytest.mark.parametrize(("timer", "verdict"), [("16\n", "fix"), ("1\n", "good"), ("", "good")])
def test_the_latency_timer_is_read_where_there_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, timer: str, verdict: str
) -> None:
    """16 ms make 80 Hz impossible; the remedy is a command and a rule."""
    monkeypatch.setattr("tendon_hardware.serial_ports.LATENCY_TIMERS", tmp_path)
    monkeypatch.setattr(port_checks, "LATENCY_TIMERS", tmp_path)
    (tmp_path / "ttyUSB7").mkdir()
    (tmp_path / "ttyUSB7" / "latency_timer").write_text(timer)
    (observation,) = check_latency("/dev/ttyUSB7")
    assert observation.verdict == verdict
    if verdict == "fix":
        assert f"echo 1 | sudo tee {tmp_path}/ttyUSB7/latency_timer" in observation.remedy
        assert 'ATTR{latency_timer}="1"' in observation.remedy


def test_the_search_for_ports_always_says_something() -> None:
    """Either the ports that are there, or how to see one."""
    assert list(check_search())


def test_a_servo_at_the_factorys_rate_is_found_and_set(bench: LockstepBench) -> None:
    """57600 baud is too slow for 80 Hz; the rate is set, and the servo answers at it."""
    port, clock = bench.servo_port(), bench.clock
    assert set_baud(port, 57_600, clock, quiet).verdict == "good"
    assert find_servos(port, clock, quiet) == FoundServo(
        family="dynamixel", rate=57_600, models={1: 1220}
    )
    observation = check_rate("servo 1", SPEC, 57_600)
    assert observation.verdict == "fix"
    assert "--set-baud 1000000" in observation.remedy
    observation = set_baud(port, 1_000_000, clock, quiet)
    assert "set from 57600 to 1000000 baud, and answers" in observation.found
    with pytest.raises(ServoSilent, match="asked for 12345"):
        set_baud(port, 12_345, clock, quiet)


def test_a_servo_is_given_an_id_of_its_own(bench: LockstepBench) -> None:
    """It answers by the new one alone, and keeps it; where two answer neither is changed."""
    port, clock = bench.servo_port(), bench.clock
    assert "has the ID 7, and answers" in set_identifier(port, 7, clock, quiet).found
    assert find_servos(port, clock, quiet) == FoundServo(
        family="dynamixel", rate=1_000_000, models={7: 1220}
    )
    set_identifier(port, 1, clock, quiet)
    with pytest.raises(ServoSilent, match="asked for 253"):
        set_identifier(port, 253, clock, quiet)
    two = LockstepBench(draw_unit("finger_antagonist", 0))
    with pytest.raises(ServoSilent, match="asked for 3, and 2 answer"):
        set_identifier(two.servo_port(), 3, two.clock, quiet)


def test_an_alert_is_named_and_a_restart_clears_it(bench: LockstepBench) -> None:
    """Overload: words, remedy, and the remedy works."""
    port, clock = bench.servo_port(), bench.clock
    bench.plan(FaultEvent(name="alert", alert="overload"))
    alerts = [x for x in check_servo(port, clock, quiet) if "alerts" in x.subject]
    assert [(x.verdict, x.found) for x in alerts] == [("fix", "overload")]
    assert "--reboot" in alerts[0].remedy
    assert reboot_servos(port, clock, quiet).verdict == "good"
    servo = BusServo(SPEC, port, clock=clock)
    servo.open()
    assert not servo.read_health().alerts
    servo.close()


@pytest.mark.parametrize(
    ("health", "subject", "verdict", "said"),
    [
        (replace(WELL, voltage=5.0), "servo 1 supply", "fix", "give it 11.1 V"),
        (replace(WELL, voltage=13.0), "servo 1 supply", "fix", "6.5 to 12 V"),
        (replace(WELL, temperature=60.0), "servo 1 temperature", "note", "cool"),
        (replace(WELL, alerts=("overheating",)), "servo 1 alerts", "fix", "restart it"),
        (replace(WELL, watchdog_tripped=True), "servo 1 watchdog", "note", "clear it"),
        (replace(WELL, torque_enabled=True), "servo 1 motor", "note", "keep clear"),
    ],
)
def test_health_has_a_remedy(health: ServoHealth, subject: str, verdict: str, said: str) -> None:
    """Each thing that is not as it should be, and only that."""
    assert set(verdicts(check_health("servo 1", SPEC, WELL)).values()) == {"good"}
    observations = list(check_health("servo 1", SPEC, health))
    (wrong,) = [x for x in observations if x.verdict != "good"]
    assert (wrong.subject, wrong.verdict) == (subject, verdict)
    assert said in wrong.remedy


def test_a_slow_adapter_does_not_fit_80_hz() -> None:
    """A latency of 16 ms, as FTDI adapters come: the reads say so."""
    rig = VirtualServo()
    good = check_speed("servo 1", rig.servo, rig.clock)
    assert (good.verdict, "fits" in good.found) == ("good", True)
    rig.bench.set_faults(Faults(extra_latency=6e-3))
    slow = check_speed("servo 1", rig.servo, rig.clock)
    assert (slow.verdict, "latency timer" in slow.remedy) == ("fix", True)
    rig.bench.set_faults(Faults(corrupted_replies=0.2))
    broken = check_speed("servo 1", rig.servo, rig.clock)
    assert (broken.verdict, "cable" in broken.remedy) == ("fix", True)


def readings(counts: np.ndarray, period: float = 0.0125) -> list[LoadCellReading]:
    """Make readings of a regular stream."""
    return [
        LoadCellReading(
            sequence=k,
            device_time_us=round(1e6 * k * period),
            host_time=k * period,
            counts=int(value),
        )
        for k, value in enumerate(counts)
    ]


def test_a_cell_at_80_per_second_with_noise_is_well(rng: np.random.Generator) -> None:
    """And one at 10, or silent in its bits, or at its end, is not."""
    noise = 400.0 * rng.standard_normal(240)
    assert verdicts(check_counts(readings(noise))) == {"load cell": "good"}
    assert verdicts(check_counts(readings(np.zeros(240)))) == {"load cell": "fix"}
    assert verdicts(check_counts(readings(np.full(240, 0x7FFFFF)))) == {"load cell": "fix"}
    assert set(verdicts(check_stream(readings(noise), 0, 0)).values()) == {"good"}
    slow = verdicts(check_stream(readings(noise[:30], 0.1), 0, 0))
    assert slow["load cell rate"] == "note"
    assert verdicts(check_stream(readings(noise), 3, 3))["load cell gaps"] == "fix"


def test_a_silent_cell_and_a_foreign_stream_are_told_apart() -> None:
    """Broken lines mean another rate or format; none at all means a plug."""
    clock, stream = StillClock(), WrittenStream()
    cell = Hx711Serial(stream, clock=clock)
    cell.open()
    (silent,) = check_load_cell(cell, clock, quiet)
    assert silent.found.startswith("0 readings and 0 broken lines")
    stream.pieces = [(0.0, b"12345\n" * 20)]
    (foreign,) = check_load_cell(cell, clock, quiet)
    assert "20 broken lines" in foreign.found
    stream.pieces = lines(0, 5)
    (few,) = check_load_cell(cell, clock, quiet)
    assert few.verdict == "fix"
