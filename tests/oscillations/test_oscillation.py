"""What shakes in a log, and by what: planted loops of a servo, in plain NumPy."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.oscillations.causes import ShakingLoop, calming, explain, simulated, tried
from tendon_newton.data.oscillations.loop_closing import cut_policy, policy_of
from tendon_newton.data.oscillations.loop_fit import fit_servo
from tendon_newton.data.oscillations.servo_loop import NAMES, Feedback, driven
from tendon_newton.data.oscillations.shaking import Evenly, evenly, find_shakings
from tendon_newton.data.oscillations.told_loop import feedback_of, lines_of, tell_joint
from tendon_newton.data.recording import Array
from tests.bad_input.damage import refusal

ROW, TICKS = 0.01, 10
COUNT = 2.0 * np.pi / 4096.0


def servo(goal: Array, rng: np.random.Generator, *, gain: float, delay: float) -> Array:
    """Return readings of a motor that turns by a late error [rad], shape (T,)."""
    late, step = round(delay / (ROW / TICKS)), ROW / TICKS
    angle, speed, read = float(goal[0]), 0.0, np.empty(len(goal))
    errors = np.zeros(late + 1)
    for row, wanted in enumerate(goal):
        read[row] = np.round((angle + rng.normal(0.0, 3e-4)) / COUNT) * COUNT
        for _ in range(TICKS):
            errors = np.r_[wanted - angle, errors[:-1]]
            duty = np.clip(gain * errors[-1], -1.0, 1.0)
            speed += step * (300.0 * duty - 30.0 * speed)
            angle += step * speed
    return read


def goals(rng: np.random.Generator) -> Array:
    """Return steps, then a goal that stays [rad]."""
    levels = np.repeat(rng.uniform(-0.3, 0.3, 6), 100)
    return np.r_[levels, np.full(600, levels[-1])]


def log_of(rng: np.random.Generator, *, gain: float, delay: float) -> Evenly:
    """Return a log of a servo's own loop."""
    goal = goals(rng)
    return Evenly(step=ROW, command=goal, angle=servo(goal, rng, gain=gain, delay=delay))


def test_a_loop_that_shakes_by_its_delay_is_told(rng: np.random.Generator) -> None:
    """The phase of a pull by 12 rad/s after 33 ms of lag and 120 ms is -180 deg at 1.57 Hz."""
    told = tell_joint(log_of(rng, gain=1.2, delay=0.12))
    assert told.shaking is not None
    assert told.explained is not None
    assert told.shaking.frequency == pytest.approx(1.57, rel=0.1)
    assert told.explained.cause == "delay"
    assert told.explained.changes[0].what == "delay"


def test_a_loop_without_a_gain_is_no_mend() -> None:
    """A tenth of this loop's gain does not calm it, and no gain is no answer."""
    numbers = {"delay": 0.05, "pull": 600.0, "damping": 6.0, "limit": 0.17, "sticking": 1e-3,
               "sliding": 0.5, "play": 0.044, "fading": 3.0, "integral": 1e-3}  # fmt: skip
    loop = ShakingLoop(
        numbers=np.array([numbers[name] for name in NAMES]),
        feedback=Feedback(outer=False, row=0.005),
        frequency=1.54,
        amplitude=0.05,
    )
    shakes, _ = simulated(loop, [tried(loop, "gain", share) for share in (0.1, 0.0)])
    assert shakes.tolist() == [True, False]
    assert explain(loop).cause == "gain"
    assert "gain" not in {change.what for change in explain(loop).changes}


def test_a_sound_loop_is_silent(rng: np.random.Generator) -> None:
    """Steps, noise and counts are no shaking."""
    assert not lines_of(log_of(rng, gain=0.6, delay=0.006)).lines


def test_what_follows_a_swinging_command_does_not_shake(rng: np.random.Generator) -> None:
    """The line stands in the angle, and its command explains it."""
    goal: Array = 0.2 * np.sin(2.0 * np.pi * 1.5 * ROW * np.arange(1200))
    log = Evenly(step=ROW, command=goal, angle=servo(goal, rng, gain=1.0, delay=0.006))
    assert find_shakings(log)
    assert policy_of(log) is None
    assert not lines_of(log).lines


