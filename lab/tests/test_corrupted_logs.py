"""The benchmark of corrupted logs: what its scorer counts, and that its faults are faults."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lab.benchmarks.corrupted_logs.faults import FAULTS, JOINT
from lab.benchmarks.corrupted_logs.logs import EPISODES, JOINTS, RATE, ROWS, Log
from lab.benchmarks.corrupted_logs.score import score

SCORER = Path(__file__).parents[1] / "benchmarks/corrupted_logs/score.py"
TRUTH = {
    "a": {"kind": None, "twin": "a"},
    "a_small": {"kind": "seam", "size": 0, "also": [], "joint": "elbow_flex",
                "spoilt": {"1": [40, 60]}, "twin": "a"},
    "a_large": {"kind": "offset", "size": 2, "also": ["jump"], "joint": None, "spoilt": {},
                "twin": "a"},
}  # fmt: skip


@pytest.mark.parametrize(
    ("own", "named", "seen"),
    [
        ({}, 0, 0),
        ({"a_small": [{"kind": "seam", "joint": "elbow_flex"}]}, 1, 1),
        ({"a_small": [{"kind": "seam"}], "a_large": [{"kind": "jump"}]}, 2, 2),
        ({"a_small": [{"kind": "seam", "joint": "wrist_flex"}]}, 0, 0),
        ({"a_small": [{"kind": "offset", "joint": "elbow_flex"}]}, 0, 1),
        ({log: [{"kind": "seam"}] for log in TRUTH}, 0, 0),
    ],
)
def test_a_fault_is_named_by_kind_and_joint_and_not_said_of_its_twin(
    own: dict[str, list[dict[str, str]]], named: int, seen: int
) -> None:
    """A constant answer is said of the clean twin too, so it names nothing."""
    found = score(TRUTH, own)
    assert found["named"] == [named, 2]
    assert found["seen"] == [seen, 2]
    assert found["clean_and_silent"] == [0 if "a" in own else 1, 1]


def test_the_scorer_runs_alone(tmp_path: Path) -> None:
    """A file of any program and an interpreter without packages suffice; stated rows are judged."""
    rows = {"a_small": [{"kind": "seam", "episode": 1, "rows": [60, 70]}]}
    for name, content in (("truth", TRUTH), ("findings", rows)):
        (tmp_path / f"{name}.json").write_text(json.dumps(content))
    words = [sys.executable, "-I", "-S", SCORER, "truth.json", "findings.json"]
    answer = subprocess.run(words, check=True, capture_output=True, text=True, cwd=tmp_path)
    assert json.loads(answer.stdout)["rows_right"] == [1, 1]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.kind)
def test_a_fault_grows_with_its_size_and_spares_other_joints(
    fault, rng: np.random.Generator
) -> None:
    """Every size changes the log, the small one in no more rows; one joint alone where it is so."""
    time = np.tile(np.arange(ROWS) / RATE, (EPISODES, 1))
    phases = rng.uniform(0.0, 6.0, (EPISODES, 1, len(JOINTS)))
    action = 30.0 * np.sin(2.0 * time[:, :, None] + phases)
    state = np.roll(action, 2, axis=1) + rng.normal(0.0, 0.02, action.shape)
    log = Log(time=time, action=action, state=state, kept=np.ones(time.shape, dtype=np.bool_))
    counts: list[int] = []
    for size in fault.sizes:
        own = log.copy()
        counts.append(int(fault.spoil(own, size, rng).sum()))
        same = {n: np.array_equal(values, getattr(log, n)) for n, values in vars(own).items()}
        assert not all(same.values())
        if not fault.every:
            others = [k for k in range(len(JOINTS)) if k != JOINT]
            assert np.array_equal(own.state[..., others], state[..., others])
            assert np.array_equal(own.action[..., others], action[..., others])
    assert 0 < counts[0] <= counts[-1]
