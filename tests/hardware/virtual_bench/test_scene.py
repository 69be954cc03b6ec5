"""A hand in front of MuJoCo: its file, its rest, its statics, and what a unit differs in."""

import importlib
import random
import re
from dataclasses import replace
from math import dist
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.load_cells.framing import LineSplitter, decode_line
from tendon_hardware.virtual_bench import VirtualPorts
from tendon_hardware.virtual_bench.emulation.plant import Plant
from tendon_hardware.virtual_bench.physics.antagonist import AntagonistFinger, Crossing
from tendon_hardware.virtual_bench.physics.constants import (
    TIME_STEP,
    AntagonistConstants,
    HandBallConstants,
    HandConstants,
    LoadCellConstants,
)
from tendon_hardware.virtual_bench.physics.load_cell import GRAVITY, LoadCellBoard
from tendon_hardware.virtual_bench.physics.scene import SCENES, Scene
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.errors import MissingDependency
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.mechanisms.loading import load_mechanism
from tests.hardware.virtual_bench.link import PWM, PWM_GOAL, SUCCESS, TORQUE, Link, nominal_unit

NUMBER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?![\w.])")
LEVEL = (0.0,) * 4  # Stiffness of strings [N/m], which a scene does not ask for


def pulled(scene: Scene, pulls: tuple[float, ...], seconds: float) -> None:
    """Let a scene move under constant pulls [N]."""
    for _ in range(round(seconds / TIME_STEP)):
        scene.advance(pulls, LEVEL, TIME_STEP)


def place_of(scene: Scene) -> tuple[float, ...]:
    """Return where the ball's middle is [m]."""
    pose = scene.ball()
    return pose[:3]


@pytest.mark.parametrize("bench", ["hand", "hand_ball", "hand_pen"])
def test_a_scene_is_what_its_asset_exports(bench: str, tmp_path: Path) -> None:
    """`tendon-newton asset export BENCH --out FILE` writes the file anew, up to a last digit.

    Newton's numbers are of float32, and processors round differently.
    """
    fresh = tmp_path / "scene.xml"
    write_mujoco(fresh, load_mechanism(bench))
    kept, written = (
        NUMBER.split(path.read_text("utf-8")) for path in (SCENES / f"{bench}.xml", fresh)
    )
    assert written[::2] == kept[::2]
    assert [float(x) for x in written[1::2]] == pytest.approx(
        [float(x) for x in kept[1::2]], rel=1e-5
    )


def test_the_strings_are_those_of_the_asset() -> None:
    """MuJoCo's routes and ours give the same line to 1e-6 m, in postures of all joints."""
    mechanism, scene = load_mechanism("hand"), Scene("hand", HandConstants())
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(0.0, 1.1, 12)
        scene.place(q.tolist())
        there = [float(excursion(tendon, q)) for tendon in mechanism.tendons]
        assert scene.excursions == pytest.approx(there, abs=1e-6)


@pytest.mark.parametrize("pull", [1.0, 3.0, 6.0])
def test_a_pull_closes_a_finger_as_statics_say(pull: float) -> None:
    """Joint angles at rest, finger by finger; 2 mrad: MuJoCo's stops are soft near their ends."""
    mechanism, scene = load_mechanism("hand"), Scene("hand", HandConstants())
    pulls = (pull, 0.5 * pull, 0.0, pull)
    pulled(scene, pulls, 2.0)
    expected = equilibrium(mechanism, np.array(pulls))
    assert scene.joints() == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("bench", ["hand_ball", "hand_pen"])
def test_what_a_hand_turns_rests_in_its_cup(bench: str) -> None:
    """Within 0.2 mm of where the asset has it; over a second it creeps by less than 10 um."""
    scene = Scene(bench, HandBallConstants())
    start = place_of(scene)
    pulled(scene, LEVEL, 1.0)
    rested = place_of(scene)
    assert dist(start, rested) < 2e-4
    pulled(scene, LEVEL, 1.0)
    assert dist(rested, place_of(scene)) < 1e-5


def test_fingers_hold_a_ball() -> None:
    """All four press with 2 N of tendon: the ball stays in its cup, and all comes to rest."""
    scene = Scene("hand_ball", HandBallConstants())
    start = place_of(scene)
    pulled(scene, (2.5,) * 4, 2.0)
    assert dist(start, place_of(scene)) < 5e-3
    before = scene.joints()
    pulled(scene, (2.5,) * 4, 0.5)
    assert scene.joints() == pytest.approx(before, abs=1e-3)


def test_energy_does_not_grow() -> None:
    """Fingers let go from a grip: what stops and contacts keep for a while is never more than all.

    At the end only the weight's energy is left, to 1 % of the grip's.
    """
    scene, rest = Scene("hand_ball", HandBallConstants()), Scene("hand_ball", HandBallConstants())
    pulled(rest, LEVEL, 1.0)
    pulled(scene, (2.5,) * 4, 1.0)
    held, least = scene.energy() - rest.energy(), []
    for _ in range(150):
        pulled(scene, LEVEL, 0.01)
        least.append(scene.energy() - rest.energy())
    assert max(least) <= held
    assert least[-1] == pytest.approx(0.0, abs=0.01 * held)


