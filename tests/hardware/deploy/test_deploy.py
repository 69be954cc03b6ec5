"""A deployment as its user has it: a command, a log that is a recording, a replay, a picture."""

import re
import signal
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.benches.bench import Bench
from tendon_hardware.control.goals import stairs
from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.deployment.deploy_log import read_steps
from tendon_hardware.deployment.deploy_plot import panels_of
from tendon_hardware.deployment.deploy_replay import replay_log
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.logs.mcap_file import McapFile
from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tendon_hardware.stop_request import StopRequest
from tendon_newton.cli import main
from tendon_newton.data.cards.policy_observation import ObservationHistory
from tendon_newton.data.dataset import (
    ListedRecording,
    list_recording,
    load_dataset,
    write_dataset,
)
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mcap_file import messages_of, read_session
from tendon_newton.data.formats.topic_mapping import DIAGNOSTICS_TOPIC
from tendon_newton.data.model_file import write_model
from tendon_newton.workflows.deployment import bench_address, conclude, free_log
from tendon_newton.workflows.options import DeployOptions
from tests.bad_input.damage import refusal
from tests.hardware.deploy.policies import Proportional, card_of, network, write_onnx
from tests.hardware.deploy.runs import Flight, closing
from tests.hardware.silent_operator import SilentOperator
from tests.importers.logs import recording
from tests.made import stated_model

pytestmark = pytest.mark.usefixtures("nobody_at_the_keys")

