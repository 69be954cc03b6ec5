"""A Feetech servo under the driver that drives every servo."""

from math import pi

import numpy as np
import pytest

from tendon_hardware.errors import ServoAlert, ServoRefused, ServoReset
from tendon_hardware.servos.feetech.feetech_packets import (
    BROADCAST,
    PING,
    READ,
    WRITE,
    FeetechPackets,
    frame,
)
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.virtual_bench import Faults, LockstepBench
from tendon_hardware.virtual_bench.memory import feetech_table as at
from tendon_hardware.virtual_bench.memory.feetech_table import STS3215
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tests.hardware.servos.virtual_servo import VirtualServo

LOOP = HostPositionLoop(gain=1.5, offset=0.0, duty_limit=0.6, position_range=(-1.0, 9.0))
"""Softer than that of a servo with a third of the torque."""


@pytest.fixture
def rig() -> VirtualServo:
    """A finger on an STS3215, configured and switched on."""
    return VirtualServo(servo="sts3215")


def test_frames_are_those_of_the_manual() -> None:
    """Ping, read of two bytes at 56, and a write of one, for ID 1; a sum over a byte is cut."""
    assert frame(1, PING) == bytes.fromhex("FF FF 01 02 01 FB")
    assert frame(1, READ, bytes([56, 2])) == bytes.fromhex("FF FF 01 04 02 38 02 BE")
    assert frame(BROADCAST, WRITE, bytes([5, 1])) == bytes.fromhex("FF FF FE 04 03 05 01 F4")


def test_a_spool_is_followed_over_the_end_of_a_turn(rig: VirtualServo) -> None:
    """The register begins anew with each turn, whose end is 360 counts from this home."""
    encoder = rig.bench.plant.encoder
    encoder.home += 2000
    rig.wait(0.1)
    rig.servo.set_home()
    assert encoder.home == 4096 - 362
    for goal in (2.5, -0.5, 2.5):
        state = rig.run(goal, 1.5, LOOP)[-1]
        assert state.position == pytest.approx(goal, abs=0.25)  # dry friction, and no integral
        assert rig.bench.state().angle == pytest.approx(state.position, abs=0.01)
    assert rig.servo.close()


def test_speed_and_current_have_their_sign_and_unit(rig: VirtualServo) -> None:
    """Winding in is positive; a servo of the older unit, by its Phase, says the same."""
    for phase in (12, 8):
        rig.corrupt(at.PHASE, phase)
        rig.servo.open()
        for duty in (0.15, -0.15):
            rig.servo.command_duty(duty)
            rig.wait(0.3)
            state = rig.servo.read_state()
            assert state.velocity == pytest.approx(rig.bench.state().rate, abs=0.08)
            assert state.velocity * duty > 0.05


def test_what_its_firmware_does_by_itself_is_read_for_the_log(rig: VirtualServo) -> None:
    """Dead zone, least duty, overload, gains and limits, in SI units."""
    for address, counts in ((at.DEAD_ZONE_CW, 2), (at.OVERLOAD_TORQUE, 70), (at.P_GAIN, 16)):
        rig.corrupt(address, counts)
    settings = rig.servo.settings()
    assert (settings.model, settings.firmware, settings.operating_mode) == ("sts3215", 310, 2)
    assert settings.dead_zone == pytest.approx((2 * pi / 2048, 2 * pi / 4096))
    assert settings.starting_duty == pytest.approx(0.016)
    assert settings.overload.duty == pytest.approx(0.7)
    assert settings.overload.protective_duty == 0.0
    assert settings.overload.time == pytest.approx(0.5)
    assert (settings.gains.proportional, settings.gains.derivative) == (16, 32)
    assert settings.velocity_limit == pytest.approx(5.2, abs=0.05)  # 50 rev/min
    assert (settings.duty_limit, settings.watchdog) == (1.0, 0.0)


def test_nothing_is_kept_when_the_supply_goes(rig: VirtualServo) -> None:
    """An arm that somebody else uses tomorrow is in its own mode, with its own delay."""
    assert (rig.register(at.MODE), rig.register(at.RETURN_DELAY)) == (2, 0)
    rig.let("reboot")
    assert (rig.register(at.MODE), rig.register(at.RETURN_DELAY)) == (0, 250)


def test_a_restart_is_noticed_and_set_up_again(rig: VirtualServo) -> None:
    """The mark is gone; after recovery the servo is where it was, in the turn that it was."""
    rig.run(3.0, 1.5, LOOP)
    rig.let("reboot")
    rig.wait(0.5)
    with pytest.raises(ServoReset, match="started anew"):
        rig.servo.check()
    rig.servo.recover(resume_torque=True)
    assert rig.register(at.MODE) == 2
    assert rig.servo.read_state().position == pytest.approx(rig.bench.state().angle, abs=0.01)


def test_a_forgotten_pull_is_ended_by_the_firmware_and_an_alert(rig: VirtualServo) -> None:
    """Nobody commands any more, though all is read: half a second later the motor does nothing."""
    rig.servo.command_duty(0.2)
    for _ in range(23):
        rig.wait(0.02)
        rig.servo.read_state()
    assert rig.bench.state().duty == pytest.approx(0.2)
    rig.servo.check()
    rig.wait(0.06)
    assert rig.bench.state().duty == 0.0
    with pytest.raises(ServoAlert, match=r"overload \(register 65 is 32\)"):
        rig.servo.check()
    rig.servo.recover(resume_torque=True)
    assert rig.servo.check().torque_enabled


@pytest.mark.parametrize("duty", [0.0196, 0.2])  # the first is 20 counts, and so 2 %
def test_a_pull_that_is_commanded_goes_on(rig: VirtualServo, duty: float) -> None:
    """Ten seconds of one duty at 20 Hz: rests of 3 ms, one in five commands, change no tension."""
    forces, ends = [], rig.clock.now() + 10.0
    while rig.clock.now() < ends:
        rig.servo.command_duty(duty)
        rig.wait(0.05)
        forces.append(rig.bench.state().tension)
    assert rig.servo.check().torque_enabled
    assert np.ptp(forces[100:]) < 0.2  # N, of 38: the gear holds, and a finger creeps


def test_no_more_duty_is_given_than_was_agreed(rig: VirtualServo) -> None:
    """The driver cuts to it, and the servo's own Torque Limit says the same."""
    rig.servo.configure(duty_limit=0.235)
    rig.servo.enable_torque()
    assert rig.servo.command_duty(0.9) == 0.235
    assert rig.register(at.TORQUE_LIMIT) == 235


def test_a_restart_over_the_bus_is_refused(rig: VirtualServo) -> None:
    """The protocol has no such instruction."""
    with pytest.raises(ServoRefused, match="switch its supply off and on"):
        rig.servo.reboot()


def test_all_servos_on_a_bus_are_found() -> None:
    """A ping for all is answered by each in turn, through noise as well."""
    bench = LockstepBench(draw_unit("finger_antagonist", 3, STS3215.name), model=STS3215)
    port = bench.servo_port()
    assert port.setBaudRate(1_000_000)
    assert FeetechPackets(port).find_all() == {1: 777, 2: 777}
    bench.set_faults(Faults(line_noise=0.5))
    assert FeetechPackets(port).find_all() == {1: 777, 2: 777}
