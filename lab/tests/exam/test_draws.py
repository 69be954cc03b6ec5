"""What an exam draws, and that the plant does what no effect of the catalogue does."""

import json
from collections import Counter
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from lab.exams.draw import main
from lab.exams.exam_draws import ONE_LAW, ExamPlan, are_alike, on_one_bench, recipes
from tendon_lab.exam.exam_score import judge
from tendon_lab.exam.run_exam import read_truths
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.effects import are_related
from tests.planted.physics.bench import GAIN, SPOOL_RADIUS
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import COMMANDS
from tests.planted.physics.disturbances import draw_disturbances, stuck_rows, wander
from tests.planted.sets.draws import EFFECTS, NEAR, NEEDS_FINGER, OUTSIDE
from tests.planted.trials import FROZEN, TAUT, jump, rows, run, step_response


def test_every_cause_comes_up_as_often_as_any_other() -> None:
    """Singles and outside causes take turns; half the cases are singles."""
    drawn = list(recipes(ExamPlan(cases=300)))
    assert len({recipe.seed for recipe in drawn}) == 300
    singles = Counter(r.effects[0] for r in drawn if len(r.effects) == 1)
    effects = [singles[name] for name in EFFECTS]
    outside = [singles[name] for name in OUTSIDE]
    assert min(effects) >= 165 // len(EFFECTS) >= 3
    assert max(effects) - min(effects) <= 1
    assert max(outside) - min(outside) <= 1
    assert sum(not r.effects for r in drawn) == 45
    assert sum(effects) == 165


def test_pairs_are_alike_as_often_as_asked_for() -> None:
    """A quarter imitate each other, the others do not; most are from different sides."""
    drawn = [r.effects for r in recipes(ExamPlan(cases=200, families=("pair",)))]
    assert np.mean([are_alike(pair) for pair in drawn]) == pytest.approx(0.25, abs=0.09)
    assert len(set(drawn)) > 120
    alone = ExamPlan(families=("pair",), effects=("load_cell_lag", "load_cell_delay"))
    with pytest.raises(ValueError, match="told apart"):
        list(recipes(replace(alone, alike_share=0.0)))
    assert {r.effects for r in recipes(replace(alone, alike_share=1.0))} == {alone.effects}


def test_every_pair_that_one_bench_shows_can_come_up() -> None:
    """Left out: a play in a shaft with what needs a string, and a law with its special case."""
    pairs = list(combinations(EFFECTS, 2))
    left_out = [pair for pair in pairs if not on_one_bench(*pair)]
    laws = [pair for pair in pairs if are_related(*pair)]
    assert set(map(frozenset, laws)) == set(ONE_LAW)
    assert (len(pairs), len(left_out)) == (861, 36)
    assert all("backlash" in pair for pair in left_out if pair not in laws)
    drawn = {r.effects: r.mix for r in recipes(ExamPlan(cases=800, families=("pair",)))}
    assert {mix for pair, mix in drawn.items() if "backlash" in pair} == {"P"}
    assert "P" not in {mix for pair, mix in drawn.items() if "backlash" not in pair}


def test_what_one_spring_cannot_show_is_mostly_shown_to_the_finger() -> None:
    """Five in six on a mix with the finger, and those of the sixth that fall there too."""
    plan = ExamPlan(cases=200, families=("single",), effects=tuple(NEEDS_FINGER))
    mixes = Counter(r.mix for r in recipes(plan))
    assert mixes["A"] + mixes["F"] > 180
    assert set(mixes) == {"A", "F", "S", "W"}


def test_circumstances_come_as_often_as_asked_for() -> None:
    """Slow cells and gaps belong to the cases whose friction the model knows."""
    plan = ExamPlan(cases=300, known_friction=0.4, cell_rate_share=0.5, weak_share=0.2)
    drawn = list(recipes(plan))
    known = [r for r in drawn if r.known_friction]
    assert len(known) / 300 == pytest.approx(0.4, abs=0.08)  # three deviations
    assert sum(r.cell_rate == 20.0 for r in known) / len(known) == pytest.approx(0.5, abs=0.14)
    assert not [r for r in drawn if not r.known_friction and (r.cell_rate or r.gaps)]
    assert sum(r.size < 1.0 for r in drawn) / 300 == pytest.approx(0.2, abs=0.07)
    assert {r.noise_colour for r in drawn} == {0.0, 0.6, 0.9}
    assert list(recipes(plan)) == drawn
    assert list(recipes(replace(plan, seed=1))) != drawn


def test_an_exam_can_be_read_and_judged(tmp_path: Path) -> None:
    """Folders and truths fit together, and a truth that answers itself is right."""
    out = tmp_path / "exam"
    main([str(out), "--cases", "4", "--seed", "7", "--known-friction", "0.5", "--prefix", "c"])
    truths = read_truths(out)
    assert [truth.id for truth in truths] == ["c001", "c002", "c003", "c004"]
    assert {truth.family for truth in truths} >= {"single"}
    for truth in truths:
        told = json.loads((out / "truth" / f"{truth.id}.json").read_text())
        known = load_model(out / truth.id / "model.toml").effects
        assert [effect["name"] for effect in told["known_effects"]] == [e.name for e in known]
        assert len(load_dataset(out / truth.id).test) == 3
        assert told["oracle"]["true"]["theta_rmse"] < 0.6e-3
        if truth.family != "outside":
            assert judge(truth, perfect_answer(told)).right


def perfect_answer(told: dict) -> dict:
    """What a diagnosis would say that knew the truth."""
    effects = [
        {
            "name": effect["name"],
            "indistinguishable_from": [],
            "parameters": {
                name: {"value": value, "ci95": [value, value]}
                for name, value in effect["parameters"].items()
            },
        }
        for effect in told["effects"]
    ]
    verdict = "explained" if effects else "no_gap"
    return {"verdict": verdict, "effects": effects, "wall_time_s": 1.0}


