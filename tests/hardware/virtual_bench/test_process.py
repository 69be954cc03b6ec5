"""The bench as a process behind real pseudo-terminals."""

import os
import signal
import subprocess
import sys
import termios
import time
from itertools import takewhile
from pathlib import Path

import pytest

from tendon_hardware.virtual_bench import FaultEvent, Faults, VirtualPorts, open_virtual
from tendon_hardware.virtual_bench.process import InvalidVirtualBench, parse_word
from tendon_newton.errors import UnknownName
from tests.hardware.virtual_bench.link import ID, SUCCESS, Link
from tests.proposed import proposed, walk

PATIENT = 100  # latency that the SDK is told [ms]: a busy machine is no fault


@pytest.fixture(scope="module")
def ports():
    """A finger in real time."""
    with open_virtual("virtual:finger:2") as opened:
        yield opened


@pytest.fixture
def sdk(ports, monkeypatch):
    """The SDK's handlers on the servo's port."""
    from dynamixel_sdk import PacketHandler, PortHandler, port_handler

    monkeypatch.setattr(port_handler, "LATENCY_TIMER", PATIENT)
    port = PortHandler(ports.servo_port)
    assert port.openPort()
    yield PacketHandler(2.0), port
    port.closePort()


def test_a_wrong_speed_is_silence(sdk) -> None:
    """The baud rate that a client sets on the terminal counts."""
    packets, port = sdk
    port.setBaudRate(57_600)
    assert packets.ping(port, ID)[1] != SUCCESS
    port.setBaudRate(1_000_000)
    assert packets.ping(port, ID)[1] == SUCCESS


def test_closing_and_opening_again_is_no_hang_up(sdk) -> None:
    """The server keeps the terminal open between two users."""
    packets, port = sdk
    port.closePort()
    assert port.openPort()
    assert packets.ping(port, ID)[1] == SUCCESS


def test_the_load_cell_streams_in_real_time(ports) -> None:
    """About forty lines come in half a second, each with its newline."""
    import serial

    with serial.Serial(ports.load_cell_port, 115_200, timeout=0) as port:
        port.reset_input_buffer()
        time.sleep(0.5)
        lines = port.read(4096).split(b"\n")
    assert 25 <= len(lines) <= 55


def test_unplugging_hangs_up_and_the_path_comes_back(ports) -> None:
    """The path is gone for the time asked; the open port gives an input/output error."""
    from dynamixel_sdk import PacketHandler, PortHandler

    port = PortHandler(ports.servo_port)
    port.openPort()
    ports.plan(FaultEvent(name="unplug", duration=0.4))
    wait_until(lambda: not os.path.lexists(ports.servo_port))
    with pytest.raises(termios.error):
        PacketHandler(2.0).ping(port, ID)
    port.closePort()
    wait_until(lambda: os.path.lexists(ports.servo_port))
    port = PortHandler(ports.servo_port)
    assert port.openPort()
    port.closePort()


def wait_until(condition, patience: float = 5.0) -> None:
    """Wait for a condition, and fail if it does not come."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_faults_and_states_go_through_the_control_channel(ports) -> None:
    """Faults can be set while it runs; nonsense is refused with the server's words."""
    ports.set_faults(Faults(dropped_replies=0.5))
    ports.set_faults(Faults())
    ports.set_obstacle("tape_roll")
    ports.set_obstacle("free")
    ports.hang_mass(None)
    before = ports.state().time
    time.sleep(0.05)
    assert ports.state().time > before
    assert len(ports.state().tip) == 2
    with pytest.raises(InvalidVirtualBench, match="obstacle"):
        ports.set_obstacle("elephant")


def test_process_and_lockstep_are_the_same_bench() -> None:
    """At a fixed duty both come to the same angle and tension: the plant does not know who asks.

    Real time starts the motor at another millisecond of the noise, so 2 % are left to it.
    """
    from dynamixel_sdk import PacketHandler, PortHandler

    link = Link("spring_weak", 4)
    link.enable(16)
    link.write(100, 2, 200)
    link.wait(1.5)
    expected = link.bench.state()
    packets = PacketHandler(2.0)
    with VirtualPorts("spring_weak", 4) as opened:
        port = PortHandler(opened.servo_port)
        port.openPort()
        for address, size, value in ((11, 1, 16), (64, 1, 1), (100, 2, 200)):
            packets.writeTxOnly(port, ID, address, size, list(value.to_bytes(size, "little")))
            time.sleep(0.02)
        time.sleep(1.5)
        state = opened.state()
        port.closePort()
    assert state.angle == pytest.approx(expected.angle, rel=0.02)
    assert state.tension == pytest.approx(expected.tension, rel=0.02)


def test_a_bench_ends_with_its_owner_and_leaves_nothing() -> None:
    """Killed without a word, the owner's bench ends by itself and takes its folder along."""
    program = (
        "import os, signal; from tendon_hardware.virtual_bench import open_virtual;"
        "v = open_virtual('virtual'); print(v.process_id, v.folder, flush=True);"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    owner = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    number, folder = owner.stdout.split()
    wait_until(lambda: not Path(folder).exists())
    wait_until(lambda: not running(int(number)))


def running(number: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{number}/stat").read_text().split(")")[1].split()[0] != "Z"
    except OSError:
        return False


def test_closing_twice_does_no_harm() -> None:
    """The second close finds nothing to do."""
    opened = open_virtual("virtual:spring_weak")
    opened.close()
    opened.close()
    assert not opened.folder.exists()


def test_words_for_benches() -> None:
    """virtual, virtual:BENCH and virtual:BENCH:SEED; all else is refused with the reason."""
    assert parse_word("virtual") == ("finger", 0)
    assert parse_word("virtual:spring_weak") == ("spring_weak", 0)
    assert parse_word("virtual:finger:7") == ("finger", 7)
    with pytest.raises(UnknownName, match="spring_strong"):
        parse_word("virtual:spring")
    for word in ("virtuall", "virtual:finger:x", "virtual:finger:1:2"):
        with pytest.raises(InvalidVirtualBench):
            parse_word(word)


def test_the_verb_prints_its_ports_and_ends_on_interrupt(tmp_path: Path) -> None:
    """It says where the ports are; they are there; after Ctrl-C they are not, with exit code 0."""
    words = ["virtual-bench", "--seed", "3", "--plant-file", str(tmp_path / "plant.toml")]
    command = [sys.executable, "-m", "tendon_newton", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as verb:
        assert verb.stdout is not None
        lines = list(takewhile(lambda line: not line.startswith("Ctrl-C"), verb.stdout))
        (port,) = (line.split()[1] for line in lines if line.split()[:1] == ["servo"])
        assert os.path.lexists(port)
        assert (tmp_path / "plant.toml").exists()
        assert walk(*proposed("\n".join(lines))) == ["doctor"]
        verb.send_signal(signal.SIGINT)
        assert verb.wait(20.0) == 0
    wait_until(lambda: not os.path.lexists(port))