@pytest.mark.parametrize("made", ["harmonic", "late readings", "counts", "another joint"])
def test_what_is_made_of_a_commanded_motion_does_not_shake(made, rng) -> None:
    """A cut swing has harmonics, late rows jump with the speed, a count flickers, an arm loads."""
    time = ROW * np.arange(2000, dtype=np.float64)
    swing: Array = 0.5 * np.sin(2.0 * np.pi * 0.5 * time)
    stays: Array = np.zeros(2000)
    if made == "harmonic":
        log = evenly(time, swing, np.clip(swing, -0.3, 0.3))
        assert not lines_of(log).lines
        assert lines_of(replace(log, command=stays)).lines
    elif made == "late readings":
        late = np.where(np.arange(len(time)) % 4 == 0, 0.5 * ROW, 0.0)
        assert not lines_of(evenly(time, swing, np.interp(time - late, time, swing))).lines
    elif made == "counts":
        stamps = time + rng.uniform(0.0, 1e-3, len(time))
        flickers = np.where(np.sin(2.0 * np.pi * 3.0 * time) > 0.0, COUNT, 0.0)
        assert not lines_of(evenly(stamps, stays, flickers)).lines
    else:
        log = evenly(time, stays, 0.02 * np.sin(2.0 * np.pi * 1.0 * time + 0.3))
        assert lines_of(log).lines
        assert not lines_of(log, [swing]).lines


def test_a_policy_that_only_switches_is_told(rng: np.random.Generator) -> None:
    """A gain so high that the command is always at one of its limits, which move with a goal."""
    angle: Array = 0.1 * np.sin(2.0 * np.pi * 5.0 * 0.02 * np.arange(800))
    switched = -0.5 * np.sign(angle + rng.normal(0.0, 1e-6, 800))
    for goal in (np.full(800, 0.2), np.repeat([0.2, -0.1, 0.3, 0.0], 200)):
        log = Evenly(step=0.02, command=goal + switched, angle=angle)
        (line,) = find_shakings(log)
        assert cut_policy(log, line.frequency, line.rows) is not None
        assert feedback_of(log, line, policy_of(log) or cut_policy(log, 5.0, line.rows)).bound == (
            pytest.approx(0.5)
        )


def test_a_goal_that_stays_is_no_limit_of_a_policy() -> None:
    """A goal that stays for seconds after one step answers no shaking, in step with it or not."""
    time = 0.01 * np.arange(2000)
    steps = np.where(time < 10.0, np.round(0.3 * np.sin(time), 4), 0.1)
    for phase in np.linspace(0.0, 6.0, 7):
        log = Evenly(step=0.01, command=steps, angle=0.1 * np.sin(2.0 * np.pi * 3.0 * time + phase))
        assert cut_policy(log, 3.0, np.ones(2000, dtype=np.bool_)) is None


def test_a_servo_with_play_is_found_in_a_log_that_begins_amid_its_motion(rng) -> None:
    """Where and how fast a joint is within its play when a log begins is not told by the log."""
    numbers = {"delay": 0.01, "pull": 150.0, "damping": 18.0, "limit": 1.0, "sticking": 1e-4,
               "sliding": 0.5, "play": 0.08, "fading": 0.5, "integral": 1e-3}  # fmt: skip
    time = 1e-3 * np.arange(8000)
    command = 0.12 * np.sin(2.0 * np.pi * 3.0 * time) + 0.05 * np.sin(2.0 * np.pi * 0.3 * time)
    truth = np.array([[numbers[name] for name in NAMES]])
    angle = driven(truth, command, command, 1e-3, outer=True)[:, 0]
    rows = slice(1230, None, 10)
    read = angle[rows] + rng.normal(0.0, 3e-4, len(angle[rows]))
    log = Evenly(step=ROW, command=command[rows], angle=read)
    found = fit_servo(log, 3.0, outer=True)
    assert found.told > 0.995
    assert found.numbers[NAMES.index("play")] == pytest.approx(0.08, rel=0.15)


def test_a_change_calms_all_loops_that_tell_a_log_as_well() -> None:
    """The shortest of their delays, and the least of their gains, is proposed."""
    numbers = {"delay": 0.1, "pull": 500.0, "damping": 30.0, "limit": 1.0, "sticking": 1e-4,
               "sliding": 0.5, "play": 1e-4, "fading": 3.0, "integral": 1e-3}  # fmt: skip
    loop = ShakingLoop(
        numbers=np.array([numbers[name] for name in NAMES]),
        feedback=Feedback(outer=False, row=0.01),
        frequency=1.9,
        amplitude=0.1,
    )
    stronger = loop.numbers * np.where(np.array(NAMES) == "pull", 2.0, 1.0)
    alone, both = (calming(replace(loop, others=others)) for others in ((), (stronger,)))
    shares = [{one.what: one.share for one in changes} for changes in (alone, both)]
    assert shares[1]["gain"] < 0.7 * shares[0]["gain"]
    assert shares[1]["gain"] > 0.0


