"""A load cell that says the same whatever happens is not believed; a live one always is."""

import random
from collections.abc import Iterator
from math import pi

import pytest

from tendon_hardware.benches.virtual_calibration import calibrated_twins
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.load_cells.cell_doubt import CALM_READINGS, WINDOW, CellDoubt, equal_max
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.base import ServoState
from tests.hardware.recording import Trial

SPEC = SERVOS["xc330_t288_t"]
CALIBRATION = calibrated_twins("finger", 0, 80)[0]
RADIUS = 0.0125
SIGMA = CALIBRATION.noise / abs(CALIBRATION.slope)


def reading(counts: float, k: int = 0) -> LoadCellReading:
    """Return a reading."""
    return LoadCellReading(
        sequence=k, device_time_us=12_500 * k, host_time=0.0125 * k, counts=round(counts)
    )


def heard(values: Iterator[float]) -> str | None:
    """Return what a doubt says after readings."""
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    for k, counts in enumerate(values):
        doubt.hear(reading(counts, k))
        if doubt.fault is not None:
            break
    return doubt.fault


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_a_live_cell_is_believed_for_an_hour(share: float) -> None:
    """No reading of its noise looks like a fault, nor where four are averaged into one."""
    rng = random.Random(1)
    assert heard(rng.gauss(1e5, share * SIGMA) for _ in range(288_000)) is None


def test_a_cell_of_few_counts_of_noise_is_believed_too() -> None:
    """Equal readings come by chance there; as many as count as a fault come once in 1e12."""
    assert [equal_max(sigma) for sigma in (0.1, 1.0, 10.0, 100.0, 1000.0)] == [23, 23, 9, 6, 5]
    rng = random.Random(2)
    doubt = CellDoubt(None, SPEC, RADIUS)
    for k in range(100_000):
        doubt.hear(reading(rng.gauss(0.0, 1.0), k))
    assert doubt.fault is None


def test_a_cell_calmer_than_its_own_noise_is_not_believed() -> None:
    """A value that toggles by one count is no converter's noise, though never equal in a row."""
    fault = heard(1000.0 + k % 2 for k in range(CALM_READINGS))
    assert fault is not None
    assert "as noisy as when it was calibrated" in fault


def test_two_saturated_readings_are_a_spike_and_three_a_fault() -> None:
    """Whichever end of the range they are at."""
    for end in (2**23 - 1, -(2**23)):
        assert heard(iter([0.0, end, end, 50.0])) is None
        assert "saturated" in (heard(iter([0.0, end, end, end])) or "")


@pytest.mark.parametrize(
    ("shares", "doubted"),
    [
        pytest.param((0.0, 0.125, 0.5, 0.875, 1.0, 1.0), False, id="a blow, as the filter has it"),
        pytest.param((0.0, 0.0, 1.0, 1.0, 1.0, 1.0), True, id="a leap that stays"),
        pytest.param((0.0, 0.0, 1.0, 0.0, 0.0, 0.0), False, id="a spike"),
    ],
)
def test_a_tension_cannot_leap_between_two_readings(shares, doubted) -> None:
    """Of a step of 5 N the converter's filter gives an eighth, three, three and an eighth."""
    rng = random.Random(5)
    steps = [0.0] * 5 + [5.0 * share / abs(CALIBRATION.slope) for share in shares]
    fault = heard(rng.gauss(1e5 + step, SIGMA) for step in steps)
    assert ("over four readings" in (fault or "")) is doubted


def test_readings_that_are_missing_are_no_leap() -> None:
    """What lies between them nobody knows."""
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    for k in (0, 1, 2, 6, 7, 8):
        doubt.hear(reading(1e5 + 100.0 * k + (k > 2) * 5.0 / abs(CALIBRATION.slope), k))
    assert doubt.fault is None


@pytest.mark.parametrize(
    ("duty", "slope", "other", "doubted"),
    [
        pytest.param(0.15, 0.0, None, True, id="wound in slowly it must change"),
        pytest.param(0.15, 5.0, None, False, id="it changes"),
        pytest.param(0.05, 0.0, None, False, id="what turns freely may be slack"),
        pytest.param(0.15, 0.0, -0.5, False, id="an antagonist lets_out: a finger turns under it"),
        pytest.param(0.15, 0.0, -0.1, True, id="an antagonist lets_out too little"),
        pytest.param(0.15, 0.0, 0.0, True, id="an antagonist stands"),
        pytest.param(0.15, 0.0, 0.5, True, id="an antagonist winds in"),
    ],
)
def test_a_tension_must_follow_a_motor_that_pulls(duty, slope, other, doubted) -> None:
    """Unless another servo lets out meanwhile as the first winds in, by this share of it."""
    rng = random.Random(3)
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    for k in range(400):
        instant, angle = 0.0125 * k, 0.003 * k
        doubt.feel(0.5 + slope * angle + rng.gauss(0.0, 0.01), instant)
        state = ServoState(time=instant, position=angle, velocity=0.24, current=0.0)
        doubt.move(state, duty, [] if other is None else [other * angle])
    assert (doubt.fault is not None) is doubted


