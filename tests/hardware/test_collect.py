"""Collecting on virtual benches: rows, splits, interruption, limits, and what is refused."""

import os
import signal
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from tendon_hardware.benches.bench import open_bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.benches.virtual_calibration import calibrated_twins
from tendon_hardware.collection.collect import record_run
from tendon_hardware.collection.collect_plan import Collection, collect, recorded_runs
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import (
    BENCHES,
    OBSTACLES,
    PLANS,
    PlannedRun,
    find_plan,
    paper_plan,
)
from tendon_hardware.errors import SafetyStop
from tendon_hardware.load_cells.calibration import write_calibration
from tendon_hardware.logs.session import software
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench import FaultEvent, Faults, LockstepBench, VirtualPorts
from tendon_hardware.virtual_bench.physics.obstacle import OBSTACLES as VIRTUAL_OBSTACLES
from tendon_newton.actuators.pwm_servo import PwmServo
from tendon_newton.cli import main
from tendon_newton.data.dataset import ListedRecording, list_recording, load_dataset
from tendon_newton.data.excitations import EXCITATIONS, TEST_EXCITATIONS, excite
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mcap_file import read_session
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.errors import InvalidOutput, InvalidParameter
from tendon_newton.workflows.collection import planned
from tendon_newton.workflows.options import CollectOptions
from tests.bad_input.damage import refusal
from tests.hardware.recording import Trial, Watcher, begin
from tests.hardware.silent_operator import SilentOperator

LOCKSTEP = BenchAddress(bench="finger", port="virtual", lockstep=True)
SHORT = tuple(
    PlannedRun(name=f"finger_{name}_0", bench="finger", excitation=name, duration=2.0, split=split)
    for name, split in (("sine", "train"), ("ramps", "train"), ("steps_held_1s", "test"))
)


def collected(
    folder: Path,
    runs: Sequence[PlannedRun] = SHORT,
    operator: SilentOperator | None = None,
    title: str = "short",
    **settings: Any,
) -> Collection:
    """Record a plan into a folder, as far as it is not there."""
    with StopRequest() as stop:
        operator = operator or SilentOperator()
        return collect(
            LOCKSTEP, runs, CollectSettings(**settings), folder, operator, stop, title=title
        )


@pytest.mark.parametrize("name", [*EXCITATIONS, *TEST_EXCITATIONS])
def test_every_excitation_stays_inside_the_command_range(name: str) -> None:
    """From 0 to 2 pi, finite, one value per row, whatever is drawn."""
    for seed in range(20):
        time, command = excite(name, 20.0, np.random.default_rng(seed))
        assert time.shape == command.shape == (1600,)
        assert np.all((command >= 0.0) & (command <= 2.0 * pi))


@pytest.mark.parametrize(
    ("name", "lockstep"),
    [*((name, True) for name in (*EXCITATIONS, *TEST_EXCITATIONS)), ("random_steps", False)],
)
def test_every_excitation_drives_a_servo(tmp_path: Path, name: str, lockstep: bool) -> None:
    """The SDK sends each, and what is logged is what was planned; one through a pseudo-terminal."""
    trial = Trial(
        path=tmp_path / "run.mcap",
        excitation=name,
        duration=1.0,
        lockstep=lockstep,
        settings=CollectSettings(settle=0.2),
    )
    outcome = trial.record()
    assert outcome.finished
    assert outcome.rows >= (80 if lockstep else 41), "a busy machine may lose ticks, not half of 80"
    run = PlannedRun(name="run", bench="finger", excitation=name, duration=1.0)
    planned = run.command(trial.settings.seed, trial.settings.rate)
    logged = trial.recording().command
    assert logged is not None
    apart = np.abs(logged - planned[None, :]).min(axis=1)
    assert apart.max() < 1e-6, "as rounded in the file"


