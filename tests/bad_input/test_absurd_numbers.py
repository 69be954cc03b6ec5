"""What cannot be: moves of a bench, types of values, a home without a place."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from tendon_newton.data.dataset import load_dataset
from tendon_newton.device_code.kernel_loading import load_kernels
from tendon_newton.errors import InvalidModelFile, InvalidOutput
from tendon_newton.mechanisms.usd.stage_file import open_stage
from tendon_newton.simulation.hosts.replay import simulated_recording
from tendon_newton.simulation.hosts.rollout import Trajectory
from tests.held_out import small_dataset
from tests.interpreters import search_path
from tests.mechanisms.broken.flat_assets import write_changed

ROOT = Path(__file__).resolve().parents[2]


def test_a_model_that_moves_its_bench_absurdly_is_blamed_and_not_the_data(tmp_path: Path) -> None:
    """Moment arms of 10 m turn a simulated spool a hundred times; the recording is sound."""
    run = load_dataset(small_dataset(tmp_path)).train[0]
    run = replace(run, tip=None)
    moved = Trajectory(
        time=run.time,
        motor_position=1000.0 * run.motor_position + 100.0,
        motor_velocity=run.motor_velocity,
        force=np.zeros_like(run.motor_position),
        joint_position=np.zeros_like(run.motor_position),
    )
    with pytest.raises(InvalidModelFile, match=r"the model moves its bench .* its moment arms"):
        simulated_recording(run, moved)


def test_a_home_that_cannot_be_written_is_told_with_the_mend() -> None:
    """Where compiled kernels would be kept, and the variable that moves them."""
    moved = {"HOME": "/proc", "PYTHONPATH": search_path(ROOT)}
    kept = {k: v for k, v in os.environ.items() if k not in ("WARP_CACHE_PATH", "XDG_CACHE_HOME")}
    code = "from tendon_newton.device_code.quiet import quiet_warp; quiet_warp()"
    run = subprocess.run(
        [sys.executable, "-c", code], env=kept | moved, capture_output=True, text=True
    )
    last = run.stderr.splitlines()[-1]
    assert "InvalidOutput: /proc/.cache" in last
    assert "set WARP_CACHE_PATH to a folder that can be written" in last


def test_a_cache_that_cannot_be_written_is_told_before_anything_compiles(monkeypatch) -> None:
    """Of a place in which even root makes no folder."""
    wp.init()
    monkeypatch.setattr(wp.config, "kernel_cache_dir", "/proc/gone")

    def nothing(values: wp.array[float]) -> None:
        values[wp.tid()] = 5.0

    kernel = wp.Kernel(nothing, key="nothing_kernel", module=wp.Module("nothing_absurd"))
    with pytest.raises(InvalidOutput, match=r"gone: compiled kernels must .* set WARP_CACHE_PATH"):
        load_kernels([kernel], "cpu")


def test_a_value_of_a_type_that_nobody_knows_is_passed_over(tmp_path: Path) -> None:
    """USD gives no text for it, which ended in a traceback."""
    change = ('uniform token axis = "X"', 'uniform tothetaken axis = "X"')
    open_stage(write_changed(tmp_path, "finger", change))
