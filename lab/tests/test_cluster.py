"""The lab's jobs on the workers of a cluster."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from lab.tests.reproduction.tiny import TinyBench
from tendon_lab.sweep import SweepConfig
from tendon_lab.sweep import main as train_all
from tendon_newton.cli import main
from tendon_newton.scheduler import JobOptions
from tests.train.actuator.servo_logs import write_servo_dataset


@pytest.mark.slow
def test_an_exam_is_taken_by_a_cluster(cluster: str, tmp_path: Path) -> None:
    """The verb's own jobs travel: each dataset gets its answer, here why there is none."""
    folder, out = tmp_path / "exam", tmp_path / "out"
    (folder / "truth").mkdir(parents=True)
    for name in ("one", "two"):
        (folder / name).mkdir()
        (folder / name / "dataset.toml").touch()
        truth = {"id": name, "family": "clean", "effects": []}
        (folder / "truth" / f"{name}.json").write_text(json.dumps(truth))
    assert main(["exam", str(folder), "--out", str(out), "--scheduler", cluster]) == 0
    assert "dataset.toml" in (out / "one" / "error.txt").read_text()
    assert (out / "two" / "error.txt").is_file()


def test_a_sweep_is_trained_by_a_cluster(cluster: str, tmp_path: Path) -> None:
    """The networks are those that one process trains."""
    folder = write_servo_dataset(tmp_path / "data", duration=6.0)
    sweep = SweepConfig(
        dataset=folder,
        out=tmp_path / "here",
        networks=("mlp",),
        sets=("matched",),
        seeds=(0, 1),
        epochs=1,
        windows_per_epoch=512,
        export=False,
    )
    train_all(sweep)
    options = JobOptions(scheduler=cluster)
    train_all(replace(sweep, out=tmp_path / "there", jobs=options))
    for name in ("mlp-matched-0.json", "mlp-matched-1.json"):
        here, there = ((tmp_path / where / name).read_text() for where in ("here", "there"))
        assert here == there


@pytest.mark.slow
def test_a_reproduction_runs_on_a_cluster(cluster: str, tmp_path: Path) -> None:
    """A stage's jobs travel with all that it needs; its figures and results are in OUT."""
    bench = tmp_path / "bench"
    TinyBench().record(0, bench, seed=0, most=None)
    words = ["--recordings", str(bench), "--only", "ramp", "--quick"]
    for where, options in (("here", []), ("there", ["--scheduler", cluster])):
        assert main(["reproduce", "--out", str(tmp_path / where), *words, *options]) == 0
    rows = [
        json.loads((tmp_path / where / "reproduction.json").read_text())["stages"]
        for where in ("here", "there")
    ]
    assert rows[0] == rows[1]
    assert rows[0]["ramp"]["rows"]