def test_the_test_commands_are_those_of_the_paper() -> None:
    """Steps to 0, 2, 4, 1 rad held 1, 2, 3 s; a ramp of 1.5 rad/s; a sine from open to pi."""
    for hold in (1, 2, 3):
        _, steps = excite(f"steps_held_{hold}s", 8.0 * hold, np.random.default_rng(0))
        np.testing.assert_array_equal(steps[40 :: 80 * hold], [0.0, 2.0, 4.0, 1.0] * 2)
        assert np.flatnonzero(np.diff(steps))[0] + 1 == 80 * hold
    _, ramp = excite("contact_ramp", 8.0, np.random.default_rng(0))
    np.testing.assert_allclose(np.diff(ramp[:335]) * 80.0, 1.5, rtol=1e-9)
    assert ramp.max() > 2.0 * pi - 0.02
    _, sine = excite("closing_sine", 4.0, np.random.default_rng(0))
    assert (sine[0], sine.max()) == (0.0, pytest.approx(pi))


def test_the_paper_plan_has_its_proportions() -> None:
    """36 minutes, half on the finger, a quarter on each spring, with whole recordings held out."""
    plan = paper_plan()
    minutes = {
        bench: sum(run.duration for run in plan if run.bench == bench) / 60.0 for bench in BENCHES
    }
    assert minutes == pytest.approx({"finger": 18.0, "spring_weak": 9.0, "spring_strong": 9.0})
    assert len({run.name for run in plan}) == len(plan)
    tests = {(run.bench, run.excitation, run.obstacle) for run in plan if run.split == "test"}
    assert tests == {
        *((b, f"steps_held_{k}s", "free") for b in minutes for k in (1, 2, 3)),
        *(("finger", "contact_ramp", obstacle) for obstacle in ("free", "tape_roll", "hand")),
        ("finger", "closing_sine", "free"),
        ("finger", "closing_sine", "hand_perturbation"),
    }
    trained = {run.excitation for run in plan if run.split == "train"}
    assert trained == {"random_steps", "sine", "ramps", "stairs"}


@pytest.mark.parametrize("name", PLANS)
def test_every_plan_shows_a_bench_in_two_training_runs(name: str) -> None:
    """Under different commands: what is known of a bench can be tried on a run not fitted."""
    for bench in {run.bench for run in find_plan(name)}:
        runs = [r for r in find_plan(name) if r.bench == bench and r.split == "train"]
        assert len({run.excitation for run in runs}) > 1


def test_the_board_s_plan_repeats_a_motion_and_keeps_a_condition_back() -> None:
    """The same command thrice through the session; what blocks the finger is only predicted."""
    plan = find_plan("board")
    places = [k for k, run in enumerate(plan) if run.excitation == "steps_held_2s"]
    assert len(places) == 3
    assert places[0] > 0  # a finger that has not moved yet starts from elsewhere
    for k in places[1:]:
        np.testing.assert_array_equal(plan[k].command(1, 80.0), plan[places[0]].command(2, 80.0))
    assert {run.split for run in plan if run.obstacle != "free"} == {"test"}
    assert 60.0 * 6.0 < sum(run.duration for run in plan) < 60.0 * 8.0


@pytest.mark.parametrize("name", PLANS)
def test_every_plan_can_be_recorded(name: str) -> None:
    """Benches come one after the other, obstacles are known, commands are drawn per run."""
    plan = find_plan(name)
    benches = [run.bench for run in plan]
    assert benches == sorted(benches, key=benches.index)
    assert {run.obstacle for run in plan} <= set(OBSTACLES) & set(VIRTUAL_OBSTACLES)
    for run in plan:
        command = run.command(3, 80.0)
        np.testing.assert_array_equal(command, run.command(3, 80.0))
        drawn = run.excitation in EXCITATIONS
        assert drawn != np.array_equal(command, run.command(4, 80.0))


