"""Injected faults: each does what it says, as often as it says."""

import termios
from pathlib import Path

import pytest

from tendon_hardware.load_cells.framing import decode_line
from tendon_hardware.virtual_bench import FaultEvent, Faults
from tendon_newton.errors import InvalidParameter, UnknownName
from tests.hardware.virtual_bench.link import BROKEN, ID, POSITION, SILENT, SUCCESS, Link

TRIALS = 2000


def results(faults: Faults) -> list[int]:
    """Return the SDK's results of many reads."""
    link = Link("spring_weak", faults=faults)
    return [link.sdk.readTxRx(link.port, ID, 126, 10)[1] for _ in range(TRIALS)]


@pytest.mark.parametrize(
    ("faults", "result"),
    [(Faults(dropped_replies=0.05), SILENT), (Faults(corrupted_replies=0.05), BROKEN)],
)
def test_replies_are_lost_and_broken_as_often_as_asked(faults, result) -> None:
    """Five per cent of 2000 within four standard deviations (1 %); the rest succeeds.

    A flipped bit in header or length leaves no whole frame: some broken replies read as silence.
    """
    outcomes = results(faults)
    assert outcomes.count(result) == pytest.approx(0.05 * TRIALS, abs=45)
    assert outcomes.count(SUCCESS) == pytest.approx(0.95 * TRIALS, abs=40)


def test_noise_comes_before_an_answer() -> None:
    """One to six bytes that are no frame, and the whole answer to a ping behind them."""
    link = Link("spring_weak", faults=Faults(line_noise=1.0))
    link.port.setPacketTimeoutMillis(100.0)
    link.port.writePort(bytes.fromhex("fffffd0001030001194e"))
    noise, head, answer = link.port.readPort(100).partition(b"\xff\xff\xfd\x00")
    assert (1 <= len(noise) <= 6, len(head + answer)) == (True, 14)


def test_latency_delays_each_reply() -> None:
    """Two milliseconds more in each transaction, not a microsecond less."""

    def duration(faults: Faults) -> float:
        link = Link(faults=faults)
        before = link.bench.clock.now()
        link.read(POSITION, 4)
        return link.bench.clock.now() - before

    assert duration(Faults(extra_latency=2e-3)) - duration(Faults()) == pytest.approx(2e-3)


def test_an_unplugged_adapter_fails_as_linux_does_and_comes_back() -> None:
    """Open handles raise termios.error for good, even after; a new opening works again."""
    link = Link()
    link.bench.plan(FaultEvent(name="unplug", duration=0.5))
    link.wait(0.01)
    with pytest.raises(termios.error):
        link.ping()
    with pytest.raises(FileNotFoundError):
        link.port.setBaudRate(1_000_000)
    link.wait(0.6)
    link.port.is_using = False
    with pytest.raises(termios.error):
        link.ping()
    link.port.is_using = False
    assert link.port.setBaudRate(1_000_000)
    assert link.ping()[1] == SUCCESS


def test_an_event_waits_for_its_time() -> None:
    """An alert planned for 0.5 s is not there at 0.4 s and is there at 0.6 s."""
    link = Link(faults=Faults(events=(FaultEvent(name="alert", start=0.5),)))
    link.wait(0.4)
    assert link.ping()[2] == 0
    link.wait(0.2)
    assert link.ping()[2] == 0x80


def test_a_dip_of_the_supply_shows_and_passes() -> None:
    """At 5 V the servo reports its input voltage and goes on; at 4 V it restarts."""
    link = Link()
    link.enable(16)
    link.bench.plan(FaultEvent(name="supply_dip", voltage=5.0, duration=0.3))
    link.wait(0.1)
    assert link.sdk.read2ByteTxRx(link.port, ID, 144) == (50, SUCCESS, 0x80)
    link.wait(0.3)
    assert link.sdk.read2ByteTxRx(link.port, ID, 144)[0] == pytest.approx(90, abs=2)
    link.bench.plan(FaultEvent(name="supply_dip", voltage=4.0, duration=0.2))
    link.wait(0.1)
    assert link.ping()[1] == SILENT
    link.wait(0.5)
    assert link.read(64, 1) == 0


def test_load_cell_lines_are_garbled_lost_and_silent() -> None:
    """Of 800 lines 5 % do not decode; in a second of silence none comes, then they go on."""
    link = Link(faults=Faults(garbled_lines=0.05))
    lines = [data.strip() for _, data in link.lines(10.0)]
    bad = sum(decode_line(line, 0.0) is None for line in lines)
    assert bad == pytest.approx(0.05 * len(lines), abs=26)  # four standard deviations
    link.bench.set_faults(Faults(lost_lines=0.5))
    assert len(link.lines(5.0)) == pytest.approx(200, abs=45)
    link.bench.set_faults(Faults())
    link.bench.plan(FaultEvent(name="cell_silence", duration=1.0))
    start = link.bench.clock.now()
    assert link.lines(2.0)[0][0] - start == pytest.approx(1.0, abs=0.03)


def test_a_fault_that_means_nothing_is_refused() -> None:
    """Unknown names and impossible chances are told, not ignored."""
    with pytest.raises(UnknownName, match="unplug"):
        FaultEvent(name="unplugged")
    with pytest.raises(UnknownName, match="overload"):
        FaultEvent(name="alert", alert="overlord")
    with pytest.raises(InvalidParameter, match="dropped_replies"):
        Faults(dropped_replies=1.5)
    with pytest.raises(InvalidParameter, match="duration"):
        FaultEvent(name="unplug", duration=-1.0)


def test_the_truth_of_a_unit_is_written(tmp_path: Path) -> None:
    """The plant file holds constants and effects; every effect is one that a diagnosis knows."""
    from tendon_newton.data.files.toml_file import read_toml
    from tendon_newton.effects import EFFECTS

    for bench in ("finger", "spring_strong"):
        Link(bench, 4).bench.plant_file(tmp_path / "plant.toml")
        table = read_toml(tmp_path / "plant.toml", InvalidParameter)
        assert table["seed"] == 4
        assert table["servo"]["spool_radius"] == pytest.approx(0.0125, rel=0.011)
        names = [effect["name"] for effect in table["effects"]]
        assert set(names) <= set(EFFECTS)
        assert {"stribeck_friction", "tendon_compliance", "load_cell_delay"} <= set(names)
        for effect in table["effects"]:
            known = {parameter.name for parameter in EFFECTS[effect["name"]].parameters}
            assert set(effect.get("parameters", {})) <= known
