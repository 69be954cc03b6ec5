"""The policy that comes with the program."""

import json

import numpy as np
import pytest

from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_log import read_steps
from tendon_newton.cli import main
from tendon_newton.mechanisms.asset_library import asset_folder

POLICY = asset_folder() / "policies" / "finger-stairs.onnx"


def test_it_says_what_it_was_trained_for() -> None:
    """A bench that takes it is the nominal one, and pays out as in training."""
    card = load_policy(POLICY).card
    assert (card.servo, card.rate, card.servo_rate, card.spool_radius) == (
        "xc330_t288_t",
        20.0,
        80.0,
        0.0125,
    )
    assert card.command_range == pytest.approx((-1.2, 2.0 * np.pi))
    assert card.pay_out == (0.0, 0.05)


@pytest.mark.parametrize(
    ("state", "worst"), [pytest.param("new", 8.0, marks=pytest.mark.slow), ("friction", 9.0)]
)
def test_it_climbs_the_stairs_on_a_bench_that_it_never_met(tmp_path, state, worst) -> None:
    """Unit 1, new and with a gear run dry, in mm; at home the motor stops, and no rule acts."""
    words = ["--port", f"virtual:finger:1:{state}", "--faster-than-real-time", "--no-plots"]
    out = tmp_path / "climbed"
    assert main(["evaluate-policy", str(POLICY), *words, "--out", str(out), "--force"]) == 0
    (climb,) = json.loads((out / "evaluation.json").read_text())["climbs"]
    assert 1e3 * climb["rmse"] < worst
    assert 1e3 * climb["rising_rmse"] < worst
    assert 1e3 * climb["falling_rmse"] < worst
    assert climb["least_motor_angle"] > -0.02  # encoder, 1.5 mrad a count, and a step's way
    (log,) = out.rglob("*.mcap")
    steps = list(read_steps(log))
    assert len(steps) > 320
    assert not any(step.held for step in steps)
    deepest = min(step.command[0] for step in steps)
    assert deepest < -0.8, "it makes use of the rule"