def test_half_the_substep_ends_in_the_same_grip() -> None:
    """A slow pull to 2 N at 0.25 and at 0.125 ms: joints within 5 mrad, the ball within 0.2 mm."""
    ends = []
    for step in (TIME_STEP, 0.5 * TIME_STEP):
        scene = Scene("hand_ball", HandBallConstants())
        count = round(1.0 / step)
        for k in range(count):
            scene.advance((2.0 * k / count,) * 4, LEVEL, step)
        ends.append((scene.joints(), place_of(scene)))
    (coarse, there), (fine, here) = ends
    assert coarse == pytest.approx(fine, abs=5e-3)
    assert dist(there, here) < 2e-4


def test_a_ball_is_put_back_at_rest() -> None:
    """Where the asset has it, and it stays."""
    scene = Scene("hand_ball", HandBallConstants())
    start = place_of(scene)
    pulled(scene, (9.0, 0.0, 0.0, 0.0), 1.0)
    pulled(scene, LEVEL, 1.0)
    scene.put_back()
    assert place_of(scene) == start
    pulled(scene, LEVEL, 0.5)
    assert dist(start, place_of(scene)) < 2e-4


def test_a_unit_has_springs_masses_and_friction_of_its_own() -> None:
    """A stiffer finger closes less, a heavier ball lies deeper, and units differ."""
    stiff = replace(HandConstants(), stiffness=(1.3, 1.0, 1.0, 1.0))
    scene = Scene("hand", stiff)
    pulled(scene, (2.0,) * 4, 1.0)
    assert scene.excursions[0] < 0.85 * scene.excursions[1]
    heights = []
    for mass in (1.0, 2.0, 3.0):
        scene = Scene("hand_ball", replace(HandBallConstants(), ball_mass=mass, cup_friction=0.0))
        pulled(scene, LEVEL, 0.5)
        heights.append(place_of(scene)[2])
    first, second = np.diff(heights)
    assert first > 0.0  # m, along gravity
    assert second == pytest.approx(first, rel=0.1)  # springs of the same stiffness
    units = [draw_unit("hand_ball", seed).mechanism for seed in range(3)]
    assert len({str(unit) for unit in units}) == 3


def test_without_mujoco_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """The package belongs to the simulator's extra."""

    def missing(name: str) -> None:
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(
        MissingDependency, match=r"needs the package 'mujoco'.*tendon-newton\[sim\]"
    ):
        Scene("hand", HandConstants())


def placed(q: tuple[float, float]) -> AntagonistFinger:
    """Return the nominal finger at rest in a posture [rad], its strings measured anew."""
    finger = AntagonistFinger(AntagonistConstants())
    finger.angles = q
    finger.advance((0.0, 0.0), (0.0, 0.0), 1e-12)
    return finger


def test_the_strings_of_the_nominal_bench_are_those_of_the_asset() -> None:
    """Two derivations that share no code give the same lengths to 5 um in every posture.

    The bench knows distances and angles seen from the axes, rounded to a micrometre.
    """
    mechanism = load_mechanism("finger_antagonist")
    for q in np.random.default_rng(0).uniform(0.0, 1.5, (40, 2)):
        own = placed((float(q[0]), float(q[1]))).excursions
        there = [float(excursion(tendon, q)) for tendon in mechanism.tendons]
        assert own == pytest.approx(there, abs=5e-6)


@pytest.mark.parametrize("knuckle", [0.0, 0.006])
def test_a_string_past_a_joint_has_the_slope_of_its_length(knuckle: float) -> None:
    """Straight and on its knuckle, the slope is the length's central difference."""
    string = Crossing(0.018, 0.015, 2.3, 1.0, knuckle)
    for q in np.linspace(-0.9, 0.8, 30):
        (low, _), (high, _) = string.at(q - 1e-6), string.at(q + 1e-6)
        # 1e-7 m/rad: rounding of 1e-2 m over 2e-6 rad, and where the string meets its knuckle
        assert string.at(q)[1] == pytest.approx((high - low) / 2e-6, abs=1e-7)


def test_the_flexor_closes_and_the_extensor_opens() -> None:
    """Each servo at a third of its duty, the other pays out: the tip goes down, then up."""
    plant = Plant(nominal_unit("finger_antagonist"))
    for line in plant.lines:
        line.registers.write(11, bytes([16]), 0)
        line.registers.write(64, bytes([1]), 0)

    def drive(first: int, second: int) -> float:
        for line, duty in zip(plant.lines, (first, second), strict=True):
            line.registers.write(100, duty.to_bytes(2, "little", signed=True), 0)
        for _ in range(3000):
            plant.tick()
        tip = plant.state().tip
        return tip[1]

    assert drive(300, -150) < -0.035  # m
    assert drive(-150, 300) > -0.015


