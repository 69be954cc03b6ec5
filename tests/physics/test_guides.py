"""A guide between two elastic parts of a string, and what each bench has of its line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.virtual_bench.physics.constants import TendonConstants
from tendon_hardware.virtual_bench.physics.tendon import BenchTendon
from tendon_newton.data.bench_overrides import OF_BENCH, BenchOverrides
from tendon_newton.data.model_file import Model, NamedValues, load_model, write_model
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import find_effect
from tendon_newton.errors import InvalidParameter, UnknownName
from tendon_newton.exports.source import read_source
from tendon_newton.identification.study import Study
from tendon_newton.mechanisms.authoring.correction import correct
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import TIME_STEP
from tendon_newton.simulation.model.bench_numbers import line_numbers
from tests.made import stated_model
from tests.physics.runs import DATA_SHEET, RADIUS, run_of, simulate

STIFFNESS, EXPONENT = 9000.0, 0.17  # N/m, 1
SHARES = {"spring_weak": np.array([1.0]), "finger": np.array([0.008, 0.0055])}
TIME = np.arange(400) / 200.0


def guided(behind: float, exponent: float = EXPONENT) -> Model:
    """Return a motor whose string stretches on both sides of its guide."""
    return stated_model(
        "pwm_servo",
        DATA_SHEET,
        {
            "tendon_compliance": {"stiffness": STIFFNESS},
            "routing_friction": {"exponent": exponent, "behind": behind},
        },
    )


def wave() -> np.ndarray:
    """Return commands that turn back within the travel in which a guide holds [rad]."""
    return 0.8 + 0.5 * np.sin(2.0 * np.pi * TIME) + 0.2 * np.sin(7.4 * np.pi * TIME)


@pytest.mark.parametrize("bench", SHARES)
@pytest.mark.parametrize("behind", [0.3, 0.7])
def test_a_guide_holds_as_the_line_of_the_virtual_bench(bench: str, behind: float) -> None:
    """On the same motion both laws read the same force, to a few thousandths of it."""
    (run,) = simulate([run_of(wave(), bench=bench, rate=200.0)], guided(behind), time_step=6e-4)
    wound, excursion = RADIUS * run.motor_position[:, 0], run.joint_position @ SHARES[bench]
    line = BenchTendon(
        TendonConstants(
            spool_side_stiffness=STIFFNESS / (1.0 - behind),
            mechanism_side_stiffness=STIFFNESS / behind,
            slack=0.0,
            guide_friction=EXPONENT,
            routing_friction=0.0,
        )
    )
    line.passed = excursion[0] + behind * (wound[0] - excursion[0])
    expected = []
    for a, length in zip(wound, excursion, strict=True):
        line.settle(a, length)
        expected.append(line.spool_side)
    assert np.ptp(expected) > 0.5
    np.testing.assert_allclose(run.force[5:, 0], expected[5:], atol=5e-3)


def test_a_coarser_step_moves_a_guide_s_force_by_less_than_a_cell_s_noise() -> None:
    """Where a string begins to slide within a step, that step alone is of first order."""
    runs = [simulate([run_of(wave(), bench="spring_weak", rate=200.0)], guided(0.4), time_step=h)
            for h in (2.5e-3, 6e-4)]  # fmt: skip
    assert np.sqrt(np.mean((runs[0][0].force - runs[1][0].force) ** 2)) < 2e-3


def test_each_bench_has_a_line_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Three times the friction on the second bench is found, written and read."""
    truth = {"spring_weak": 0.06, "spring_strong": 0.18}
    recordings = []
    for bench, exponent in truth.items():
        run = run_of(wave(), bench=bench, rate=200.0)
        (found,) = simulate([run], guided(0.4, exponent), time_step=TIME_STEP)
        recordings.append(
            replace(
                run,
                motor_position=found.motor_position,
                motor_velocity=found.motor_velocity,
                force=found.force,
            )
        )
    start = stated_model("pwm_servo", DATA_SHEET)
    worlds = SearchWorlds(
        Study(recordings, start, ("tendon_compliance", "routing_friction"), tolerant=True)
    )
    fit = fit_set_anew(worlds, start, ("tendon_compliance", "routing_friction"))
    values = values_of(worlds, fit.columns, fit.place)
    table = worlds.study.table
    exponent = values[table.column("routing_friction", "exponent")]
    factor = values[table.column("bench", "spring_strong.routing_friction")]
    assert exponent == pytest.approx(truth["spring_weak"], rel=0.1)
    assert factor * exponent == pytest.approx(truth["spring_strong"], rel=0.1)
    model = worlds.study.with_fitted(guided(0.4, exponent), values)
    file = tmp_path_factory.mktemp("line") / "model.toml"
    write_model(file, model)
    again = load_model(file).on_bench("spring_strong")
    own = {effect.name: effect.values for effect in again.effects}
    assert own["routing_friction"]["exponent"] == pytest.approx(factor * exponent)
    assert "routing_friction" not in again.bench_overrides["spring_strong"].given