def test_a_policy_is_found_by_what_no_earlier_reading_foretells(rng: np.random.Generator) -> None:
    """Its gains come back from readings and commands, whose goal jumps now and then."""
    goal = goals(rng)
    angle = servo(goal, rng, gain=0.6, delay=0.006)
    command = goal + 1.7 * (goal - angle) + 0.8 * ROW * np.cumsum(goal - angle)
    found = policy_of(Evenly(step=ROW, command=command, angle=angle))
    assert found is not None
    assert found.gain == pytest.approx(1.7, rel=0.01)
    assert found.late == 0


def test_the_verb_says_so(tmp_path, rng, capsys) -> None:
    """Exit code 1 with a cause; a sound log ends with 0, one without commands with an error.

    The phase of the loop, with 33 ms of lag and 6 ms of delay, is -180 deg at 11 Hz.
    """
    for name, gain in (("shaking", 30.0), ("sound", 0.6)):
        log = log_of(rng, gain=gain, delay=0.006)
        write_log(tmp_path / f"{name}.csv", "t,theta_d,theta,theta_dot", log)
    write_log(tmp_path / "none.csv", "t,force,theta,theta_dot", log_of(rng, gain=0.6, delay=0.0))
    shaking = str(tmp_path / "shaking.csv")
    assert main(["oscillation", shaking, "--json"]) == 1
    (joint,) = json.loads(capsys.readouterr().out)["joints"]
    assert joint["shakes"]["cause"] == "gain"
    assert joint["shakes"]["frequency"] == pytest.approx(11.0, rel=0.1)
    assert joint["shakes"]["closed_by"] == "servo"
    assert main(["oscillation", shaking]) == 1
    assert "they are rough" in capsys.readouterr().out
    assert main(["oscillation", str(tmp_path / "sound.csv")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "none of 1 joints shake"
    assert "commands" in refusal(["oscillation", str(tmp_path / "none.csv")], capsys)
    assert main(["oscillation", str(tmp_path / "nowhere.csv")]) == 2


def test_logs_of_others_are_read_by_what_is_looked_at(tmp_path, rng, capsys) -> None:
    """A mapping needs no speed, a current that is none stops nothing, a pause ends a part.

    Without a mapping the message says that one is needed.
    """
    log = log_of(rng, gain=30.0, delay=0.006)
    times = ROW * np.arange(len(log.angle)) + 7200.0 * (np.arange(len(log.angle)) >= 600)
    rows = [
        f"{t:.3f},{u:.9f},{y:.9f},65511"
        for t, u, y in zip(times, log.command, log.angle, strict=True)
    ]
    write_text(tmp_path / "log.csv", "\n".join(["s,goal,angle,mA", *rows, ""]))
    mapping = tmp_path / "mapping.toml"
    write_text(
        mapping,
        'bench = "servo"\n[columns]\nt = {column = "s"}\ntheta_d = {column = "goal"}\n'
        'theta = {column = "angle"}\ncurrent = {column = "mA", unit = "mA"}\n',
    )
    command = ["oscillation", str(tmp_path / "log.csv"), "--mapping", str(mapping)]
    assert main([*command, "--json"]) == 1
    (joint,) = json.loads(capsys.readouterr().out)["joints"]
    assert joint["shakes"]["begin"] >= 7200.0
    assert "--mapping" in refusal(command[:2], capsys)
    write_text(tmp_path / "log.json", "[]")
    for name in ("log.json", "."):
        assert "--mapping" in refusal(["oscillation", str(tmp_path / name)], capsys)


def write_log(path: Path, header: str, log: Evenly) -> None:
    """Write a log in our columns."""
    numbers = zip(log.command, log.angle, np.gradient(log.angle, ROW), strict=True)
    rows = [f"{ROW * k:.3f},{u:.9f},{y:.9f},{v:.6f}" for k, (u, y, v) in enumerate(numbers)]
    write_text(path, "\n".join([header, *rows, ""]))
