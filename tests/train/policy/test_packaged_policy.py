"""The policy that comes with the program."""

from pathlib import Path

import numpy as np
import pytest

from hardware.policy_runner import load_policy
from tendon_newton.cli import main
from tendon_newton.mechanisms.asset_library import asset_folder

POLICY = asset_folder() / "policies" / "finger-stairs.onnx"
NETWORK = asset_folder() / "networks" / "transformer-simulation-paper-0.pt"


def test_it_says_what_it_was_trained_for() -> None:
    """A bench that takes it is the nominal one."""
    card = load_policy(POLICY).card
    assert (card.servo, card.rate, card.servo_rate, card.spool_radius) == (
        "xc330_t288_t", 20.0, 80.0, 0.0125,
    )  # fmt: skip
    assert card.command_range == pytest.approx((-0.4, 2.0 * np.pi))


def test_it_climbs_the_stairs_on_a_force_that_it_never_felt(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It learned on a diagnosed model; the network learned from a load cell: 8.0 mm, RMS."""
    words = ["--force", str(NETWORK), "--randomise", "none", "--out", str(tmp_path / "climbed")]
    assert main(["evaluate-policy", str(POLICY), *words]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("| finger-stairs")]
    assert float(line.split("|")[3]) < 9.0