WORDS = ["deploy", "--port", "virtual", "--faster-than-real-time"]


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy that closes the finger, as a file."""
    folder = tmp_path_factory.mktemp("policy")
    return write_onnx(folder / "closing.onnx", Proportional(), card_of().to_json())


def test_a_command_deploys_and_its_folder_is_a_dataset(policy, tmp_path, capsys) -> None:
    """Two deployments make a dataset that loads; replaying a log gives the same actions."""
    out = tmp_path / "runs"
    words = [*WORDS, "--policy", str(policy), "--out", str(out), "--goals", "stairs"]
    assert main([*words, "--duration", "4"]) == 0
    assert main([*words, "--duration", "3", "--split", "test"]) == 0
    said = capsys.readouterr().out
    assert "ended: complete" in said
    loaded = load_dataset(out)
    (train,), (test,) = loaded.train, loaded.test
    assert (train.name, test.name) == ("closing_0.mcap", "closing_1.mcap")
    assert train.start == "first_row"
    assert train.load_cell_rate == 20.0
    assert train.command is not None
    assert train.force is not None
    assert train.tip is not None
    np.testing.assert_allclose(np.diff(train.time), 0.0125, atol=1.5e-3)  # a transaction's length
    assert main(["deploy", "--policy", str(policy), "--replay", str(out / "closing_0.mcap")]) == 0
    assert "outputs differ by 0.00e+00 rad" in capsys.readouterr().out


def test_the_bench_is_that_of_the_policys_training(tmp_path, monkeypatch, capsys) -> None:
    """On a desk its recordings get that name; a rehearsal on another bench is told."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "mine.usda").touch()
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", str(tmp_path))
    training = replace(card_of().training, files={"mine/mine.usda": "0" * 64})
    card = card_of(training=training)
    file = write_onnx(tmp_path / "mine.onnx", Proportional(), card.to_json())
    desk = DeployOptions(policy=file, port="/dev/ttyUSB0")
    assert bench_address(desk, load_policy(file)).bench == "mine"
    words = [*WORDS, "--policy", str(file), "--goals", "0.5", "--duration", "1"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    assert "trained for mine; this bench is finger" in capsys.readouterr().out
    (run,) = load_dataset(tmp_path / "out", require_test=False).train
    assert run.bench == "finger"


def test_stairs_end_by_themselves_without_an_alarm(tmp_path, capsys) -> None:
    """The packaged policy, by its name: 16.5 s at 80 Hz, and no line that cries out."""
    words = [*WORDS, "--policy", "finger-stairs", "--out", str(tmp_path), "--goals", "stairs"]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "ended: complete" in said
    assert "!!" not in said
    (run,) = load_dataset(tmp_path, require_test=False).train
    assert run.time[-1] == pytest.approx(16.5, abs=0.1)
    late = re.search(r"late by ([\d.]+) ms \(median\), ([\d.]+) ms \(99 %\), ([\d.]+) ms", said)
    median, most, worst = map(float, late.groups())
    assert median <= most <= worst
    logged = messages_of(tmp_path / run.name, DIAGNOSTICS_TOPIC)
    rules = [s for *_, message in logged for s in message.status if s.name == "safety"]
    assert [(status.level, status.message) for status in rules] == [(0, "it has its full length")]


def test_a_command_that_is_cut_is_no_alarm(tmp_path: Path) -> None:
    """Sound policies jump at the ends of their range; the rule acts, and nothing cries out."""
    settings = DeploySettings(duration=2.0, limits=DeployLimits(command_rate=1.0))
    flight = Flight(path=tmp_path / "run.mcap", settings=settings)
    assert flight.fly().trips["command_rate"] > 0
    assert not [line for line in flight.operator.told if "cut" in line.lower()]


def test_a_run_that_nothing_ends_is_refused(policy, tmp_path, capsys) -> None:
    """Faster than real time and without keys it would fill the disk."""
    words = [*WORDS, "--policy", str(policy), "--out", str(tmp_path)]
    for goals in ("keyboard", "0.8"):
        assert "--duration must say how long" in refusal([*words, "--goals", goals], capsys)
    assert not list(tmp_path.glob("*.mcap"))


def test_a_log_that_a_killed_deployment_left_is_told(tmp_path: Path) -> None:
    """No list has it, though it is readable; one that ended in order was not to be listed."""
    McapFile(tmp_path / "dry.mcap", {}).finish({})
    for name in ("killed", "listed"):
        McapFile(tmp_path / f"{name}.mcap", {}).close()
    list_recording(tmp_path, ListedRecording(file="listed.mcap", bench="finger", split="train"))
    operator = SilentOperator()
    free_log(DeployOptions(out=tmp_path), operator)
    (told,) = operator.told
    assert told.startswith(f"{tmp_path / 'killed.mcap'}: is in no dataset.toml")


def test_a_list_of_recordings_that_cannot_be_read_is_told_before_the_run(
    policy, tmp_path, capsys
) -> None:
    """Afterwards the log would stand beside it, in no dataset."""
    (tmp_path / "dataset.toml").write_text("recordings = [")
    words = [*WORDS, "--policy", str(policy), "--out", str(tmp_path)]
    assert "must be TOML" in refusal([*words, "--goals", "0.8", "--duration", "2"], capsys)
    assert not list(tmp_path.glob("*.mcap"))


def test_a_busy_computer_is_told_of_once(tmp_path: Path) -> None:
    """Stalls hold the run again and again, 3 s apart; the hint comes with the first."""
    steps = count()

    def stall(bench: Bench, stop: StopRequest) -> None:
        if next(steps) % 60 == 0:
            bench.clock.sleep_until(bench.clock.now() + 0.075)

    settings = DeploySettings(duration=10.0)
    flight = Flight(path=tmp_path / "run.mcap", settings=settings, fault=stall, in_step=True)
    flight.often = True
    outcome = flight.fly()
    assert outcome.trips["loop_overrun"] >= 3
    (busy,) = [line for line in flight.operator.told if "too busy" in line]
    assert busy.startswith("HOLD")
    assert "--faster-than-real-time" in busy


def test_the_log_holds_what_the_policy_saw_bit_for_bit(tmp_path: Path) -> None:
    """From the recording's own readings the observations can be built again, to the last bit."""
    path = tmp_path / "run.mcap"
    flight = Flight(path=path, goals=stairs(0.3), settings=DeploySettings(duration=3.0))
    flight.fly()
    history, states = ObservationHistory(), dict(readings(path))
    for step in read_steps(path):
        instant = max(stamp for stamp in states if stamp <= step.time)
        theta, theta_dot = states[instant]
        observation = history.observe([theta], [theta_dot], [step.sample[4]])
        assert tuple(observation[0, -5:].tolist()) == step.sample
        assert step.output == (closing(observation[0, -5:]),)
        history.act(step.action)


def readings(path: Path) -> list[tuple[float, tuple[float, float]]]:
    """Return stamp [s], position [rad] and velocity [rad/s] of each reading of the servo."""
    return [
        (1e-9 * stamp, (message.position[0], message.velocity[0]))
        for _, stamp, message in messages_of(path, "/servo/state")
    ]


def test_a_command_takes_effect_after_the_reading_that_it_follows_from(tmp_path: Path) -> None:
    """Read, decide, command: within 3 ms, and at 20 Hz."""
    path = tmp_path / "run.mcap"
    Flight(path=path).fly()
    times = np.array([step.time for step in read_steps(path)])
    np.testing.assert_allclose(np.diff(times), 0.05, atol=2e-3)
    stamps = np.array([stamp for stamp, _ in readings(path)])
    late = [step - stamps[stamps <= step].max() for step in times]
    assert max(late) < 3e-3


def test_the_session_says_what_drove_and_why_it_ended(policy: Path, tmp_path: Path) -> None:
    """Policy, card, limits, pacing, trips: all that a log must tell later."""
    path = tmp_path / "run.mcap"
    flight = Flight(path=path, policy=load_policy(policy))
    flight.fault = lambda bench, stop: setattr(stop, "signal", "SIGTERM")
    flight.fly()
    session = read_session(path)
    assert session["policy.sha256"] == flight.policy.sha256
    assert session["policy.card"] == flight.policy.card.to_json()
    assert session["ended"] == "stopped by SIGTERM"
    assert session["safety.trips"] == '{"operator": 1}'
    assert session["simulated"] == "True"
    assert "ticks" in session["pacing"]


def test_a_key_moves_the_spool_slowly() -> None:
    """Ten presses ask for 1 rad at once; the command gets there at 0.5 rad/s."""
    from tendon_hardware.control.goals import FixedGoal
    from tendon_hardware.control.pilot import JogPilot
    from tendon_hardware.servos.host_position_loop import HostPositionLoop
    from tendon_newton.workflows.deployment import JOG_DUTY, JOG_GAIN

    goal = FixedGoal(0.0, (-3.0, 6.0), 0.1)
    for _ in range(10):
        goal.key("up")
    settings = DeploySettings(
        duration=3.0,
        unwind=False,
        loop=HostPositionLoop(
            gain=JOG_GAIN, duty_limit=JOG_DUTY, offset=0.0, position_range=(-3.0, 6.0)
        ),
    )
    flight = Flight(pilot=JogPilot(20.0, (-3.0, 6.0)), goals=goal, settings=settings)
    flight.fly()
    shown = [(p.elapsed, *p.command, *p.position) for p in flight.operator.shown]  # pyright: ignore
    commands = np.array([command for _, command, _ in shown])
    times = np.array([elapsed for elapsed, _, _ in shown])
    assert np.all(commands <= 0.5 * times + 0.05)  # a step is 0.025 rad
    assert shown[-1][1] == pytest.approx(1.0)
    assert shown[-1][2] == pytest.approx(1.0, abs=0.15)  # a P loop against friction


def test_a_picture_needs_no_display(policy: Path, tmp_path: Path) -> None:
    """Plot writes an SVG file that parses, with goal, spool, tension and timing."""
    out = tmp_path / "runs"
    words = [*WORDS, "--policy", str(policy), "--out", str(out), "--goals", "stairs"]
    assert main([*words, "--duration", "3"]) == 0
    assert main(["plot", str(out / "closing_0.mcap")]) == 0
    text = (out / "closing_0.svg").read_text(encoding="utf-8")
    root = ElementTree.fromstring(text)
    titles = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"goal angle [deg]", "spool angle [rad]", "tension [N]", "loop timing [ms]"} <= {*titles}
    (title,) = [text for text in titles if text and text.startswith("closing_0.mcap")]
    said = re.fullmatch(
        r"closing_0\.mcap: policy closing on the virtual bench finger; "
        r"tip ([\d.]+) deg RMS from its goal",
        title,
    )
    assert said is not None, title
    log = read_recording_file(out / "closing_0.mcap", bench="finger")
    goals = {step.time: step.sample[4] for step in read_steps(out / "closing_0.mcap")}
    alpha = np.arctan2(-log.tip[:, 1], log.tip[:, 0])
    held = np.array([goals[max(t for t in goals if t <= time)] for time in log.time[8:-8]])
    assert float(said[1]) == pytest.approx(
        np.degrees(np.sqrt(np.nanmean((alpha[8:-8] - held) ** 2))), rel=0.05
    )
    assert "lateness, median" in titles
    numbers = [float(word) for word in re.findall(r"[ML](-?[\d.]+) ", text)]
    assert numbers
    assert all(0.0 <= number <= 1100.0 for number in numbers)
    assert main(["plot", str(out / "closing_0.mcap"), "--out", str(tmp_path / "a.png")]) == 2