TIME = rows(4.0)
STEPS = COMMANDS["steps"](np.random.default_rng(3), TIME.size)


def test_cogging_and_a_dead_spot_depend_on_the_angle() -> None:
    """F = P e + a sin(n theta + phase), and F = P e (1 - depth exp(-((theta - at) / w)^2))."""
    ripple = run(
        "spring_weak", Causes(cogging=0.6, cogging_rate=9.0, cogging_phase=1.0), TIME, STEPS
    )
    expected = GAIN * (STEPS - ripple.angle) + 0.6 * np.sin(9.0 * ripple.angle + 1.0)
    assert ripple.force == pytest.approx(np.maximum(0.0, expected), abs=1e-9)
    causes = Causes(dead_spot=0.7, dead_spot_at=0.8, dead_spot_width=0.15)
    lost = run("spring_weak", causes, TIME, STEPS)
    share = 1.0 - 0.7 * np.exp(-(((lost.angle - 0.8) / 0.15) ** 2))
    expected = GAIN * (STEPS - lost.angle) * share
    assert lost.force == pytest.approx(np.maximum(0.0, expected), abs=1e-9)


def test_a_coarse_servo_hears_the_nearest_step() -> None:
    """F = P (rounded theta_d - theta)."""
    motion = run("spring_weak", Causes(command_step=0.2), TIME, STEPS)
    heard = np.round(STEPS / 0.2) * 0.2
    assert motion.force == pytest.approx(np.maximum(0.0, GAIN * (heard - motion.angle)), abs=1e-9)


def test_gain_and_friction_follow_their_tables() -> None:
    """F = P g(t) e without friction; in a steady pull F is less by the friction of that row."""
    gain = 1.0 + 0.1 * np.sin(TIME)
    motion = run("spring_weak", Causes(), TIME, STEPS, gain=gain)
    expected = GAIN * gain * (STEPS - motion.angle)
    assert motion.force == pytest.approx(np.maximum(0.0, expected), abs=1e-6)
    time = rows(2.0)
    friction = 0.5 + 0.4 * np.sin(3.0 * time)
    pulled = run("spring_weak", Causes(), time, 2.5 + time, friction=friction)
    lost = GAIN * (2.5 + time - pulled.angle) - pulled.force
    assert lost[80:] == pytest.approx(friction[80:], abs=1e-3)


def test_a_jittering_command_takes_effect_at_its_own_time() -> None:
    """With the mechanism frozen, the force jumps when that row's command is due."""
    time = rows(0.2, rate=2000.0)
    lateness = np.where(time < 0.1, 0.0, 0.033)
    causes = Causes(inertia_scale=FROZEN)
    motion = run("spring_weak", causes, time, jump(time, 2.0, 3.0, at=0.1), lateness=lateness)
    jumped = time[np.flatnonzero(motion.force > motion.force[0] + 1.0)[0]]
    assert jumped == pytest.approx(0.133, abs=0.6e-3)  # one row of 0.5 ms


def test_a_mount_gives_way_and_swings() -> None:
    """Frozen in front, it is an oscillator on its own spring and the servo's, damped to a tenth."""
    time, give, pace = rows(1.5), 2e-4, 2.0 * np.pi * 4.0
    causes = Causes(mount_compliance=give, mount_rate=pace, inertia_scale=FROZEN)
    motion = run("spring_weak", causes, time, jump(time, 2.0, 2.5))
    away = motion.angle * SPOOL_RADIUS - motion.coordinates[:, 0]
    assert away[0] == pytest.approx(give * motion.force[0], abs=1e-9)
    natural = pace * np.sqrt(1.0 + give * TAUT)
    end = give * GAIN * 0.5 / (1.0 + give * TAUT)
    expected = end * step_response(time - 0.5, natural, 0.1 * pace)
    assert away - away[0] == pytest.approx(expected, abs=2e-3 * end)


def test_a_wandering_gain_keeps_its_mean_and_size() -> None:
    """Over many recordings the mean is 0 and the deviation 1; it forgets within seconds."""
    time = rows(15.0)
    walks = np.array([wander(np.random.default_rng(seed), time) for seed in range(200)])
    assert abs(walks.mean()) < 0.1
    assert walks.std() == pytest.approx(1.0, rel=0.1)
    assert np.corrcoef(walks[:, 0], walks[:, 800])[0, 1] < 0.3


def test_a_stuck_encoder_repeats_a_row_for_a_while() -> None:
    """Stretches of up to half a second; in between every row is its own."""
    repeated = stuck_rows(np.random.default_rng(0), rows(15.0), rate=1.0)
    own = repeated == np.arange(repeated.size)
    assert 0.5 < own.mean() < 0.95
    assert np.all(repeated <= np.arange(repeated.size))
    assert (np.arange(repeated.size) - repeated).max() <= 2 * 0.5 * 80


def test_disturbances_are_only_those_that_are_planted() -> None:
    """Nothing befalls a recording of a plant without such causes."""
    drawn = draw_disturbances(np.random.default_rng(0), Causes(), TIME)
    assert drawn.knocks == ()
    nothing = (None, None, None, None)
    assert (drawn.gain, drawn.friction, drawn.lateness, drawn.logged) == nothing


def test_what_comes_near_is_an_effect_of_the_catalogue() -> None:
    """And at most three of them, so that there is something left to get wrong."""
    for cause, near in NEAR.items():
        assert cause in OUTSIDE
        assert set(near) <= set(EFFECTS)
        assert len(near) <= 3
