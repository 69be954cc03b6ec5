"""Many networks with one command, here or where there is no simulator."""

import json
import subprocess
import sys
from pathlib import Path

from tendon_lab.sweep import SweepConfig, main
from tests.train.actuator.servo_logs import write_servo_dataset


def test_training_needs_no_simulator() -> None:
    """A machine with torch alone can run a sweep: neither Warp, Newton, USD nor ONNX is loaded."""
    code = "import sys, tendon_lab.sweep; print(*sys.modules)"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    heavy = {"warp", "newton", "pxr", "onnx", "matplotlib", "scipy", "tensorboard"}
    assert heavy & set(result.stdout.split()) == set()


def test_a_sweep_trains_here_and_exports_there(tmp_path: Path) -> None:
    """Without export it leaves checkpoints; the same sweep with it trains no further."""
    folder = write_servo_dataset(tmp_path / "data", duration=6.0)
    common = {
        "dataset": folder,
        "out": tmp_path / "nets",
        "networks": ("mlp", "rnn"),
        "sets": ("matched",),
        "seeds": (0, 1),
        "epochs": 2,
        "windows_per_epoch": 512,
    }
    names = {f"{kind}-matched-{seed}" for kind in ("mlp", "rnn") for seed in (0, 1)}
    main(SweepConfig(**common, export=False))
    checkpoints = {p.stem: p.read_bytes() for p in (tmp_path / "nets").glob("*.checkpoint")}
    assert checkpoints.keys() == names
    assert not list((tmp_path / "nets").glob("*.pt"))
    main(SweepConfig(**common))
    assert {p.stem for p in (tmp_path / "nets").glob("*.pt")} == names
    assert {p.stem for p in (tmp_path / "nets").glob("*.onnx")} == names
    assert all(
        (tmp_path / "nets" / f"{n}.checkpoint").read_bytes() == checkpoints[n] for n in names
    )
    history = json.loads((tmp_path / "nets" / "mlp-matched-1.json").read_text())
    assert history["epochs"] == len(history["history_n"]) == 2