def test_a_plan_becomes_a_dataset(tmp_path, capsys, monkeypatch) -> None:
    """One command records all benches; the folder loads as contract and layout promise."""
    short = tuple(replace(run, duration=2.0) for run in find_plan("quick"))
    monkeypatch.setitem(PLANS, "quick", lambda: short)
    words = ["collect", "--plan", "quick", "--port", "virtual", "--faster-than-real-time"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    assert "9 recorded now, 0 before, 0 left" in capsys.readouterr().out
    loaded = load_dataset(tmp_path)
    assert [log.bench for log in loaded.train] == [bench for bench in BENCHES for _ in range(2)]
    for log in (*loaded.train, *loaded.test):
        assert log.start == "first_row"
        assert log.load_cell_rate == 20.0
        assert log.force is not None
        # every row to the tick, at its true time: 12.5 ms but for a transaction's length
        np.testing.assert_allclose(np.diff(log.time), 0.0125, atol=1.5e-3)
        assert (log.tip is not None) == (log.bench == "finger")
    assert main([*words, "--out", str(tmp_path)]) == 0
    assert "0 recorded now, 9 before, 0 left" in capsys.readouterr().out


def test_a_failed_start_leaves_nothing_that_blocks_the_next(tmp_path: Path) -> None:
    """A missing calibration is told before anything is written; the folder is then free."""
    out = tmp_path / "recordings"
    plugged = ["collect", "--plan", "paper", "--port", "/dev/ttyNONE", "--load-cell-port", "none"]
    assert main([*plugged, "--calibration", str(tmp_path / "cell.toml"), "--out", str(out)]) == 2
    assert not out.exists()
    # what an earlier version left there: settings of recordings that do not exist
    out.mkdir()
    (out / "collection.toml").write_text('plan = "paper"\nvirtual = false\n', encoding="utf-8")
    virtual = ["collect", "--port", "virtual", "--faster-than-real-time", "--duration", "2"]
    assert main([*virtual, "--out", str(out)]) == 0


def test_recordings_have_a_model_of_their_servo_beside_them(tmp_path: Path) -> None:
    """Its numbers are the loop's, the supply's and the data sheet's; an edited file stays."""
    words = ["collect", "--port", "virtual", "--faster-than-real-time", "--duration", "2"]
    words += ["--servo", "xl330_m288_t", "--spool-radius", "0.01", "--out", str(tmp_path)]
    assert main(words) == 0
    model, loop = load_model(tmp_path / "model.toml"), HostPositionLoop()
    assert model.actuator.name == "pwm_servo"
    assert model.actuator.values == {
        "duty_per_rad": loop.gain,
        "max_duty": loop.duty_limit,
        "duty_offset": loop.offset,
        "supply_voltage": pytest.approx(5.0, abs=0.11),  # to a percent; the servo tells tenths
        "torque_constant": pytest.approx(0.52 / 1.47, abs=1e-4),
        "resistance": pytest.approx(5.0 / 1.47, abs=1e-3),
        "armature": next(p.nominal for p in PwmServo.parameters if p.name == "armature"),
        "spool_radius": 0.01,
        "force_limit": pytest.approx(0.52 / 0.01, abs=0.1),
    }
    assert set(model.fit) <= set(model.actuator.values)
    write_model(tmp_path / "model.toml", replace(model, fit=()))
    assert main(words) == 0
    assert load_model(tmp_path / "model.toml").fit == ()


def test_the_same_seed_gives_the_same_files(tmp_path: Path) -> None:
    """Faster than real time nothing depends on the machine: the files are equal byte by byte."""
    files = [Trial(path=tmp_path / f"{k}.mcap", duration=2.0) for k in range(2)]
    for trial in files:
        trial.record()
    assert files[0].path.read_bytes() == files[1].path.read_bytes()
    other = Trial(path=tmp_path / "2.mcap", duration=2.0, settings=CollectSettings(seed=1))
    other.record()
    command, changed = files[0].recording().command, other.recording().command
    assert command is not None
    assert changed is not None
    assert not np.array_equal(command, changed)


@pytest.mark.parametrize("rate", [20.0, 80.0])
def test_a_command_comes_before_the_reading_that_follows_it(tmp_path: Path, rate: float) -> None:
    """Each reading follows its command at once, and commands come at their own rate."""
    trial = Trial(
        path=tmp_path / "run.mcap",
        duration=4.0,
        excitation="sine",
        settings=CollectSettings(command_rate=rate),
    )
    trial.record()
    with trial.path.open("rb") as file:
        messages = [
            (topic.topic, record.log_time, decoded)
            for _, topic, record, decoded in make_reader(
                file, decoder_factories=[DecoderFactory()]
            ).iter_decoded_messages(topics=["/servo/command", "/servo/state"], log_time_order=False)
        ]
    commands = [place for place, m in enumerate(messages) if m[0] == "/servo/command"]
    assert len(commands) == round(4.0 * rate)
    for place in commands:
        topic, stamp, _ = messages[place + 1]
        assert topic == "/servo/state"
        assert 0 < stamp - messages[place][1] < 5_000_000  # [ns]
    log = trial.recording()
    assert log.command is not None
    expected = PlannedRun(name="run", bench="finger", excitation="sine", duration=4.0).command(
        0, 80.0
    )
    stride = round(80.0 / rate)
    np.testing.assert_array_equal(log.command[:, 0], np.repeat(expected[::stride], stride)[:320])


def test_forces_are_near_the_truth(tmp_path: Path) -> None:
    """Raw counts and a calibration made with hung masses give the plant's own tension."""
    trial = Trial(path=tmp_path / "run.mcap", duration=6.0, excitation="steps_held_3s")
    trial.record()
    log = trial.recording()
    assert log.force is not None
    calibration = calibrated_twins("finger", 0, 80)[0]
    assert trial.session["calibration"] == calibration.identifier
    with trial.path.open("rb") as file:
        raw = [
            decoded.data[2]
            for *_, decoded in make_reader(
                file, decoder_factories=[DecoderFactory()]
            ).iter_decoded_messages(topics=["/load_cell/raw"])
        ]
    # the log's forces are those counts, so a better calibration can be applied later
    np.testing.assert_allclose(
        np.interp(log.time[-40:], log.time, log.force[:, 0]).mean(),
        calibration.force(raw[-40:]).mean(),
        atol=0.05,  # [N] readings and rows are not the same instants
    )


def test_a_recording_says_how_it_was_made(tmp_path: Path) -> None:
    """What decides a step response stands in the file, and at its end how it went."""
    trial = Trial(path=tmp_path / "run.mcap", duration=1.0, load_cell_rate=20)
    trial.record()
    said = trial.session
    expected = {
        "bench": "finger", "excitation": "random_steps", "seed": "0", "mode": "pwm", "rate": "80.0",
        "command_rate": "20.0", "host_loop.gain": "0.1", "servo.firmware": "52",
        "servo.operating_mode": "16", "servo.gains.proportional": "900", "simulated": "True",
        "servo.return_delay": "0.0", "servo.latency_timer": "", "load_cell": "hx711_serial",
        "ended": "complete", "rows": "80", "missed": "0", "gaps": "",
    }  # fmt: skip
    assert {key: said[key] for key in expected} == expected
    assert float(said["load_cell_rate"]) == pytest.approx(20.0, rel=0.02)  # an HX711's oscillator
    assert "mean of 4" in said["load_cell_filter"]
    assert said["software"].startswith("tendon-newton ")
    assert "date" not in said, "a simulated run is the same on every day"
    assert "date" in software(simulated=False)


def test_an_interrupted_plan_is_taken_up_again(tmp_path: Path) -> None:
    """What was finished stays, the partial file is kept unlisted, and the run is made anew."""

    def stop_now() -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    operator = Watcher(1.0, None)
    assert collected(tmp_path, SHORT[:1], operator).left == 0
    kept = (tmp_path / "finger_sine_0.mcap").read_bytes()
    operator.act = stop_now
    second = collected(tmp_path, SHORT, operator)
    assert (second.kept, second.left, second.outcomes[0].interrupted) == (1, 2, "SIGTERM")
    assert operator.told == ["Runs left: 2 of 3. The same command goes on."]
    partial = read_recording_file(tmp_path / "finger_ramps_0.mcap", bench="finger")
    assert 0.9 < partial.duration < 1.6
    third = collected(tmp_path)
    assert (third.kept, third.left) == (1, 0)
    assert (tmp_path / "finger_sine_0.mcap").read_bytes() == kept
    loaded = load_dataset(tmp_path)
    names = ["finger_sine_0.mcap", "finger_ramps_0_again1.mcap"]
    assert [log.name for log in loaded.train] == names
    assert (tmp_path / "finger_ramps_0.mcap").exists()


def test_a_plan_goes_on_after_a_run_that_could_not_begin(tmp_path: Path) -> None:
    """A spool outside its window ends the plan before a row, which tells how it goes on."""
    operator, outside = SilentOperator(), SafetyLimits(position=(0.5, 7.0))
    with pytest.raises(SafetyStop, match=r"the spool must stay within 0\.50 to 7\.00 rad"):
        collected(tmp_path, SHORT[:1], operator, limits=outside)
    assert operator.told == ["Runs left: 1 of 1. The same command goes on."]
    assert collected(tmp_path, SHORT[:1]).left == 0


def test_a_folder_keeps_to_one_plan_and_seed(tmp_path: Path) -> None:
    """Taking a plan up with another seed would mix what belongs apart."""
    collected(tmp_path, SHORT[:1])
    with pytest.raises(InvalidOutput, match="seed = 0; asked for is 1"):
        collected(tmp_path, seed=1)
    with pytest.raises(InvalidOutput, match="plan = 'short'; asked for is 'paper'"):
        collected(tmp_path, title="paper")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--servo", "sts3215"), "servo = 'xc330_t288_t'; asked for is 'sts3215'"),
        (("--spool-radius", "0.01"), "spool_radius_m = 0.0125; asked for is 0.01"),
        (("--port", "virtual::3"), "unit = 0; asked for is 3"),
        (("--port", "virtual::0:friction"), "worn = 'new'; asked for is 'friction'"),
    ],
)
def test_a_folder_keeps_to_one_servo_and_spool(words, said, tmp_path, capsys) -> None:
    """Its model is of one servo on one spool, and a virtual bench's true numbers of one unit."""
    short = ("collect", "--out", str(tmp_path), "--duration", "1", "--faster-than-real-time")
    assert main([*short, "--port", "virtual"]) == 0
    (file,) = tmp_path.glob("plant_*.toml")
    truth = file.read_text()
    assert said in refusal([*short, "--port", "virtual", *words], capsys)
    assert file.read_text() == truth
    facts = tmp_path / "collection.toml"  # as earlier versions wrote it
    facts.write_text('plan = "single runs"\nvirtual = true\n')
    assert main([*short, "--port", "virtual"]) == 0


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        (SafetyLimits(force=8.0), "tension must stay below 8 N"),
        (SafetyLimits(temperature=20.0), "motor must stay below 20 degC"),
        (SafetyLimits(position=(-0.5, 1.5)), "spool must stay within -0.50 to 1.50 rad"),
    ],
)
def test_a_limit_ends_the_run_and_keeps_its_rows(tmp_path, limits, said) -> None:
    """Past a limit the motor is off, the file is closed, and the reason stands in it."""
    settings = CollectSettings(limits=limits, settle=0.0)
    trial = Trial(path=tmp_path / "run.mcap", excitation="contact_ramp", settings=settings)
    outcome = trial.record()
    assert isinstance(outcome.fault, SafetyStop)
    assert said in str(outcome.fault)
    assert said in trial.session["ended"]
    if limits.temperature > 30.0:
        assert trial.recording().duration > 1.0


