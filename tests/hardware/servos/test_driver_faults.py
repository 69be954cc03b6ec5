"""What the driver does when the bus, the supply or the cable fails."""

import pytest

from tendon_hardware.errors import PortLost, ServoAlert, ServoReset, ServoSilent, WatchdogTripped
from tendon_hardware.virtual_bench import Faults
from tests.hardware.servos.virtual_servo import VirtualServo

TORQUE, WATCHDOG = 64, 98

both_families = pytest.mark.parametrize("servo", ["xc330_t288_t", "sts3215"])


@both_families
def test_lost_and_broken_answers_are_asked_for_again(servo: str) -> None:
    """With 5 % lost and 5 % broken, three attempts lose one read in a thousand; all is counted."""
    rig = VirtualServo(servo=servo)
    rig.bench.set_faults(Faults(dropped_replies=0.05, corrupted_replies=0.05))
    missed = 0
    for _ in range(400):
        try:
            rig.servo.read_state()
        except ServoSilent:
            missed += 1
    counters = rig.servo.counters
    assert missed == counters.missed <= 4  # 0.4 expected
    assert counters.silent > 10
    assert counters.corrupted > 10
    assert counters.retries == counters.silent + counters.corrupted - missed


@both_families
def test_noise_before_an_answer_does_no_harm(servo: str) -> None:
    """The frame is found; no read is lost."""
    rig = VirtualServo(servo=servo)
    rig.bench.set_faults(Faults(line_noise=0.3))
    for _ in range(200):
        rig.servo.read_state()
    assert rig.servo.counters.missed == 0


@both_families
def test_no_broken_answer_becomes_a_position(servo: str) -> None:
    """At rest, with one bit flipped in every third answer, every state that arrives is true."""
    rig = VirtualServo(servo=servo)
    rig.bench.set_faults(Faults(corrupted_replies=0.33))
    for _ in range(300):
        try:
            state = rig.servo.read_state()
        except ServoSilent:
            continue
        assert abs(state.position) < 5e-3
        assert abs(state.velocity) < 0.1


@pytest.mark.parametrize(("servo", "gain"), [("xc330_t288_t", 900), ("sts3215", 32)])
def test_a_late_answer_is_never_taken_for_another_questions(servo: str, gain: int) -> None:
    """Every answer is 3 ms later than the driver waits: what it reads is true, and well dated.

    The SDK's own reads take such an answer for the next question's, of whatever length.
    """
    rig = VirtualServo(servo=servo)
    rig.bench.set_faults(Faults(extra_latency=6.5e-3))
    for _ in range(50):
        assert rig.servo.settings().gains.proportional == gain
        health = rig.servo.read_health()
        assert (health.hardware_error, health.torque_enabled) == (0, True)
        assert health.voltage == pytest.approx(rig.bench.state().voltage, abs=0.16)  # a count
        asked = rig.clock.now()
        state = rig.servo.read_state()
        assert abs(state.position) < 5e-3
        assert asked < state.time < asked + 8e-3  # of the first attempt, whose answer it is
    assert rig.servo.counters.missed == 0
    assert rig.servo.counters.silent > 100


def test_answers_that_pile_up_are_not_mixed_up() -> None:
    """The servo answers 80 ms late, by when the driver has asked twenty times and gone on."""
    rig = VirtualServo()
    rig.bench.set_faults(Faults(extra_latency=80e-3))
    for _ in range(60):
        for read, right in (
            (lambda: rig.servo.read_health().torque_enabled, True),
            (lambda: rig.servo.settings().gains.proportional, 900),
            (lambda: abs(rig.servo.read_state().position) < 5e-3, True),
        ):
            try:
                found = read()
            except ServoSilent:
                continue
            assert found == right
    rig.bench.set_faults(Faults())
    rig.wait(0.6)
    assert rig.servo.read_health().torque_enabled


def test_the_watchdog_stops_the_servo_and_says_so() -> None:
    """After 0.3 s of silence goals are refused, until it is cleared and armed again."""
    rig = VirtualServo()
    rig.run(1.0, 0.5)
    rig.wait(0.3)
    with pytest.raises(WatchdogTripped, match=r"no instruction came for 0\.2 s"):
        rig.servo.command_duty(0.1)
    assert rig.servo.read_health().watchdog_tripped
    with pytest.raises(WatchdogTripped):
        rig.servo.check()
    assert rig.servo.counters.watchdog_trips == 2
    rig.servo.enable_torque()
    assert rig.register(WATCHDOG) == 10
    rig.servo.command_duty(0.1)
    assert rig.servo.check().torque_enabled


