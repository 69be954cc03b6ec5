"""The lockstep form: time passes only while somebody waits, and quickly."""

import time

import pytest

from tendon_hardware.virtual_bench.memory.control_table import XL330_M288_T
from tests.hardware.virtual_bench.link import ID, POSITION_GOAL, SUCCESS, Link

PLAN = 36.0 * 60.0  # [s] of data in the paper
ALLOWED = 5.0 * 60.0  # [s] of one core


def test_time_stands_still_without_waiting() -> None:
    """The clock moves for a transaction and for a sleep, and for nothing else."""
    link = Link()
    clock = link.bench.clock
    before = clock.now()
    time.sleep(0.02)
    assert clock.now() == before
    clock.sleep_until(before - 1.0)
    assert clock.now() == before
    clock.sleep_until(before + 0.5)
    assert clock.now() == before + 0.5
    assert link.bench.state().time == pytest.approx(clock.now(), abs=1.1e-3)  # whole milliseconds


def test_a_transaction_takes_what_the_line_takes() -> None:
    """A read of 10 bytes at 1 Mbit/s: 35 bytes on the line, the return delay and 0.5 ms of USB."""
    link = Link()
    for delay, pause in ((250, 500e-6), (0, 0.0)):
        link.write(9, 1, delay)
        before = link.bench.clock.now()
        link.sdk.readTxRx(link.port, ID, 126, 10)
        took = link.bench.clock.now() - before
        assert took == pytest.approx(350e-6 + pause + 0.5e-3, abs=1e-6)


def test_a_lost_reply_costs_the_timeout() -> None:
    """Nobody answers at ID 2: the SDK waits for its timeout of bench time, not of ours."""
    link = Link()
    before, wall = link.bench.clock.now(), time.process_time()
    assert link.sdk.ping(link.port, 2)[1] != SUCCESS
    assert link.bench.clock.now() - before == pytest.approx(4.2e-3, abs=0.3e-3)
    assert time.process_time() - wall < 1.0


def test_the_paper_s_data_take_less_than_five_minutes() -> None:
    """80 reads and 20 writes per second on the finger, at a speed that makes 36 min in 5 min.

    CPU time of this process, so that a busy machine does not decide; the logger has as much again.
    """
    link = Link()
    link.enable(16)
    duration, start = 10.0, link.bench.clock.now()
    began = time.process_time()
    for k in range(round(80 * duration)):
        link.bench.clock.sleep_until(start + k / 80.0)
        link.sdk.readTxRx(link.port, ID, 126, 10)
        if k % 4 == 0:
            link.sdk.write2ByteTxRx(link.port, ID, 100, 100)
    assert (time.process_time() - began) * PLAN / duration < 0.5 * ALLOWED


def test_the_smaller_servo_runs_on_its_own_numbers() -> None:
    """An XL330 on 5 V has no alert, holds its own limits and turns."""
    link = Link("spring_weak", model=XL330_M288_T)
    link.enable(4)
    start = link.read(132, 4)
    link.write(POSITION_GOAL, 4, start + 300)
    link.wait(1.0)
    assert link.read(132, 4) == pytest.approx(start + 300, abs=60)  # its weaker loop holds more off
    assert link.read(144, 2) == pytest.approx(50, abs=6)
