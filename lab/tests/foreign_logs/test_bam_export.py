"""What is exported for Rhoban/bam is read again by the importer of its parameter files."""

from pathlib import Path

import pytest

from tendon_lab.foreign_logs.bam.bam_parameters import read_parameters
from tendon_newton.exports.bam_target import (
    PARAMETER_FILE,
    write_bam_target,
)
from tendon_newton.simulation.hosts.replay import bench_of
from tests.exports.models import PWM, model_of

FRICTIONS = ("coulomb_friction", "stribeck_friction", "gear_load_friction",
             "load_stribeck_friction", "load_dependent_friction", "viscous_friction")  # fmt: skip

WHOLE = 1.0e-9  # relative: nothing but the rounding of one division lies between


@pytest.mark.parametrize("friction", FRICTIONS)
def test_a_servo_comes_back_as_it_was(friction: str, tmp_path: Path) -> None:
    """Our own importer reads motor and friction out of the file again, on a shaft."""
    model = model_of("pendulum", "pwm_servo", friction)
    write_bam_target(tmp_path, bench_of("pendulum", model), model)
    back = read_parameters(tmp_path / PARAMETER_FILE)
    assert back.left_out == ()
    found = {effect.name: dict(effect.values) for effect in back.model.effects}
    (given,) = model.effects
    assert found.pop(given.name) == pytest.approx(dict(given.values), rel=WHOLE)
    values = back.model.actuator.values
    gain = found.pop("gain_error")["scale"] * float(values["duty_per_rad"])
    assert gain == pytest.approx(PWM["duty_per_rad"], rel=WHOLE)
    assert found == {}
    for name in ("torque_constant", "resistance"):
        assert values[name] == pytest.approx(PWM[name], rel=WHOLE)