def test_a_restarted_servo_is_noticed_and_set_up_again() -> None:
    """It has forgotten torque, gains, watchdog and turns; the spring has unwound the spool."""
    rig = VirtualServo("spring_strong")
    rig.run(6.2, 3.0)
    before = rig.servo.read_state().position
    rig.let("reboot")
    rig.wait(0.3)
    with pytest.raises(ServoReset, match="started anew"):
        rig.servo.check()
    rig.servo.recover(resume_torque=True)
    assert (rig.register(TORQUE), rig.register(WATCHDOG)) == (1, 10)
    assert rig.servo.counters.resets == 1
    position = rig.servo.read_state().position
    assert position < before - 1.0  # otherwise this shows nothing
    assert position == pytest.approx(rig.bench.state().angle, abs=0.05)  # backlash and home


def test_a_restart_between_two_configurations_loses_no_turn() -> None:
    """The spool stands at five radians, beyond the turn that the servo begins to count from."""
    rig = VirtualServo()
    rig.run(5.0, 3.0)
    rig.servo.disable_torque()
    rig.wait(2.0)  # the tendon has unwound what it can
    rig.let("reboot")
    rig.wait(0.5)
    rig.servo.configure()
    assert rig.servo.counters.resets == 1
    position = rig.servo.read_state().position
    assert position == pytest.approx(rig.bench.state().angle, abs=0.05)  # backlash and home
    rig.servo.enable_torque()


def test_a_motor_that_something_else_switched_off_is_noticed() -> None:
    """No alert, no restart, and yet no torque: another program wrote the register."""
    rig = VirtualServo()
    rig.corrupt(TORQUE, 0)
    with pytest.raises(ServoReset, match="something else has switched it off"):
        rig.servo.check()
    assert rig.servo.counters.resets == 0
    rig.servo.recover(resume_torque=True)
    assert rig.servo.check().torque_enabled


def test_a_restart_that_is_met_in_silence_is_counted_by_the_reconnection() -> None:
    """While it restarts, nothing answers; afterwards everything is set again."""
    rig = VirtualServo()
    rig.run(1.0, 1.0)
    rig.let("reboot")
    with pytest.raises(ServoSilent):
        rig.run(1.0, 1.0)
    assert rig.servo.reconnect(resume_torque=True)
    assert rig.servo.counters.resets == 1
    assert rig.run(1.0, 1.0)[-1].position == pytest.approx(1.0, abs=0.1)


def test_an_unplugged_adapter_comes_back() -> None:
    """Two seconds away: the port is lost at once, reopened, and positions go on."""
    rig = VirtualServo()
    rig.run(1.0, 1.5)
    rig.let("unplug", duration=2.0)
    start = rig.clock.now()
    with pytest.raises(PortLost, match="gone"):
        rig.servo.read_state()
    with pytest.raises(PortLost, match="not open"):
        rig.servo.read_state()
    assert not rig.servo.reconnect(limit=0.5)
    assert rig.servo.reconnect(limit=5.0, resume_torque=True)
    assert rig.clock.now() - start == pytest.approx(2.0, abs=0.3)  # polls of 50 ms, then setting up
    assert rig.run(1.0, 0.5)[-1].position == pytest.approx(1.0, abs=0.1)
    assert rig.servo.counters.reconnects == 1


def test_a_reconnected_servo_keeps_its_motor_off_unless_asked() -> None:
    """Somebody may have their fingers in it by then."""
    rig = VirtualServo()
    rig.let("unplug", duration=0.5)
    assert rig.servo.reconnect(limit=2.0)
    assert rig.register(TORQUE) == 0
    assert not rig.servo.torque_enabled


def test_an_overload_needs_a_reboot() -> None:
    """The servo has switched its motor off; only a restart clears register 70."""
    rig = VirtualServo()
    rig.run(1.0, 1.0)
    rig.let("alert", alert="overload")
    with pytest.raises(ServoAlert, match="overload"):
        rig.servo.check()
    with pytest.raises(ServoAlert, match="reboot"):
        rig.servo.recover()
    rig.servo.reboot()
    assert not rig.servo.check().alerts
    assert rig.register(TORQUE) == 0
    rig.servo.enable_torque()
    assert rig.run(1.0, 0.5)[-1].position == pytest.approx(1.0, abs=0.1)


def test_the_motor_is_switched_off_over_a_bad_bus() -> None:
    """With 40 % of the answers lost the register still reads back as off in the end."""
    rig = VirtualServo()
    rig.bench.set_faults(Faults(dropped_replies=0.4))
    rig.servo.disable_torque()
    assert rig.register(TORQUE) == 0


def test_a_motor_that_cannot_be_switched_off_is_reported() -> None:
    """Nothing answers any more: closing says that the supply must be switched off."""
    rig = VirtualServo()
    rig.bench.set_faults(Faults(dropped_replies=1.0))
    with pytest.raises(ServoSilent, match="switch its supply off"):
        rig.servo.disable_torque()
    assert not rig.servo.close()


def test_a_port_that_is_gone_cannot_switch_the_motor_off() -> None:
    """Closing says so, and does not fail."""
    rig = VirtualServo()
    rig.let("unplug", duration=60.0)
    assert not rig.servo.close()
