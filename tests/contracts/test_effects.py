"""What every effect of the catalogue promises; a new one is tested unasked."""

import importlib
import math
import re

import numpy as np
import pytest

from tendon_newton.effects import EFFECTS, Effect, Stage, find_effect
from tendon_newton.errors import InvalidModelFile
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.rollout import Candidates, Rollout, Trajectory
from tendon_newton.simulation.model.structure import in_catalogue_order
from tests.effect_bench import GAIN, commanded, simulate, steps_and_waves
from tests.made import stated_model

FRICTIONS = [n for n, e in EFFECTS.items() if e.side == "actuator" and n.endswith("friction")]
UNSEEN = {"tip", "current", "voltage"}
IN_TRAJECTORIES = [n for n, e in EFFECTS.items() if not UNSEEN & {*e.further_signals()}]
"""What moves angles or forces; tests/identification/test_signals.py sees the others."""
ENCODER_FLOOR = 0.44e-3  # [rad] half a count of 4096 a turn
CELL_FLOOR = 0.05  # [N]
ROUGH = "coulomb_friction"
"""What stands beside an effect of dry friction's bristles, which has none of its own."""


CLEAR = {"overload_cut": [0.2, 0.1, 0.1]}
"""Numbers that show within two seconds of a finger, where typical ones would need a stall."""


def clear_values(effect: type[Effect]) -> list[float]:
    """Return typical values; halfway to a bound for a parameter that is typically at null."""
    if effect.name in CLEAR:
        return CLEAR[effect.name]
    return [
        p.nominal if p.nominal != p.null else p.null + 0.3 * (p.upper - p.null)
        for p in effect.parameters
    ]


IDEAL = stated_model("ideal", {"gain": GAIN})


@pytest.fixture(scope="module")
def finger() -> Rollout:
    """One finger in the kernel that holds the whole catalogue."""
    recording = commanded(steps_and_waves(), "finger")
    every = Candidates(effects=tuple(EFFECTS))
    return Rollout(load_mechanism("finger"), [recording], IDEAL, candidates=every)


@pytest.fixture(scope="module")
def null_vector(finger: Rollout) -> np.ndarray:
    """Every effect switched off."""
    return finger.base_vectors(IDEAL)[0]


@pytest.fixture(scope="module")
def vectors(finger: Rollout, null_vector: np.ndarray) -> np.ndarray:
    """One candidate per effect, in the order of the catalogue, and the one without any last."""
    out = np.repeat(null_vector[None, None], len(EFFECTS) + 1, axis=0)
    for index, (name, effect) in enumerate(EFFECTS.items()):
        out[index, 0, list(finger.table.columns(name))] = clear_values(effect)
        if effect.smooth:
            rough = find_effect(ROUGH)
            out[index, 0, list(finger.table.columns(ROUGH))] = clear_values(rough)
    return out


@pytest.fixture(scope="module")
def trajectories(finger: Rollout, vectors: np.ndarray) -> dict[str, Trajectory]:
    """What each effect makes of the finger."""
    runs = finger.run(vectors)
    return {name: runs[index][0] for index, name in enumerate([*EFFECTS, "none"])}


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_says_what_it_is(name: str) -> None:
    """Equation, source, validity, signature and what it is confused with stand in its docstring."""
    effect = find_effect(name)
    doc = effect.__doc__ or ""
    for part in (".. math::", "Source:", "Validity:", "Signature:", "Confused with:"):
        assert part in doc
    module = importlib.import_module(f"tendon_newton.effects.{name}")
    assert effect.__module__ == module.__name__
    assert effect.name == name
    assert all(re.search(rf"\b{other}\b", doc.partition("Confused with:")[2])
               and other in EFFECTS and other != name for other in effect.confused)  # fmt: skip
    assert any(effect.hook(stage) for stage in Stage)
    assert (effect.memory is None) == (not effect.renewals())


@pytest.mark.parametrize("name", EFFECTS)
def test_the_parameters_of_an_effect_are_complete(name: str) -> None:
    """Each has a source, and what an effect refers to exists."""
    effect = find_effect(name)
    assert 1 <= len(effect.parameters) <= 3
    for parameter in effect.parameters:
        assert parameter.source
    assert {*effect.dry, *effect.smooth} <= {p.name for p in effect.parameters}
    assert set(effect.includes) <= set(EFFECTS)


def test_all_effects_at_null_change_nothing(trajectories: dict[str, Trajectory]) -> None:
    """The whole catalogue at null is the bare model to rounding (1e-12: sums in another order)."""
    bare = simulate(commanded(steps_and_waves(), "finger"), kernel=())
    null = trajectories["none"]
    np.testing.assert_allclose(null.motor_position, bare.motor_position, atol=1e-12, rtol=0)
    np.testing.assert_allclose(null.joint_position, bare.joint_position, atol=1e-12, rtol=0)
    np.testing.assert_allclose(null.force, bare.force, atol=1e-11, rtol=0)


@pytest.mark.parametrize("name", IN_TRAJECTORIES)
def test_an_effect_is_seen(name: str, trajectories: dict[str, Trajectory]) -> None:
    """At a clear strength it moves an angle or a force by more than the sensors' noise."""
    with_effect = trajectories[name]
    without = trajectories[ROUGH if find_effect(name).smooth else "none"]
    joint = np.abs(with_effect.joint_position - without.joint_position).max()
    angle = np.abs(with_effect.motor_position - without.motor_position).max()
    force = np.abs(with_effect.force - without.force).max()
    assert math.isfinite(angle)
    assert math.isfinite(force)
    assert angle > ENCODER_FLOOR or force > CELL_FLOOR or joint > ENCODER_FLOOR


@pytest.mark.parametrize("name", FRICTIONS)
def test_friction_takes_power(name: str, trajectories: dict[str, Trajectory]) -> None:
    """(F_m - F) v >= 0 in every row in which the tendon pulls."""
    out = trajectories[name]
    command = steps_and_waves()[:, None]
    motor = np.clip(GAIN * (command - out.motor_position), -21.0, 21.0)
    lost = (motor - out.force) * out.motor_velocity
    assert (lost[out.force > 0.0] >= -1e-9).all()
    assert lost.max() > 0.0


def test_a_batch_is_a_loop(finger, vectors, trajectories) -> None:
    """Worlds do not know of each other, not even by a last digit."""
    for name in ("actuator_lag", "load_cell_delay", "none"):
        index = [*EFFECTS, "none"].index(name)
        alone = finger.run(vectors[index : index + 1])[0][0]
        np.testing.assert_array_equal(alone.motor_position, trajectories[name].motor_position)
        np.testing.assert_array_equal(alone.force, trajectories[name].force)


def test_effects_act_in_the_order_of_the_catalogue(finger: Rollout) -> None:
    """However a model lists them: the demand is limited, then lags, then meets friction."""
    names = list(EFFECTS)
    assert list(in_catalogue_order(tuple(reversed(names)))) == names
    assert list(finger.table.effects) == names
    order = (
        "force_saturation", "actuator_lag", "coulomb_friction", "speed_limit", "routing_friction",
    )  # fmt: skip
    assert [n for n in names if n in order] == list(order)


def test_a_pure_number_outside_its_range_is_told_without_a_unit(finger: Rollout) -> None:
    """A knee is between 0 and 0.2, and not "0.2 1"."""
    model = stated_model("ideal", {"gain": GAIN}, {"force_saturation": {"limit": 8.0, "knee": 5.0}})
    with pytest.raises(InvalidModelFile, match=r"between 0 and 0\.2 \(at 0\.2"):
        finger.base_vectors(model)