def test_a_recording_is_drawn_too(tmp_path: Path) -> None:
    """A CSV file as `import` writes it."""
    write_dataset(tmp_path, [recording("a.csv")], [])
    assert main(["plot", str(tmp_path / "a.csv")]) == 0
    alone = (tmp_path / "a.svg").read_text()
    assert "measured" in alone
    assert "simulated" not in alone


def test_what_a_model_makes_of_a_log_is_drawn_beside_it(tmp_path: Path) -> None:
    """Its angle beside the encoder's, its tension beside the cell's."""
    write_dataset(tmp_path, [recording("a.csv")], [])
    words = ["plot", str(tmp_path / "a.csv"), "--model"]
    told = stated_model("ideal", {"gain": 50.0})
    write_model(tmp_path / "model.toml", told)
    assert main([*words, str(tmp_path / "model.toml")]) == 0
    assert (tmp_path / "a.svg").read_text().count(">simulated<") == 2
    assert main([*words, str(tmp_path / "nowhere.toml")]) == 2


def test_a_simulated_angle_is_among_angles_and_a_tension_among_tensions() -> None:
    """Each has its own panel and unit."""
    log = recording("a.csv")
    angle, force = np.full((log.sample_count, 1), 1.0), np.full((log.sample_count, 1), 2.0)
    panels = panels_of(log, Path("a.csv"), (angle, force))
    drawn = {p.title: {line.name: line.values[0] for line in p.lines} for p in panels}
    assert drawn["spool angle [rad]"]["simulated"] == 1.0
    assert drawn["tension [N]"]["simulated"] == 2.0