def test_each_servo_answers_to_its_own_id() -> None:
    """Both are found, and a goal for the second leaves the first alone."""
    link = Link("finger_antagonist", 1)
    found, result = link.sdk.broadcastPing(link.port)
    assert (sorted(found or {}), result) == ([1, 2], SUCCESS)
    link.enable(PWM)
    data = list((200).to_bytes(2, "little"))
    assert link.sdk.writeTxRx(link.port, 2, PWM_GOAL, 2, data) == (SUCCESS, 0)
    assert link.read(PWM_GOAL, 2) == 0
    first, second = link.bench.plant.lines
    assert (first.registers.torque, second.registers.torque) == (True, False)
    assert link.write(TORQUE, 1, 0) == 0


def test_a_bench_in_real_time_has_a_port_for_each_load_cell() -> None:
    """Both ports send lines of the same kind, with counts of their own."""
    import serial

    texts = []
    with VirtualPorts("finger_antagonist", 2) as ports:
        assert len(ports.load_cell_ports) == 2
        for path in ports.load_cell_ports:
            with serial.Serial(path, 115_200, timeout=2.0) as port:
                port.readline()
                texts.append(port.readline())
    assert all(text.startswith(b"L,") for text in texts)
    counts = [int(text.split(b",")[3].split(b"*")[0]) for text in texts]
    assert abs(counts[0] - counts[1]) > 1000  # the offsets of two cells


def board(**constants: float) -> LoadCellBoard:
    """Return a quiet board: no noise, no drift, unless asked."""
    quiet = {"noise": 0.0, "wander": 0.0} | constants
    return LoadCellBoard(LoadCellConstants(**quiet), random.Random(1))


def readings(cell: LoadCellBoard, tensions: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Feed a tension per millisecond; return times [s] and counts."""
    rows = []
    for k, tension in enumerate(tensions):
        line = cell.take(tension, 1e-3 * (k + 1))
        if line:
            frame = decode_line(line.strip(), 0.0)
            rows.append((1e-3 * (k + 1), frame.counts))
    times, counts = np.array(rows).T
    return times, counts


def test_the_stream_is_what_the_reader_expects() -> None:
    """After the banner every line decodes, the sequence has no gap, and 80 come in a second."""
    link = Link()
    splitter = LineSplitter()
    lines = splitter.feed(b"".join(line.data for line in link.bench.cell_lines(10.0)))
    frames = [decode_line(line, 0.0) for line in lines]
    assert frames[0] is None  # the boot banner
    good = [frame for frame in frames if frame is not None]
    assert len(good) == pytest.approx(800, rel=0.025)  # the chip's oscillator: 2 %
    assert set(np.diff([frame.sequence for frame in good])) == {1}


def test_the_boards_clock_is_its_own() -> None:
    """Its microseconds advance with the arrivals to 100 ppm, with half a millisecond of scatter."""
    link = Link(seed=5)
    rows = [(time, decode_line(data.strip(), 0.0)) for time, data in link.lines(20.0)]
    arrivals = np.array([time for time, frame in rows if frame is not None])
    micros = np.array([frame.device_time_us for _, frame in rows if frame is not None])
    slope = np.polyfit(arrivals, 1e-6 * micros, 1)[0]
    assert slope == pytest.approx(1.0, abs=200e-6)


@pytest.mark.parametrize("rate", [80, 20, 10])
def test_a_rate_is_what_was_asked(rate) -> None:
    """80 and 10 are the chip's own; 20 is a mean of four."""
    assert len(Link(load_cell_rate=rate).lines(10.0)) == pytest.approx(10 * rate, rel=0.03)


def test_a_step_settles_in_four_conversions_and_is_25_ms_late() -> None:
    """After 50 ms the counts are those of the new tension; the ramp's delay is two periods."""
    cell = board()
    scale = LoadCellConstants().counts_per_newton
    times, counts = readings(cell, [0.0] * 100 + [10.0] * 200)
    settled = counts[times > 0.1 + 0.0625]
    assert settled == pytest.approx(10.0 * scale, rel=1e-6)
    times, counts = readings(board(), [0.001 * k for k in range(1000)])
    late = times[-20:] - counts[-20:] / scale
    assert late == pytest.approx(0.025, abs=1.5e-3)  # the tick's millisecond


def test_noise_and_scale_are_the_constants() -> None:
    """Under 1 kg the counts are offset + scale * force, scattered as the constants say."""
    cell = board(noise=0.01, offset=1234.0)
    cell.mass = 1.0
    _, counts = readings(cell, [0.0] * 20_000)
    scale = LoadCellConstants().counts_per_newton
    settled = counts[8:]
    assert settled.mean() == pytest.approx(1234.0 + scale * GRAVITY, abs=0.002 * scale)
    assert settled.std() == pytest.approx(0.01 * scale, rel=0.1)


def test_an_overload_saturates() -> None:
    """50 kg is more than 24 bits: the counts stay at the chip's end."""
    cell = board()
    cell.mass = 50.0
    _, counts = readings(cell, [0.0] * 200)
    assert counts[-1] == 2**23 - 1
