"""The next run is designed: its command, what it is expected to tell, and its limits."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_newton.data.excitations import LARGEST_COMMAND
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.diagnosis.explanation import Estimate, Explanation, OpenClass, Setting
from tendon_newton.diagnosis.next_experiment.designed_command import (
    NUMBERS,
    SEGMENTS,
    DesignedCommand,
)
from tendon_newton.diagnosis.next_experiment.first_plan import plan_first
from tendon_newton.diagnosis.next_experiment.run_design import Posterior, design
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
    bits = Posterior(trial, recorded).bits(recorded)
    assert bits == pytest.approx({"a.x": 0.5, "b.y": 0.5}, abs=1e-6)
    np.testing.assert_allclose(Posterior(trial, recorded).spreads(0.0), [0.1, 0.4], rtol=1e-6)


def question() -> OpenClass:
    """A cause against another on a weak spring, which no run there can tell apart."""
    causes = (("gravity_misalignment", "angle", 0.3), ("position_offset", "angle", 0.3))
    return OpenClass(
        explanations=tuple(
            Explanation(
                cause=name,
                numbers={name: {number: Estimate(value=v, ci95=(0.9 * v, 1.1 * v), unit="rad")}},
            )
            for name, number, v in causes
        ),
        without=MODEL,
        settings=(Setting(bench="spring_weak", seconds=10.0),),
        noise=NoiseFloor(theta=0.00044, force=0.05),
    )


def test_designed_commands_beat_the_library_and_keep_the_limit() -> None:
    """The search never ends below where it began, and no run pulls beyond what it may."""
    found = design(
        question(),
        [],
        [Setting(bench="finger")],
        np.random.default_rng(0),
        duration=4.0,
        force_limit=12.0,
    )
    best = found[0]
    library = [e for e in found if e.prediction.plan.excitation != "designed"]
    assert best.worth >= max(e.worth for e in library)
    assert best.worth > 0.0
    assert all(e.peak_force is not None and e.peak_force < 12.0 for e in found)
    assert best.numbers.keys() == {"gravity_misalignment.angle"}


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
    assert plan.untold == (() if told else ("gravity_misalignment.angle",))
    assert (min(plan.bits.values()) > 4.0) == told
