"""The next run is designed: its command, what it is expected to tell, and its limits."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_newton.cli import main
from tendon_newton.data.excitations import LARGEST_COMMAND
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.diagnosis.explanation import Estimate, Explanation, OpenClass, Setting
from tendon_newton.diagnosis.next_experiment.designed_command import (
    NUMBERS,
    SEGMENTS,
    DesignedCommand,
)
from tendon_newton.diagnosis.next_experiment.expected_run import Information, expect, information_of
from tendon_newton.diagnosis.next_experiment.first_plan import plan_first
from tendon_newton.diagnosis.next_experiment.run_design import SEED, design
from tendon_newton.diagnosis.next_experiment.separation import library_plans, plan_run
from tendon_newton.diagnosis.next_experiment.worst_case import DRAWS, WorstCase, within_limit
from tendon_newton.diagnosis.posterior import Coordinate, OpenNumber
from tendon_newton.identification.noise_floor import NoiseFloor

TIME = np.arange(960) / 80.0
MODEL = Model(actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}))


@given(st.integers(0, 2**32 - 1))
def test_every_command_stays_inside_the_servos_range(seed: int) -> None:
    """Drawn or varied, at the rate of a bench: four rows hold each command."""
    rng = np.random.default_rng(seed)
    drawn = DesignedCommand.draw(rng)
    for command in (drawn, drawn.moved(rng, 0.4, 0.3)):
        angles = command.at(TIME)
        assert angles.min() >= 0.0
        assert angles.max() <= LARGEST_COMMAND
        assert (angles.reshape(-1, 4) == angles[::4, None]).all()


def test_a_command_moves_at_its_speed_and_holds_there() -> None:
    """To half the range at 0.3 rad/s: one ramp goes on through eight equal segments."""
    numbers = np.full((SEGMENTS, NUMBERS), 0.5)
    numbers[:, 1] = 0.0
    numbers[:, 3] = 0.0
    slow = DesignedCommand(numbers=numbers).at(TIME)
    np.testing.assert_allclose(slow[::4], np.minimum(0.3 * TIME[::4], np.pi), atol=1e-9)
    numbers[:, 1] = 1.0
    fast = DesignedCommand(numbers=numbers).at(TIME)
    np.testing.assert_allclose(fast[8:], LARGEST_COMMAND / 2.0)


def test_a_run_as_informative_as_all_data_brings_half_a_bit() -> None:
    """Twice the information shrinks an interval by the root of two, whatever the rows are worth."""
    trial = SimpleNamespace(
        upper=np.array([1e3, 1e3]),
        lower=np.array([-1e3, -1e3]),
        spreads=np.array([0.1, 0.4]),
        names=("a.x", "b.y"),
    )
    recorded = np.diag([4.0, 0.25])
    bits = Information(trial, recorded).bits(recorded)
    assert bits == pytest.approx({"a.x": 0.5, "b.y": 0.5}, abs=1e-6)
    np.testing.assert_allclose(Information(trial, recorded).spreads(0.0), [0.1, 0.4], rtol=1e-6)


def test_models_drawn_for_a_limit_keep_what_the_data_tie_together() -> None:
    """Of a sum that is known each share may be off, and the other makes up for it."""
    scale = Coordinate(kind="linear", origin=0.0, unit=1.0, lower=-1e3, upper=1e3)
    trial = SimpleNamespace(
        upper=np.array([1e3, 1e3]),
        lower=np.array([-1e3, -1e3]),
        spreads=np.array([1.0, 2.0]),
        numbers=tuple(
            OpenNumber(owner=o, name="x", coordinate=scale, place=5.0) for o in ("a", "b")
        ),
    )
    recorded = np.array([[1.0, 0.9], [0.9, 1.0]])
    left = Information(trial, recorded, row_worth=100.0).left()
    drawn = left.at(np.random.default_rng(0).normal(size=(4000, 2)))
    np.testing.assert_allclose(drawn.mean(axis=0), 5.0, atol=0.1)  # 2 sigma / sqrt(4000)
    np.testing.assert_allclose(drawn.std(axis=0), [1.0, 2.0], rtol=0.05)  # as the intervals
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(-0.9, abs=0.02)


def question(spread: float = 0.1) -> OpenClass:
    """A cause against another on a weak spring, which no run there can tell apart.

    Args:
        spread: Half of the numbers' intervals, as a share of their values [1].
    """
    causes = (("gravity_misalignment", "angle", 0.3), ("position_offset", "angle", 0.3))
    return OpenClass(
        explanations=tuple(
            Explanation(
                cause=name,
                numbers={
                    name: {
                        number: Estimate(
                            value=v, ci95=((1.0 - spread) * v, (1.0 + spread) * v), unit="rad"
                        )
                    }
                },
            )
            for name, number, v in causes
        ),
        without=MODEL,
        settings=(Setting(bench="spring_weak", seconds=10.0),),
        noise=NoiseFloor(theta=0.00044, force=0.05),
    )


@pytest.mark.slow
def test_designed_commands_beat_the_library_and_keep_the_limit() -> None:
    """The search never ends below where it began, and no run pulls beyond what it may."""
    found = design(
        question(),
        [],
        [Setting(bench="finger")],
        np.random.default_rng(0),
        duration=4.0,
        force_limit=12.0,
    ).runs
    best = found[0]
    plans = library_plans([Setting(bench="finger")], (SEED,), 4.0)
    nothing = information_of(question(), [])
    worst = WorstCase(question(), nothing, np.random.default_rng(0))
    library = within_limit(expect(question(), plans, nothing), worst, 12.0).runs
    assert best.worth >= max(e.worth for e in library)
    assert best.worth > 0.0
    assert all(e.peak_force is not None and e.peak_force < 12.0 for e in found)
    assert best.numbers.keys() == {"gravity_misalignment.angle"}


def test_no_run_comes_back_whose_worst_case_was_not_looked_at() -> None:
    """A limit between the middle model and the worst one drawn: the calm half is searched on.

    Few runs are looked at together. Where the best of a bench are refused, the next are looked at,
    and what comes back has a largest tension of the worst case and not only of the middle.
    """
    uncertain = question(spread=0.9)
    settings = [Setting(bench="finger"), Setting(bench="spring_weak")]
    plans = [plan_run(s, "random_steps", seed, 4.0) for s in settings for seed in range(12)]
    nothing = information_of(uncertain, [])
    found = expect(uncertain, plans, nothing)
    middle = [e.peak_force for e in found if e.peak_force is not None]
    limit = float(np.median(middle))
    worst = WorstCase(uncertain, nothing, np.random.default_rng(0))
    designs = within_limit(found, worst, limit)
    anew = WorstCase(uncertain, nothing, np.random.default_rng(1))
    again = anew.drawn([e.prediction.plan for e in designs.runs], DRAWS)
    assert designs.runs
    assert designs.refused
    by_command = {e.prediction.plan.command.tobytes(): e.peak_force for e in found}
    for run, other in zip(designs.runs, again, strict=True):
        own = by_command[run.prediction.plan.command.tobytes()]
        assert run.peak_force != own
        assert run.peak_force is not None
        assert run.peak_force < limit
        assert other < limit  # of other draws


@pytest.mark.parametrize(("limit", "words"), [(0.2, "no run stays within"), (24.0, "")])
def test_a_plan_says_why_it_is_empty(limit: float, words: str) -> None:
    """Where every command pulls too hard: how hard the calmest does, and what to change."""
    effects = (NamedValues(name="position_offset", values={"angle": 0.1}),)
    plan = plan_first(
        Model(actuator=MODEL.actuator, effects=effects),
        [Setting(bench="finger")],
        runs=1,
        duration=4.0,
        force_limit=limit,
        rng=np.random.default_rng(0),
    )
    assert plan.ended.startswith(words)
    assert bool(plan.steps) != bool(words)
    if words:
        assert "the limit of 0.2 N, the calmest with" in plan.ended
        assert "--force-limit" in plan.ended


@pytest.mark.parametrize(("bench", "told"), [("spring_weak", False), ("finger", True)])
def test_a_plan_says_before_any_data_what_a_bench_can_tell(bench: str, told: bool) -> None:
    """A tilted rail is like a shifted encoder on a spring: the finger alone tells them apart."""
    model = Model(
        actuator=MODEL.actuator,
        effects=(
            NamedValues(name="gravity_misalignment", values={"angle": 0.3}),
            NamedValues(name="position_offset", values={"angle": 0.1}),
        ),
    )
    plan = plan_first(
        model,
        [Setting(bench=bench)],
        runs=1,
        duration=4.0,
        force_limit=24.0,
        rng=np.random.default_rng(0),
    )
    assert plan.bits.keys() == {"gravity_misalignment.angle", "position_offset.angle"}
    assert ("gravity_misalignment.angle" in plan.untold) != told
    assert (plan.untold == ()) == told
    assert (min(plan.bits.values()) > 4.0) == told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--benches", "fingr"), "No asset named 'fingr'"),
        (("--benches",), "--benches must name the benches that you have"),
        (("--budget", "10s"), "--budget must hold a run of --run-length 12 s; it is 10s"),
        (("--run-length", "1"), "--run-length must be 2 to 120 s; it is 1 s"),
        (("--force-limit", "0"), "--force-limit must be above 0"),
        ((), "model.toml: a plan is for a model with effects"),
    ],
)
def test_a_plan_that_cannot_be_made_is_refused_before_anything_is_simulated(
    words: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What was wrong and where, in a line; no folder is made."""
    path = tmp_path / "model.toml"
    write_model(path, MODEL)
    assert main(["plan", str(path), "--out", str(tmp_path / "plan"), *words]) == 2
    out, error = capsys.readouterr()
    assert said in error
    assert "simulating" not in out
    assert not (tmp_path / "plan").exists()
