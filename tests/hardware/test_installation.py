"""What the hardware package loads: nothing that a Raspberry Pi does not have."""

import pytest

from tests.interpreters import run_without


@pytest.mark.parametrize(
    "module",
    [
        "tendon_hardware",
        "tendon_hardware.collection.collect_plan",
        "tendon_hardware.deployment.deploy",
        "tendon_hardware.deployment.deploy_plot",
        "tendon_hardware.deployment.deploy_replay",
        "tendon_hardware.deployment.svg_panels",
        "tendon_hardware.doctor",
        "tendon_hardware.load_cells",
        "tendon_hardware.safety_rules.force_estimate",
        "tendon_hardware.servos",
        "tendon_hardware.virtual_bench",
        "tendon_newton.cli",
        "tendon_newton.cli.bench.collect",
        "tendon_newton.cli.bench.deploy",
        "tendon_newton.cli.bench.examined_data",
        "tendon_newton.cli.plot",
        "tendon_newton.data.cards.policy_card",
        "tendon_newton.data.cards.policy_observation",
        "tendon_newton.data.checks.lint",
        "tendon_newton.data.dataset",
        "tendon_newton.data.formats.mcap_file",
        "tendon_newton.data.importers",
        "tendon_newton.data.importers.lerobot.lerobot_examination",
        "tendon_newton.data.importers.own",
        "tendon_newton.data.model_file",
        "tendon_newton.data.parameters",
        "tendon_newton.data.recording",
        "tendon_newton.workflows.collection",
        "tendon_newton.workflows.deployment",
    ],
)
def test_a_pi_needs_only_the_hardware_extra(module: str) -> None:
    """Each part is imported where the others' packages cannot be."""
    run_without(f"import {module}")


def test_recording_and_reading_need_only_the_hardware_extra() -> None:
    """A whole run, recorded and loaded as a dataset, in an interpreter without the simulator."""
    said = run_without("""
import tempfile
from pathlib import Path
from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
with tempfile.TemporaryDirectory() as out:
    words = ["collect", "--port", "virtual", "--faster-than-real-time", "--duration", "2"]
    assert main([*words, "--out", out]) == 0
    print(load_dataset(Path(out), require_test=False).train[0].sample_count)
""")
    assert said.splitlines()[-1] == "160"