def test_a_motor_that_holds_still_is_no_motor_that_winds_in() -> None:
    """Ten minutes at its greatest pull: an encoder goes back and forth by a count."""
    rng = random.Random(4)
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    count = 2.0 * pi / 4096
    for k in range(48_000):
        instant, angle = 0.0125 * k, 1.0 + count * rng.randrange(2)
        doubt.feel(9.8 + rng.gauss(0.0, 0.01), instant)
        doubt.move(ServoState(time=instant, position=angle, velocity=0.0, current=0.0), 0.9)
    assert doubt.fault is None


def test_what_is_let_out_again_has_not_been_wound_in() -> None:
    """A gear that sticks goes a little to and fro for a minute, and the tension with it."""
    rng = random.Random(6)
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    for k in range(4800):
        instant = 0.0125 * k
        out, there = divmod(instant, 1.0)
        angle = 0.07 * (1.0 - there if out % 2 else there)
        doubt.feel(1.8 + 2.5 * angle + rng.gauss(0.0, 0.01), instant)
        state = ServoState(time=instant, position=angle, velocity=0.0, current=0.0)
        doubt.move(state, 0.0 if out % 2 else 0.15)
    assert doubt.fault is None


def test_a_slow_cell_is_given_time_to_show_a_change() -> None:
    """At 10 readings a second, settled after four, a spool has long been wound in before."""
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    for k in range(240):  # one step of 0.6 rad within 0.2 s, after a second of rest
        instant = 0.0125 * k
        angle = min(max(instant - 1.0, 0.0) * 3.0, 0.6)
        if k % 8 == 0:
            doubt.feel(2.0 if instant < 1.6 else 5.0, instant)
        doubt.move(ServoState(time=instant, position=angle, velocity=0.0, current=0.0), 0.9)
    assert doubt.fault is None


@pytest.mark.parametrize(("force", "doubted"), [(-0.4, False), (-2.0, True)])
def test_a_tendon_that_pushes_is_a_fault_of_its_cell(force: float, doubted: bool) -> None:
    """A shifted zero is put up with; two newtons below it are not."""
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    for k in range(WINDOW):
        doubt.feel(force, 0.0125 * k)
    assert ("cannot push" in (doubt.fault or "")) is doubted


def test_readings_that_jump_back_and_forth_are_no_tension() -> None:
    """Each reading weighs four periods of the converter: no tension alternates so fast.

    Between two readings of a slow cell it may.
    """
    fast, slow = CALIBRATION, calibrated_twins("finger", 0, 10)[0]
    steps = [5.0, 5.0, 0.0, 0.0]
    for cell, told, doubted in (
        (fast, [5.0, 0.0], True), (fast, steps, False), (slow, [5.0, 0.0], False),
    ):  # fmt: skip
        doubt = CellDoubt(cell, SPEC, RADIUS)
        for k in range(40):
            doubt.feel(told[k % len(told)], 0.0125 * k)
        assert ("back and forth" in (doubt.fault or "")) is doubted


@pytest.mark.parametrize(
    ("force", "voltage", "doubted"), [(1.0, 9.0, True), (3.0, 9.0, False), (1.0, 6.5, False)]
)
def test_a_motor_that_pulls_has_a_tension(force: float, voltage: float, doubted: bool) -> None:
    """At rest under a fifth of the duty a tendon has 2.2 N at least at 9 V, 0.7 N at 6.5 V."""
    rng = random.Random(6)
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)
    for k in range(100):
        instant = 0.0125 * k
        state = ServoState(time=instant, position=1.0, velocity=0.0, current=0.0)
        doubt.move(state, 0.2, (), voltage)
        doubt.feel(force + rng.gauss(0.0, 0.01), instant)
    assert ("must be at least" in (doubt.fault or "")) is doubted


@pytest.mark.parametrize(
    ("late", "others", "doubted"),
    [(0.0, (), False), (0.02, (), False), (0.3, (), True), (0.3, (0.0,), False)],
)
def test_a_tension_falls_when_its_spool_lets_out(late, others, doubted) -> None:
    """A cell that goes on rising is late; where another servo may pull, nobody can tell."""
    doubt = CellDoubt(CALIBRATION, SPEC, RADIUS)

    def angle(time: float) -> float:
        return 1.0 + 0.5 * abs(time % 2.0 - 1.0)

    for k in range(1000):
        now = 0.0125 * k
        state = ServoState(time=now, position=angle(now), velocity=0.0, current=0.0)
        doubt.move(state, 0.0, others)
        doubt.feel(5.0 * angle(now - late), now)
    assert (doubt.fault is not None and "late" in doubt.fault) is doubted


@pytest.mark.slow
@pytest.mark.parametrize("bench", ["finger", "spring_weak", "spring_strong"])
@pytest.mark.parametrize("excitation", ["random_steps", "sine", "ramps", "contact_ramp"])
@pytest.mark.parametrize("rate", [80, 20, 10])
def test_no_recording_is_ended_by_a_live_cell(bench, excitation, rate, tmp_path) -> None:
    """A minute of every kind of command on every bench, at every rate of the cell."""
    trial = Trial(
        path=tmp_path / "run.mcap",
        bench=bench,
        excitation=excitation,
        duration=60.0,
        load_cell_rate=rate,
        settings=CollectSettings(),
    )
    assert trial.record().finished, trial.outcome
