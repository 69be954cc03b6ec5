"""A family of servos is a folder and a line, and a servo of it a data sheet and a line."""

from dataclasses import replace

import pytest

from tendon_hardware.doctor.servo_checks import check_servo
from tendon_hardware.errors import ServoAlert
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.virtual_bench import FaultEvent, LockstepBench
from tendon_hardware.virtual_bench.emulation.emulations import EMULATED
from tendon_hardware.virtual_bench.memory.feetech_table import FeetechModel
from tendon_hardware.virtual_bench.physics import unit

TOY = FeetechModel(name="toy", number=999)
WORD, REMEDY = "feels too warm", "let it rest"


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> LockstepBench:
    """A bench with a servo of a third family, whose bus is that of another one."""
    alike, servo = FAMILIES["feetech"], SERVOS["sts3215"]
    family = replace(alike, alerts={2: WORD}, remedy=REMEDY)
    monkeypatch.setitem(FAMILIES, "toys", family)
    monkeypatch.delitem(FAMILIES, "feetech")  # it would answer as well
    monkeypatch.setitem(SERVOS, "toy", replace(servo, name="toy", model_number=999, family="toys"))
    monkeypatch.setitem(EMULATED, "toys", replace(EMULATED["feetech"], models=(TOY,)))
    monkeypatch.setitem(unit.SERVOS, "toy", unit.SERVOS["sts3215"])
    return LockstepBench(unit.draw_unit("finger", 2, TOY.name), model=TOY)


def test_a_third_family_is_found_examined_and_driven(bench: LockstepBench) -> None:
    """The doctor knows it, says its own words for an alert and what ends it; the driver too."""
    port, clock = bench.servo_port(), bench.clock
    seen = {x.subject: x for x in check_servo(port, clock, lambda _: None)}
    assert seen["servo 1"].found == "toy at 1000000 baud"
    bench.plan(FaultEvent(name="alert", alert="overheating"))
    (alert,) = [x for x in check_servo(port, clock, lambda _: None) if "alerts" in x.subject]
    assert (alert.verdict, alert.found) == ("fix", WORD)
    assert alert.remedy.endswith(REMEDY)
    servo = BusServo(SERVOS["toy"], port, clock=clock)
    servo.open()
    assert servo.read_health().alerts == (WORD,)
    servo.configure()
    with pytest.raises(ServoAlert, match=f"{WORD}.*{REMEDY}"):
        servo.enable_torque()
