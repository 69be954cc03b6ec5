"""Each safety rule broken on the virtual bench: the right action, in time, and a motor that is off.

In lockstep the bench's clock is the judge, so that a busy machine changes no figure.
"""

import os
import signal

import pytest

from tendon_hardware.control.keyboard import Keyboard
from tendon_hardware.safety_rules.rules import SAFETY_RULES
from tendon_hardware.virtual_bench import Faults
from tests.faults.cases import ALLOWED, CASES, SETTINGS, moments
from tests.hardware.deploy.runs import Flight, Watching

ELSEWHERE = {"kill", "log"}
"""Rules that have tests of their own below."""


@pytest.mark.parametrize("count", [1, pytest.param(20, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", CASES)
def test_a_fault_is_acted_upon_in_time(name: str, count: int) -> None:
    """The table's action follows the fault in time, its reason is told, the motor ends off."""
    for after in moments(count):
        CASES[name].examine(after)


def test_every_rule_of_the_table_is_broken_here() -> None:
    """A new rule needs a fault that breaks it."""
    broken = {case.rule for case in CASES.values() if case.rule}
    assert broken | ELSEWHERE == {rule.name for rule in SAFETY_RULES}


def test_unwinding_ends_at_home_and_off() -> None:
    """After a stop the tendon is let out slowly: the spool comes home, then the motor is off."""
    flight = CASES["a shutdown"].flight(1.5)
    flight.fly()
    positions = [shown.position[0] for shown in flight.operator.shown]  # pyright: ignore
    assert max(positions) > 0.4
    assert flight.angle_after < 0.1


def test_a_hold_keeps_the_command_and_ends_with_its_cause() -> None:
    """While the load cell is silent the command stays; when it is back the policy goes on."""
    flight = CASES["a silent load cell"].flight(0.5)
    outcome = flight.fly()
    assert outcome.fault is None
    assert outcome.trips == {"stale_force": 1, "operator": 1}
    held = [shown.command for shown in flight.operator.shown if shown.mode == "hold"]  # pyright: ignore
    assert held
    assert len(set(held)) == 1


def test_a_servo_that_comes_back_in_time_is_driven_on() -> None:
    """A tenth of a second of lost answers is held through."""
    flight = Flight(settings=SETTINGS, after=0.5)

    def lose(bench, stop) -> None:
        bench.controls.set_faults(Faults(dropped_replies=1.0))

    def find(bench) -> None:
        bench.controls.set_faults(Faults())

    def happen(bench, stop) -> None:
        lose(bench, stop)
        happened.append(bench)

    happened: list = []
    flight.fault = happen
    flight.operator.show = lambda progress: (  # pyright: ignore
        find(happened[0]) if happened and progress.mode == "hold" else None
    )
    outcome = flight.fly()
    assert outcome.fault is None
    # waiting for answers takes ticks, more of them where a step is due as well
    assert set(outcome.trips) - {"loop_overrun"} == {"missed_reads", "operator"}


def test_a_terminal_that_is_gone_does_not_stop_the_loop() -> None:
    """What cannot be printed any more is not; the tendon is let out all the same."""
    gone: list[bool] = []

    class Terminal(Watching):
        def tell(self, text: str) -> None:
            super().tell(text)
            if gone:
                raise OSError(5, "Input/output error")

        def show(self, progress) -> None:
            self.tell("figures")

    def hang_up(bench, stop) -> None:
        gone.append(True)
        os.kill(os.getpid(), signal.SIGHUP)

    flight = Flight(settings=SETTINGS, after=1.5, fault=hang_up, operator=Terminal())
    outcome = flight.fly()
    assert outcome.ended == "stopped by SIGHUP"
    assert flight.angle_after < 0.1
    assert not flight.torque_after


@pytest.mark.parametrize(("key", "rule"), [(b"x", "kill"), (b" ", "operator"), (b"q", "operator")])
def test_a_key_ends_the_run(key: bytes, rule: str) -> None:
    """Key x switches off at once, the space bar and q let the tendon out; one tick later."""
    master, slave = os.openpty()
    try:
        flight = Flight(settings=SETTINGS, keyboard=Keyboard(slave))
        flight.fault = lambda bench, stop: os.write(master, key) and None
        outcome = flight.fly()
    finally:
        os.close(master)
        os.close(slave)
    assert flight.latency(rule) <= ALLOWED
    assert outcome.fault is None
    assert not flight.torque_after


def test_a_full_disk_ends_the_run_gently(tmp_path) -> None:
    """Where no byte more fits the tendon is let out; what was written stays readable."""
    import resource

    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    flight = Flight(settings=SETTINGS, path=tmp_path / "run.mcap")
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, limit[1]))
    try:
        outcome = flight.fly()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert "File too large" in str(outcome.fault)
    assert outcome.trips["log"] == 1
    assert flight.angle_after < 0.1
    assert not flight.torque_after


def test_the_bus_watchdog_stops_what_nobody_drives() -> None:
    """A program that is gone sends nothing: the servo stops within 250 ms, twenty times of twenty.

    The loop is left hanging at twenty moments; the plant's own duty tells when the motor stopped.
    """
    stopped: list[float] = []

    class Gone(Exception):
        pass

    def hang(bench, stop) -> None:
        plant = bench.controls.plant
        begin = bench.clock.now()
        while plant.motor.duty != 0.0 and bench.clock.now() - begin < 1.0:
            bench.clock.sleep_until(bench.clock.now() + 1e-3)
        stopped.append(bench.clock.now() - begin)
        raise Gone

    for after in moments(20):
        flight = Flight(settings=SETTINGS, after=0.2 + 0.1 * after, fault=hang, in_step=True)
        with pytest.raises(Gone):
            flight.fly()
    assert max(stopped) <= 0.25
