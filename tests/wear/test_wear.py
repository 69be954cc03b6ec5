"""Which part of a servo wears: numbers of a planted servo, and trends of numbers."""

import json
from math import copysign
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.oscillations.shaking import Evenly
from tendon_newton.data.recording import Array
from tendon_newton.data.wear.day_fit import NUMBERS, DayFit, fit_days
from tendon_newton.data.wear.worn_parts import PARTS, TRENDS, trends_of
from tests.bad_input.damage import refusal

ROW, TICKS, PULL = 0.02, 10, 400.0
USUAL = {"delay": 0.01, "lag": 0.1, "friction": 0.02, "play": 0.02, "load": 0.3}


def servo(goal: Array, *, friction: float, play: float) -> Array:
    """Return the angle behind a gear's play of a motor that a load pulls back [rad], shape (T,).

    The motor is slowed by 40 /s; the joint lies on the side to which its load pulls it.
    """
    step, motor, speed, angle, read = ROW / TICKS, 0.0, 0.0, 0.0, np.empty(len(goal))
    for row, wanted in enumerate(goal.tolist()):
        read[row] = angle
        for _ in range(TICKS):
            force = wanted - angle - 0.3 * angle
            drag = copysign(friction, speed) if speed else max(-friction, min(force, friction))
            new = speed + step * (PULL * (force - drag) - 40.0 * speed)
            speed = 0.0 if new * speed < 0.0 and abs(force) <= friction else new
            motor += step * speed
            angle = motor - 0.5 * play * max(-1.0, min(angle / 0.02, 1.0))
    return read


def reaches(rng: np.random.Generator, count: int) -> Array:
    """Return a command that goes from level to level at a hand's speed [rad]."""
    knots = np.cumsum(np.r_[0.0, rng.uniform(0.5, 1.0, 40)])
    levels = np.r_[0.0, rng.uniform(-0.5, 0.5, 40)]
    return np.interp(ROW * np.arange(count), knots, levels)


def log_of(
    rng: np.random.Generator, count: int = 500, *, friction: float = 0.02, play: float = 0.02
) -> Evenly:
    """Return rows of a servo with noise."""
    goal = reaches(rng, count)
    angle = servo(goal, friction=friction, play=play) + rng.normal(0.0, 3e-4, count)
    return Evenly(step=ROW, command=goal, angle=angle)


def test_friction_play_and_load_of_a_day_come_back(rng: np.random.Generator) -> None:
    """Each moves alone; a tenth of a number is what another law of contact makes of it."""
    logs = [log_of(rng), log_of(rng, friction=0.04), log_of(rng, play=0.04)]
    usual, rough, loose = fit_days([[log] for log in logs])
    assert usual.number("friction") == pytest.approx(0.02, rel=0.1)
    assert usual.number("lag") == pytest.approx(0.1, rel=0.1)
    assert usual.number("load") == pytest.approx(0.3, rel=0.03)
    assert rough.number("friction") == pytest.approx(0.04, rel=0.1)
    assert loose.number("friction") == pytest.approx(0.02, rel=0.1)
    assert loose.number("play") > 1.5 * usual.number("play")
    assert rough.number("play") < 1.5 * usual.number("play")


def days_of(rng: np.random.Generator, part: str, share: float, open_: float = 0.02) -> list[DayFit]:
    """Return ten days whose numbers scatter by 5 %, and move by a part's wear."""
    fits: list[DayFit] = []
    for day in range(10):
        moves = PARTS[part].moves if part else {}
        grown = [1.0 + share * day * moves.get(name, 0.0) for name in NUMBERS]
        logs = np.log([USUAL[name] for name in NUMBERS]) + np.log(grown)
        scatter = rng.normal(0.0, np.hypot(0.05, open_), len(NUMBERS))
        fits.append(DayFit(logs=logs + scatter, covariance=open_**2 * np.eye(5), told=0.99))
    return fits


@pytest.mark.parametrize("part", PARTS)
def test_each_part_is_told_by_what_it_moves(part: str, rng: np.random.Generator) -> None:
    """8 % a day is told, at that rate, before it doubles; its limit lies ahead."""
    trends = trends_of(np.arange(10.0), days_of(rng, part, 0.08))
    assert [one.part for one in trends if one.wears] == [part]
    assert trends[0].ends is not None
    # the rate is a share of the mean, which 4.5 days have moved
    at = 0.08 / (1.0 + 4.5 * 0.08 * max(PARTS[part].moves.values()))
    assert trends[0].ci95[0] < at < trends[0].ci95[1]
    assert trends[0].ends[1] < trends[0].ends[0] < trends[0].ends[2]


def test_nothing_wears_and_cannot_tell_are_two_answers(rng: np.random.Generator) -> None:
    """Days that scatter by 5 % would show a double effect; days whose logs are open would not."""
    assert not any(
        one.wears or not one.told for one in trends_of(np.arange(10.0), days_of(rng, "", 0.0))
    )
    blind = trends_of(np.arange(10.0), days_of(rng, "", 0.0, open_=0.6))
    assert not any(one.wears or one.told for one in blind)
    assert set(TRENDS) <= set(NUMBERS)


def test_the_verb_says_so(tmp_path, rng, capsys) -> None:
    """Play that grows is the first to wear; a day without motion, and one day alone, are told."""
    for day in range(5):
        write_log(
            tmp_path / f"run_2026-11-0{day + 1}.csv", log_of(rng, 300, play=0.02 + 0.01 * day)
        )
    still = log_of(rng, 300)
    write_log(
        tmp_path / "run_2026-11-06.csv",
        Evenly(step=ROW, command=0.0 * still.command, angle=still.angle),
    )
    logs = sorted(map(str, tmp_path.glob("*.csv")))
    assert main(["wear", *reversed(logs), "--json"]) == 1
    (joint,) = json.loads(capsys.readouterr().out)["joints"]
    assert joint["verdict"] == "wears"
    assert joint["parts"][0]["part"] == "play"
    assert [day["day"] for day in joint["days"]] == [f"2026-11-0{k}" for k in range(1, 6)]
    assert "hardly moves" in joint["not_told"][0]
    assert main(["wear", *logs[:2]]) == 0
    assert "cannot tell: 4 days" in capsys.readouterr().out
    assert "run_2026-11-28.csv" in refusal(["wear", logs[0]], capsys)


def write_log(path: Path, log: Evenly) -> None:
    """Write a log in our columns."""
    rows = [
        f"{ROW * k:.3f},{u:.9f},{y:.9f},0.0"
        for k, (u, y) in enumerate(zip(log.command, log.angle, strict=True))
    ]
    write_text(path, "\n".join(["t,theta_d,theta,theta_dot", *rows, ""]))
