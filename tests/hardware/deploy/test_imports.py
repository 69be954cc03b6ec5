"""A deployment needs nothing but the hardware extra, and little memory."""

from pathlib import Path

import pytest

from tests.hardware.deploy.policies import card_of, network, write_onnx
from tests.hardware.test_installation import run

MEMORY_MAX = 150.0
"""Resident memory of a deployment [MB]; a Pi with 2 GB has other things to do."""


@pytest.mark.parametrize(
    "module",
    [
        "tendon_hardware.deployment.deploy",
        "tendon_hardware.deployment.deploy_plot",
        "tendon_hardware.deployment.deploy_replay",
        "tendon_hardware.deployment.svg_panels",
        "tendon_hardware.safety_rules.force_estimate",
        "tendon_newton.cli.bench.deploy",
        "tendon_newton.cli.plot",
        "tendon_newton.workflows.deployment",
        "tendon_newton.data.cards.policy_card",
        "tendon_newton.data.cards.policy_observation",
    ],
)
def test_a_pi_needs_only_the_hardware_extra(module: str) -> None:
    """Each part is imported where torch, the simulator and matplotlib cannot be."""
    run(f"import {module}")


def test_a_deployment_runs_and_is_drawn_without_anything_else(tmp_path: Path) -> None:
    """Policy, log, replay and picture in an interpreter without torch, in 150 MB."""
    policy = write_onnx(tmp_path / "policy.onnx", network(), card_of().to_json())
    said = run(f"""
import re
from pathlib import Path
from tendon_newton.cli import main
words = ["deploy", "--policy", {str(policy)!r}, "--port", "virtual", "--faster-than-real-time"]
words += ["--goals", "1.0", "--duration", "2", "--out", {str(tmp_path / "runs")!r}]
assert main(words) == 0
log = {str(tmp_path / "runs" / "policy_0.mcap")!r}
assert main(["deploy", "--policy", {str(policy)!r}, "--replay", log]) == 0
assert main(["plot", log]) == 0
print(int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1e3)
""")
    assert float(said.splitlines()[-1]) < MEMORY_MAX
    assert (tmp_path / "runs" / "policy_0.svg").exists()