def test_another_policy_is_noticed_in_a_replay(policy, tmp_path, capsys) -> None:
    """The verb ends with an error where actions differ, and the report says by how much."""
    path = tmp_path / "run.mcap"
    Flight(path=path, policy=load_policy(policy)).fly()
    other = write_onnx(tmp_path / "other.onnx", network(), card_of().to_json())
    assert replay_log(load_policy(policy), path).same
    report = replay_log(load_policy(other), path)
    assert report.difference > 0.01
    assert report.broken == 0, "the observations are the log's own"
    assert main(["deploy", "--policy", str(other), "--replay", str(path)]) == 2
    assert "another file, or another engine" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--port", "virtual"], "needs --policy FILE, or --jog"),
        (["--policy", "{policy}"], "needs --port"),
        (["--policy", "{policy}", "--port", "virtual", "--jog"], "--jog moves the spool by hand"),
        (["--policy", "{policy}", "--port", "virtual", "--servo", "xl330_m288_t"], "servo xc330"),
        (["--policy", "{policy}", "--port", "virtual", "--rate", "100"], "servo_rate_hz 80"),
        (["--policy", "{policy}", "--port", "virtual", "--spool-radius", "0.01"], "spool_radius_m"),
        (["--policy", "{policy}", "--port", "virtual", "--goals", "nowhere"], "no such file"),
        (["--policy", "{policy}", "--replay", "{policy}"], "MCAP"),
    ],
)
def test_misuse_is_answered_in_one_line(policy, words, said, tmp_path, capsys) -> None:
    """Nothing moves, one line says what was promised, and the exit code is 2."""
    words = [word.format(policy=policy) for word in words]
    assert said in refusal(["deploy", *words, "--out", str(tmp_path / "out")], capsys)


def test_a_second_signal_does_not_wait_for_the_tendon() -> None:
    """Ctrl-C twice: the second interrupts at once, and the motor is off all the same."""
    import os

    flight = Flight(settings=DeploySettings(duration=30.0))

    def twice(bench, stop) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)

    flight.fault = twice
    with pytest.raises(KeyboardInterrupt):
        flight.fly()


def test_what_ended_a_run_is_said_last(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where the log cannot be listed either, that is told before; the file is named."""
    from tendon_hardware.errors import SafetyStop
    from tendon_newton.cli.terminal import Terminal
    from tests.faults.injections import load

    out = tmp_path / "gone"
    out.mkdir()
    flight = Flight(path=out / "run.mcap", settings=DeploySettings(duration=6.0), fault=load)
    flight.after = 1.5
    outcome = flight.fly()
    (out / "run.mcap").unlink()
    out.rmdir()
    options = DeployOptions(policy=Path("a.onnx"), port="virtual", out=out)
    with pytest.raises(SafetyStop, match="the tension must stay below 30 N"):
        conclude(options, "finger", outcome, Terminal())
    assert f"!! {out / 'dataset.toml'}: cannot be written" in capsys.readouterr().out