def test_a_bench_s_line_enters_wherever_a_model_is_used(tmp_path: Path) -> None:
    """In a replay, a training's worlds, an export, a corrected mechanism and draws."""
    own = {"spring_strong": BenchOverrides(routing_friction=(3.0,), joint_dry_friction=(2.0,))}
    dry = NamedValues(name="joint_dry_friction", values={"fraction": 0.01})
    model = guided(0.4, 0.05)
    model = replace(model, effects=(*model.effects, dry), bench_overrides=own)
    bench = load_mechanism("spring_strong")
    runs = [run_of(wave(), bench="spring_strong", rate=200.0)]
    (run,) = replay(runs, model)
    written = model.on_bench("spring_strong")
    (expected,) = replay(runs, replace(written, bench_overrides={}))
    np.testing.assert_array_equal(run.force, expected.force)
    assert np.abs(run.force - replay(runs, replace(model, bench_overrides={}))[0].force).max() > 0.1
    loop = ControlLoop(bench, model, 1)
    assert float(loop.numbers("routing_friction", "exponent")[0]) == pytest.approx(0.15)
    write_model(tmp_path / "model.toml", model)
    source = read_source(tmp_path / "model.toml", "spring_strong", None)
    assert source.model.effects[1].values["exponent"] == pytest.approx(0.15)
    nominal = replace(model, bench_overrides={})
    first, same, less = (
        correct(bench, each).corrected.joints[0].friction for each in (model, written, nominal)
    )
    assert first == same > less


def test_what_is_stated_of_a_line_is_not_fitted() -> None:
    """As of any other number of a bench; what a recording states counts before the model."""
    runs = [run_of(wave(), bench=bench, rate=200.0) for bench in ("spring_weak", "spring_strong")]
    benches = {run.bench: load_mechanism(run.bench) for run in runs}
    names = {number.name for number in line_numbers(guided(0.4), benches, runs)}
    assert "spring_strong.routing_friction" in names
    stated = [runs[0], replace(runs[1], bench_overrides=BenchOverrides(routing_friction=(2.0,)))]
    left = {number.name for number in line_numbers(guided(0.4), benches, stated)}
    assert names - left == {"spring_strong.routing_friction"}
    given = {"spring_strong": BenchOverrides(routing_friction=(5.0,))}
    model = replace(guided(0.4), bench_overrides=given)
    own = model.on_bench("spring_strong", stated[1].bench_overrides).effects[1].values
    assert own["exponent"] == pytest.approx(2.0 * EXPONENT)


def test_a_line_has_one_number_and_is_no_unknown_of_a_bench() -> None:
    """Several are refused, and so is a line's key in ``fit``."""
    with pytest.raises(InvalidParameter, match="one number for the line of a bench; it has 2"):
        BenchOverrides(tendon_slack=(1.0, 2.0))
    run = run_of(wave(), bench="spring_weak", rate=200.0)
    run = replace(run, force=np.zeros((len(TIME), 1)))
    model = replace(guided(0.4), fit=("routing_friction",))
    study = Study([run], model, ("routing_friction", "tendon_compliance"))
    with pytest.raises(UnknownName, match="number to fit"):
        study.fit_columns(model)


def test_the_numbers_of_a_line_are_the_first_of_their_effects() -> None:
    """A bench's factor is on the strength of an effect."""
    for name, number in OF_BENCH.items():
        assert find_effect(name).parameters[0].name == number
    assert BenchOverrides(routing_friction=(2.0,)).given == {"routing_friction": (2.0,)}