def test_a_spool_thrown_by_a_strong_spring_is_braked(tmp_path: Path) -> None:
    """Of 210 units, that whose string throws it farthest: the next run begins where it rests."""
    address = BenchAddress(bench="spring_strong", port="virtual::3204", lockstep=True)
    run = PlannedRun(name="run", bench=address.bench, excitation="contact_ramp", duration=4.0)
    operator = SilentOperator()
    with open_bench(address, operator.tell) as bench, StopRequest() as stop:
        for attempt in range(2):
            path = tmp_path / f"{attempt}.mcap"
            outcome = record_run(bench, run, CollectSettings(), path, operator, stop)
            assert outcome.finished
            rest = bench.controls.state()
            assert -0.8 < rest.angle < -0.5
            assert rest.rate == 0.0
            assert not bench.servo.torque_enabled
    assert operator.told == []


def test_a_spool_at_the_edge_of_its_window_may_still_come_to_rest(tmp_path: Path) -> None:
    """It still turns out when the motor is switched on, and a few milliseconds longer."""
    run = PlannedRun(name="run", bench="finger", excitation="ramps", duration=1.0)
    operator = SilentOperator()
    with open_bench(LOCKSTEP, operator.tell) as bench, StopRequest() as stop:
        bench.servo.configure()
        motor = bench.controls.plant.motor
        motor.angle, motor.rate = -0.44, -1.5
        path = tmp_path / "run.mcap"
        assert record_run(bench, run, CollectSettings(), path, operator, stop).finished


