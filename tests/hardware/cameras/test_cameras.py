"""What every camera promises, and what the virtual one is late and noisy by."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
import pytest

from tendon_hardware.cameras.line_camera import Camera, LineCamera, read_line
from tendon_hardware.clock import Clock, MonotonicClock
from tendon_hardware.load_cells.framing import crc8
from tendon_hardware.virtual_bench import LockstepBench, VirtualPorts
from tendon_hardware.virtual_bench.physics.constants import HandBallConstants
from tendon_hardware.virtual_bench.physics.unit import draw_unit

Opened = Generator[tuple[Camera, Clock]]


@contextmanager
def in_lockstep() -> Opened:
    """The camera of a virtual hand that is as fast as its user."""
    bench = LockstepBench(draw_unit("hand_ball", 0))
    yield LineCamera(bench.camera_stream(), clock=bench.clock), bench.clock


@contextmanager
def on_a_port() -> Opened:
    """The camera of a virtual hand in real time, behind a pseudo-terminal."""
    with VirtualPorts("hand_ball", 0) as ports:
        clock = MonotonicClock()
        yield LineCamera(ports.camera_port, clock=clock), clock


CAMERAS: dict[str, Callable[[], object]] = {"lockstep": in_lockstep, "port": on_a_port}


@pytest.mark.parametrize("name", CAMERAS)
def test_a_camera_tells_what_it_saw_in_order_and_never_waits(name: str) -> None:
    """Frames grow, each was exposed before it came, and one that was told is not told again."""
    with CAMERAS[name]() as (camera, clock):  # pyright: ignore
        camera.open()
        begin = clock.now()
        clock.sleep_until(begin + 0.6)
        seen = camera.drain()
        again = camera.drain()
        camera.close()
        camera.close()
    assert not {sighting.sequence for sighting in again} & {sighting.sequence for sighting in seen}
    assert len(seen) >= 8  # of 18: a computer with other work is late
    for earlier, later in pairwise(seen):
        assert later.sequence > earlier.sequence
        assert later.exposed > earlier.exposed
    for sighting in seen:
        assert sighting.exposed < sighting.arrived
        assert sighting.arrived >= begin
        assert np.linalg.norm(sighting.place) < 0.1  # m, in the hand


@pytest.mark.parametrize("seed", [0, 1, pytest.param(2, marks=pytest.mark.slow)])
def test_the_virtual_camera_is_as_late_and_as_noisy_as_its_unit(seed: int) -> None:
    """Thirty frames a second about the true place; 20 %: noise of 300 frames."""
    bench = LockstepBench(draw_unit("hand_ball", seed))
    constants = bench.unit.mechanism
    assert isinstance(constants, HandBallConstants)
    assert 0.05 <= constants.camera_delay <= 0.1
    assert 5e-4 <= constants.camera_noise <= 1.5e-3
    camera = LineCamera(bench.camera_stream(), clock=bench.clock)
    camera.open()
    bench.clock.sleep_until(10.0)
    seen = camera.drain()
    assert len(seen) == pytest.approx(300, abs=4)
    late = [sighting.arrived - sighting.exposed for sighting in seen]
    assert late == pytest.approx([constants.camera_delay] * len(seen), abs=1e-6)
    places = np.array([sighting.place for sighting in seen])
    assert places.std(axis=0) == pytest.approx([constants.camera_noise] * 3, rel=0.2)
    turns = np.array([sighting.turn for sighting in seen])  # half an angle on a ball of 50 mm
    assert turns.std(axis=0) == pytest.approx([constants.camera_noise / 0.05] * 4, rel=0.2)
    ball = bench.state().ball
    assert places.mean(axis=0) == pytest.approx(ball[:3], abs=3e-4)  # 4 sigma of the mean


def test_a_ball_out_of_sight_gives_nothing() -> None:
    """A camera that saw nothing tells nothing."""
    bench = LockstepBench(draw_unit("hand_ball", 0))
    camera = LineCamera(bench.camera_stream(), clock=bench.clock)
    camera.open()
    bench.clock.sleep_until(0.5)
    camera.drain()
    bench.plant.mechanism.throw((0.0, 0.0, -3.0))  # pyright: ignore
    bench.clock.sleep_until(1.0)
    camera.drain()
    bench.clock.sleep_until(1.5)
    assert camera.drain() == []


def line_of(text: bytes) -> bytes:
    """Return a line with its checksum."""
    return text + b"*%02X" % crc8(text)


def test_a_line_is_read_as_it_was_sent() -> None:
    """Micrometres become metres, millionths a quaternion; the age goes back to the exposure."""
    sighting = read_line(line_of(b"B,7,60000,-14000,5,-40000,0,-600000,0,800000"), 2.0)
    assert sighting is not None
    assert sighting.turn == pytest.approx((0.0, -0.6, 0.0, 0.8))
    assert sighting.sequence == 7
    assert sighting.exposed == pytest.approx(1.94)
    assert sighting.place == pytest.approx((-0.014, 5e-6, -0.04))


@pytest.mark.parametrize(
    "line",
    [
        line_of(b"B,7,60000,-14000,5,-40000,0,0,0,1000000")[:-1] + b"0",
        line_of(b"B,7,60000,-14000,5,-40000"),
        line_of(b"L,7,60000,-14000"),
        line_of(b"B,7,-1,1,2,3,0,0,0,1000000"),
        line_of(b"B,7,1,1e3,2,3,0,0,0,1000000"),
        b"",
    ],
)
def test_a_broken_line_is_no_sighting(line: bytes) -> None:
    """Nothing is guessed."""
    assert read_line(line, 1.0) is None
