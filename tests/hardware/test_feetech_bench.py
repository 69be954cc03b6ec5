"""Every verb that drives a bench drives one with a Feetech servo."""

from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.doctor.observation import Observation
from tendon_hardware.doctor.servo_checks import check_servo
from tendon_hardware.doctor.servo_search import (
    FoundServo,
    find_servos,
    reboot_servos,
    set_baud,
    set_identifier,
)
from tendon_hardware.errors import ServoRefused
from tendon_hardware.virtual_bench import FaultEvent, LockstepBench
from tendon_hardware.virtual_bench.process import lockstep_of
from tendon_newton.cli import main
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mcap_file import read_session

FAST = ["--port", "virtual::3", "--servo", "sts3215", "--faster-than-real-time"]


@pytest.fixture
def bench() -> LockstepBench:
    """A bench whose clock goes on while its user waits: a search asks at many rates."""
    return lockstep_of("virtual:finger:2", "sts3215")


def quiet(text: str) -> None:
    """Show nothing."""
    del text


def examined(bench: LockstepBench) -> dict[str, Observation]:
    """Return what the doctor says of each subject."""
    return {x.subject: x for x in check_servo(bench.servo_port(), bench.clock, quiet)}


def test_collect_records_what_the_firmware_does_by_itself(tmp_path: Path) -> None:
    """Dead zone, profile, least duty and overload stand in the recording: they are causes."""
    words = ["--excitation", "sine", "--duration", "4", "--out", str(tmp_path)]
    assert main(["collect", *FAST, *words]) == 0
    path = tmp_path / "finger_sine_0.mcap"
    session = read_session(path)
    assert (session["servo.model"], session["servo.operating_mode"]) == ("sts3215", "2")
    assert (session["servo.overload.duty"], session["servo.overload.time"]) == ("0.02", "0.5")
    assert session["servo.overload.protective_duty"] == "0.0"
    assert (session["servo.starting_duty"], session["servo.profile_acceleration"]) == (
        "0.016",
        "254",
    )
    assert session["servo.dead_zone"].count("0.0015") == 2
    assert float(session["host_loop.gain"]) == pytest.approx(0.1 * 0.75 / 2.94)
    recording = read_recording_file(path, bench="finger")
    assert np.ptp(recording.motor_position) > 0.2  # a loop this soft hardly beats the gear
    assert recording.force is not None


def test_deploy_turns_the_spool_by_hand(tmp_path: Path) -> None:
    """`--jog` opens, arms and closes the servo, and logs it."""
    assert main(["deploy", "--jog", *FAST, "--duration", "2", "--out", str(tmp_path)]) == 0
    assert read_session(tmp_path / "jog_0.mcap")["servo.model"] == "sts3215"


def test_the_doctor_says_what_is_special_about_it(bench: LockstepBench) -> None:
    """No watchdog of its own, and what its firmware does by itself."""
    found = examined(bench)
    assert found["servo 1"].found == "sts3215 at 1000000 baud"
    assert found["servo 1 watchdog"].verdict == "note"
    assert "20% duty after 2 s at 80% or more" in found["servo 1 firmware"].found
    assert "errors of 1.5 mrad" in found["servo 1 firmware"].found
    assert found["servo 1 supply"].verdict == "good"


def test_the_doctor_examines_a_virtual_one(capsys: pytest.CaptureFixture[str]) -> None:
    """`--servo` names what a virtual bench has; a real servo needs no name."""
    assert main(["doctor", "--port", "virtual", "--servo", "sts3215"]) == 0
    assert "sts3215 at 1000000 baud" in capsys.readouterr().out


def test_an_alert_is_named_and_ends_with_the_supply(bench: LockstepBench) -> None:
    """Nothing restarts it over the bus, and the doctor does not say that something would."""
    bench.plan(FaultEvent(name="alert", alert="overheating"))
    alerts = examined(bench)["servo 1 alerts"]
    assert (alerts.verdict, alerts.found) == ("fix", "overheating")
    assert "switch its supply off and on" in alerts.remedy
    with pytest.raises(ServoRefused, match="switch its supply off and on"):
        reboot_servos(bench.servo_port(), bench.clock, quiet)


def test_id_and_rate_are_kept_without_the_supply(bench: LockstepBench) -> None:
    """They are written behind the open lock, which is shut again."""
    port, clock = bench.servo_port(), bench.clock
    assert "has the ID 7" in set_identifier(port, 7, clock, quiet).found
    assert "from 1000000 to 500000" in set_baud(port, 500_000, clock, quiet).found
    bench.plan(FaultEvent(name="reboot"))
    clock.sleep_until(clock.now() + 1.0)
    assert find_servos(port, clock, quiet) == FoundServo(
        family="feetech", rate=500_000, models={7: 777}
    )