def test_an_alert_is_cleared_and_the_run_made_anew(tmp_path: Path, monkeypatch) -> None:
    """After an alert the operator is asked, the servo restarted, and the run recorded again."""
    operator, benches = Watcher(0.5), []
    made = LockstepBench.__init__

    def remember(bench: LockstepBench, *arguments: object, **named: object) -> None:
        made(bench, *arguments, **named)  # pyright: ignore
        benches.append(bench)

    operator.act = lambda: benches[-1].plan(FaultEvent(name="alert", alert="overheating"))
    monkeypatch.setattr(LockstepBench, "__init__", remember)
    collection = collected(tmp_path, SHORT[:1], operator)
    assert [outcome.finished for outcome in collection.outcomes] == [False, True]
    assert collection.left == 0
    assert any("overheating" in text for text in operator.told)
    assert any("Remove the cause" in text for text in operator.told)


def test_a_bench_that_is_plugged_in_is_asked_for_and_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two serial ports and a calibration file: the operator mounts, blocks by hand, and it runs."""
    monkeypatch.setattr("builtins.input", lambda: "")
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    write_calibration(tmp_path / "cell.toml", calibrated_twins("finger", 0, 80)[0])
    with VirtualPorts("finger", 0) as ports:
        words = ["collect", "--port", ports.servo_port, "--load-cell-port", ports.load_cell_port]
        words += ["--calibration", str(tmp_path / "cell.toml"), "--duration", "2"]
        words += ["--retries", "20", "--obstacle", "hand", "--out", str(tmp_path / "out")]
        # this computer is the servo, too, which stops if it waits long: the same command goes on
        assert any(main(words) == 0 for _ in range(3))
    said = capsys.readouterr().out
    assert 0 < said.find(">> Mount the bench 'finger'") < said.find(">> Hold the finger open")
    assert "1 recorded now" in said
    (log,) = load_dataset(tmp_path / "out", require_test=False).train
    assert log.force is not None
    assert log.load_cell_rate is None, "80 readings per second are as fast as the rows"
    session = read_session(tmp_path / "out" / log.name)
    assert session["simulated"] == "False"
    assert session["calibration"] == calibrated_twins("finger", 0, 80)[0].identifier
    assert session["date"]


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: replace(LOCKSTEP, port="/dev/ttyUSB0"), "only a virtual bench can be faster"),
        (lambda: replace(LOCKSTEP, load_cell_rate=50), "gives 80, 20, 10 readings per second"),
        (lambda: replace(LOCKSTEP, port="virtual:spring_weak"), "without one: virtual$"),
        (lambda: replace(LOCKSTEP, port="virtual:spring_weak:7"), "without one: virtual::7$"),
        (lambda: replace(LOCKSTEP, port="virtual:10"), "without one: virtual::10$"),
        (lambda: CollectSettings(rate=80.0, command_rate=30.0), "whole multiple of the command"),
        (lambda: CollectSettings(rate=1000.0), "the rate must be 10 to 500 Hz"),
        (lambda: SafetyLimits(force=0.0), "limit of force must be above 0"),
        (lambda: SafetyLimits(position=(1.0, 0.0)), "position window must be low, high"),
        (lambda: replace(SHORT[0], duration=0.5), "a run must last 1 to 3600 s"),
    ],
)
def test_what_cannot_be_recorded_is_refused(build: Callable[[], object], said: str) -> None:
    """Before any port is opened."""
    with pytest.raises(InvalidParameter, match=said):
        build()


def test_a_port_of_one_bench_is_refused_for_a_plan_of_three(tmp_path, capsys) -> None:
    """Before its first recording is made, and the word that fits all three is told."""
    words = [
        "--port", "virtual:finger:3", "--faster-than-real-time", "--out", str(tmp_path / "out"),
    ]  # fmt: skip
    assert "without one: virtual::3" in refusal(["collect", "--plan", "quick", *words], capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--excitation", "sines"], "No excitation named 'sines'"),
        (
            ["--plan", "papers"],
            "No plan named 'papers'; did you mean 'paper'? known: board, paper, quick",
        ),
        (["--bench", "pendulum"], "No bench with a tendon named 'pendulum'"),
        (["--bench", "mine"], "your own are looked for in the folders in TENDON_NEWTON_ASSETS"),
        (["--obstacle", "wall"], "No obstacle named 'wall'"),
        (["--servo", "mx28"], "No servo named 'mx28'"),
        (["--port", "/dev/no_such_port"], "/dev/no_such_port"),
        (["--port", "virtual:finger:x"], "seed"),
    ],
)
def test_misuse_is_answered_in_one_line(words, said, tmp_path, capsys, monkeypatch) -> None:
    """The verb names what it does not know, with what it knows, and exits with 2."""
    monkeypatch.setattr("builtins.input", lambda: "")
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    base = ["collect", "--port", "virtual", "--out", str(tmp_path / "out")]
    assert said in refusal([*base, *words], capsys)


def test_an_own_finger_is_recorded_by_its_name(tmp_path: Path, monkeypatch) -> None:
    """In a single run, and in a plan for the packaged finger, whose springs stay."""
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", str(tmp_path))
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "mine.usda").touch()
    options = CollectOptions(port="/dev/ttyUSB0", out=tmp_path / "out", bench="mine")
    assert [run.bench for run in planned(options)] == ["mine"]
    runs = planned(replace(options, plan="quick"))
    assert [run.name for run in runs[:4]] == [
        "mine_random_steps_0", "mine_ramps_0", "mine_steps_held_1s_0", "spring_weak_random_steps_0"
    ]  # fmt: skip
    assert len(runs) == len({run.name for run in runs}) == 9


def test_a_run_of_a_further_attempt_is_not_missing(tmp_path: Path) -> None:
    """A fault ended the first attempt; the second has the run's name with its number."""
    for file in ("steps_0.csv", "sines_1_again2.csv"):
        (tmp_path / file).touch()
        list_recording(tmp_path, ListedRecording(file=file, bench="finger", split="train"))
    assert recorded_runs(tmp_path) == {"steps_0", "sines_1"}


