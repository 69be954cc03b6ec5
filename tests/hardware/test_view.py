"""Logs and simulations in rerun: what is shown is what was logged, live and afterwards."""

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.deployment.deploy_log import read_steps
from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.formats.mcap_file import McapReading
from tendon_newton.data.formats.topic_mapping import FORCE_TOPIC, STATE_TOPIC, TIP_TOPIC
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.workflows.scene import postures_of
from tendon_newton.workflows.viewing import show_log
from tests.diagnosis.made_up import EXAMPLE, beginning

FAST = ["--port", "virtual", "--faster-than-real-time"]
RUN = ["collect", *FAST, "--excitation", "sine", "--duration", "2"]
LOG = "finger_sine_0"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of two seconds."""
    folder = tmp_path_factory.mktemp("runs")
    assert main([*RUN, "--out", str(folder)]) == 0
    return folder / f"{LOG}.mcap"


def test_a_window_without_its_viewer_is_one_line(log: Path, monkeypatch, capsys) -> None:
    """The viewer is a program of its own; where it is not on the path, a file does."""
    monkeypatch.setenv("PATH", "")
    assert main(["view", str(log)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: a window needs rerun's viewer")
    assert "--to file" in said
    assert said.count("\n") == 1


def shown(file: Path) -> Counter[str]:
    """Return how often each thing is shown in a view's file."""
    from rerun.chunk import RrdReader

    rows: Counter[str] = Counter()
    for chunk in RrdReader(str(file)).stream():
        if not chunk.is_static:
            rows[str(chunk.entity_path)] += chunk.num_rows
    return rows


def logged(file: Path) -> Counter[str]:
    """Return how many messages of each topic a log has."""
    with file.open("rb") as stream:
        reading = McapReading(stream, file.name)
        return Counter(
            topic for topic, *_ in reading.messages({STATE_TOPIC, FORCE_TOPIC, TIP_TOPIC})
        )


def require_all_of(log: Path, file: Path) -> None:
    """Require every state, force and tip of a log in a view's file."""
    there, here = logged(log), shown(file)
    assert there[STATE_TOPIC] > 150
    for topic, places in {
        STATE_TOPIC: ("/angle/measured", "/finger/measured"),
        FORCE_TOPIC: ("/tension/measured",),
        TIP_TOPIC: ("/finger/tip",),
    }.items():
        for place in places:
            assert here[place] == there[topic], place


def test_a_log_is_shown_whole(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every reading of servo, load cell and tip, in a file beside the log."""
    assert main(["view", str(log.parent), "--to", "file"]) == 0
    assert f"{LOG}.rrd" in capsys.readouterr().out
    require_all_of(log, log.with_suffix(".rrd"))


def test_a_recording_is_drawn_and_shown_as_its_dataset_has_it(tmp_path: Path, capsys) -> None:
    """A CSV file as `import` writes it, of the bench that is listed, beside a model's answer."""
    recording = beginning(load_dataset(EXAMPLE).test[0], force=True)
    write_dataset(tmp_path, [replace(recording, name="a.csv")], [])
    (tmp_path / "command.csv").write_text("t,theta_d\n0,0\n")
    file = tmp_path / "a.csv"
    assert main(["plot", str(file)]) == 0
    assert "measured" in file.with_suffix(".svg").read_text()
    words = ["view", str(tmp_path), "--to", "file"]
    assert main([*words, "--model", str(EXAMPLE / "model.toml")]) == 0
    both = shown(file.with_suffix(".rrd"))
    for place in ("angle/measured", "angle/simulated", "tension/simulated", "finger/simulated"):
        assert both[f"/{place}"] == recording.sample_count, place
    assert main(words) == 0
    alone = shown(file.with_suffix(".rrd"))
    assert alone["/angle/measured"] == recording.sample_count
    assert not any("simulated" in place for place in alone)
    assert str(file.with_suffix(".rrd")) in capsys.readouterr().out


def test_a_log_that_breaks_off_is_shown_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    """What its program wrote before it died."""
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(log.read_bytes()[:20_000])
    assert show_log(broken, "file").target == tmp_path / "broken.rrd"
    assert 0 < shown(tmp_path / "broken.rrd")["/angle/measured"] < logged(log)[STATE_TOPIC]


def test_goals_and_the_end_of_a_policy_are_shown(tmp_path: Path) -> None:
    """The goal of every step, as an angle and as a point, and what the rules did."""
    words = ["deploy", *FAST, "--policy", "finger-stairs", "--goals", "0.8", "--duration", "2"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    assert main(["view", str(tmp_path), "--to", "file"]) == 0
    here = shown(tmp_path / "finger-stairs_0.rrd")
    steps = len(list(read_steps(tmp_path / "finger-stairs_0.mcap")))
    assert here["/goal/alpha"] == here["/finger/goal"] == steps > 30
    assert here["/events"] >= 1, "its planned end"


def test_the_finger_stands_where_its_motor_says() -> None:
    """The posture's excursion is the motor's angle times the spool's radius, l = r theta."""
    postures = postures_of("finger")
    (tendon,) = postures.mechanism.tendons
    for angle in (0.2, 0.3, 1.0):
        wound = float(excursion(tendon, postures.joints_at(angle)))
        assert wound == pytest.approx(tendon.spool_radius * angle, abs=2e-6)  # between 101 postures
    slack, hanging = postures.joints_at(-1.0), equilibrium(postures.mechanism, np.zeros(1))
    assert slack == pytest.approx(hanging), "a string that is let out further does not push"
    assert postures.size == pytest.approx(0.055)
    assert postures.bones(np.zeros(2))[-1][1] == pytest.approx([0.055, 0.0], abs=1e-9)


def test_a_bench_without_an_asset_has_no_finger() -> None:
    """Its signals are shown, and no posture."""
    assert postures_of("of_another_computer") is None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["view", "nowhere.mcap"], "nowhere.mcap: no log (.mcap, .csv) is there"),
        (["view", "."], "no log (.mcap, .csv) is there"),
        (["view"], "a view needs a log"),
    ],
)
def test_what_cannot_be_shown_is_one_line(words, said, tmp_path, monkeypatch, capsys) -> None:
    """It names the path."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    assert said in capsys.readouterr().err


def test_without_rerun_the_extra_is_named(log, monkeypatch, capsys) -> None:
    """One line says what to install."""
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main(["view", str(log)]) == 2
    assert "pip install 'tendon-newton[view]'" in capsys.readouterr().err
