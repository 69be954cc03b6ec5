"""ROS 2 recordings of other programs become datasets by the same mapping file as CSV and JSON."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
from tests.importers.test_rosbag import ROWS, Bag

MAPPING = """
bench = "finger"
clock = "log"
start = "first_row"
load_cell_rate = 20

[columns]
theta_d = {topic = "/goal", field = "data[1]", unit = "deg", offset = 0.5}
theta = {topic = "/joint_states", field = "position", joints = ["spool"], sign = -1}
theta_dot = {derive = "theta"}
force = {topic = "/scale", field = "data", unit = "kg"}

[logs."bag_2*"]
actuator_overrides = {gain = 3.0}
"""


@pytest.fixture
def bags(tmp_path: Path) -> Path:
    """A bag as a folder, one as a lone MCAP file, and a file that is none."""
    folder = tmp_path / "logs"
    folder.mkdir()
    Bag(plugin="sqlite3").write(folder / "bag_1")
    (mcap,) = Bag(plugin="mcap").write(tmp_path / "other").glob("*.mcap")
    mcap.rename(folder / "bag_2.mcap")
    (folder / "notes.txt").write_text("two runs\n")
    return folder


def run_import(bags: Path, mapping: str, *words: str) -> int:
    """Run the command line."""
    path = bags.parent / "mapping.toml"
    path.write_text(mapping)
    out = ["--mapping", str(path), "--out", str(bags.parent / "out")]
    return main(["import", "mapped", str(bags), *out, *words])


def test_bags_and_mcap_files_become_one_dataset(bags: Path) -> None:
    """Units, signs, joints, a derived speed and numbers by log, as in CSV; to its rounding."""
    assert run_import(bags, MAPPING, "--test", "file=bag_2") == 0
    loaded = load_dataset(bags.parent / "out")
    assert [r.name for r in (*loaded.train, *loaded.test)] == ["bag_1.csv", "bag_2.csv"]
    assert loaded.train[0].actuator_overrides == {}
    assert loaded.test[0].actuator_overrides == {"gain": 3.0}
    for run in (loaded.train[0], loaded.test[0]):
        assert (run.start, run.load_cell_rate) == ("first_row", 20.0)
        assert run.command is not None
        assert run.force is not None
        np.testing.assert_allclose(run.time, np.arange(ROWS) / 80.0, atol=1e-8)
        np.testing.assert_allclose(run.motor_position[:, 0], -0.01 * np.arange(ROWS), atol=1e-8)
        np.testing.assert_allclose(run.motor_velocity, -0.8, atol=1e-8)
        np.testing.assert_allclose(run.command, np.pi / 2.0 + 0.5, atol=1e-8)
        np.testing.assert_allclose(run.force, 0.5 * 9.80665, atol=1e-8)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('theta_dot = {derive = "theta"}', 'theta_dot = {column = "rpm"}', "all on topics"),
        ("[columns]", '[columns]\nt = {topic = "/t", field = "data"}', "leave t out"),
        ('clock = "log"', "rate = 80", "rate belongs to a mapping of CSV and JSON files"),
        ('clock = "log"', 'files = "*.txt"', "no ROS 2 recording"),
        ('clock = "log"', 'files = "../*"', "pattern inside the folder"),
        ("bag_2*", "bag_3*", "no log matches logs.'bag_3*'"),
    ],
)
def test_a_wrong_mapping_of_topics_is_one_line(bags, capsys, old, new, words) -> None:
    """Exit code 2 and a message that names the fault; no traceback."""
    assert old in MAPPING
    assert run_import(bags, MAPPING.replace(old, new)) == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1


def test_columns_do_not_fit_a_bag(bags: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A mapping of columns says that a recording of ROS 2 needs topics."""
    mapping = """
bench = "finger"
files = "bag_*"
[columns]
t = {column = "t"}
theta = {column = "angle"}
theta_dot = {derive = "theta"}
"""
    assert run_import(bags, mapping) == 2
    assert "its columns come from a topic and a field" in capsys.readouterr().err