def test_a_stuck_cell_without_a_calibration_is_told(tmp_path: Path) -> None:
    """Counts alone end no run, and whoever wants them calibrated later must know."""
    stuck = Faults(events=(FaultEvent(name="cell_stuck", duration=9.0),))
    for faults, told in ((Faults(), 0), (stuck, 1)):
        operator = Watcher()
        run = PlannedRun(name="run", bench="finger", excitation="ramps", duration=3.0)
        with open_bench(LOCKSTEP, operator.tell) as bench, StopRequest() as stop:
            bench.drives[0].calibration = None
            operator.act = partial(begin, bench, faults)
            path = tmp_path / f"{told}.mcap"
            assert record_run(bench, run, CollectSettings(), path, operator, stop).finished
        assert sum("the load cell must be alive" in line for line in operator.told) == told


def test_a_run_whose_file_was_deleted_is_recorded_anew(tmp_path: Path) -> None:
    """The list alone is no recording; it names the new one once."""
    arguments = (CollectSettings(), tmp_path, SilentOperator())
    with StopRequest() as stop:
        assert collect(LOCKSTEP, SHORT, *arguments, stop, title="short").left == 0
        (tmp_path / "finger_ramps_0.mcap").unlink()
        again = collect(LOCKSTEP, SHORT, *arguments, stop, title="short")
    assert (len(again.outcomes), again.kept, again.left) == (1, 2, 0)
    data = load_dataset(tmp_path)
    assert sorted(r.name for r in (*data.train, *data.test)) == sorted(
        f"{run.name}.mcap" for run in SHORT
    )
