"""What differs between worlds."""

from pathlib import Path

import numpy as np
import pytest
import torch

from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.errors import InvalidParameter
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.randomisation import BENCH_NUMBERS, effect_ranges
from tendon_train.policy.worlds.world_draws import WorldDraws, mixed
from tests.made import stated_model
from tests.train.policy.small import environment

PULL = 1.2  # rad


def trajectory(finger: FingerEnvironment) -> torch.Tensor:
    """Return motor angles [rad] under a pull and a release, from the open finger, (24, W)."""
    finger.loop.reset(torch.zeros(finger.num_envs, 1))
    rows = []
    for step in range(24):
        position = finger.loop.reading.motor_position
        finger.loop.step(position + (PULL if step < 12 else 0.2))
        rows.append(finger.loop.reading.motor_position[:, 0].clone())
    return torch.stack(rows)


@pytest.mark.parametrize("name", BENCH_NUMBERS)
def test_each_number_alone_changes_the_motion(name: str) -> None:
    """Far beyond float32, and in every world another way; its nominal value changes nothing."""
    drawn = trajectory(environment(randomise=(name,)))
    nominal = trajectory(environment(randomise=(name,), spread=0.0))
    assert float((nominal - nominal[:, :1]).abs().max()) == 0.0
    apart = (drawn - nominal).abs().max(dim=0).values
    assert float(apart.min()) > 1e-4  # rad; a mass moves little in a quasi-static motion
    assert torch.unique(drawn[-1]).numel() == 6


@pytest.mark.parametrize("name", BENCH_NUMBERS)
def test_numbers_stay_within_their_range_and_change_with_the_episode(name: str) -> None:
    """30 % about the nominal value, and only in worlds that begin anew."""
    finger = environment(randomise=(name,), worlds=300)
    exact = environment(randomise=(name,), worlds=1, spread=0.0)
    for array in BENCH_NUMBERS[name]:
        factor = finger.loop.bench_numbers(array) / exact.loop.bench_numbers(array)
        assert 0.7 <= float(factor.min()) < 0.72
        assert 1.28 < float(factor.max()) <= 1.3 + 1e-6
    array = finger.loop.bench_numbers(BENCH_NUMBERS[name][0])
    before = array.clone()
    for _ in range(5):  # episodes of the worlds 3, 7, 11 ... end after five steps
        _, _, dones, _ = finger.step(torch.zeros(300, 1))
    changed = (array != before).reshape(300, -1).any(dim=1)
    assert torch.equal(changed, dones)
    assert int(dones.sum()) == 75


def test_friction_is_a_share_of_the_nominal_spring() -> None:
    """0.1 k (q_max - q_0): 7.9 mN m in the first joint and 4.2 in the second; none unasked."""
    finger = environment(randomise=("joint_friction", "joint_spring"), spread=0.0)
    friction = finger.loop.bench_numbers("friction")[0].tolist()
    assert friction == pytest.approx([0.1 * 0.045 * 1.75, 0.1 * 0.030 * 1.40], rel=1e-6)
    assert float(environment().loop.bench_numbers("friction").abs().max()) == 0.0


def test_the_friction_of_the_model_counts_before_the_default(tmp_path: Path) -> None:
    """A diagnosed fraction of 0.25 is what friction is drawn about, and is not counted twice."""
    effects = (NamedValues(name="joint_dry_friction", values={"fraction": 0.25}),)
    model = Model(
        actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}),
        effects=effects,
    )
    write_model(tmp_path / "model.toml", model)
    finger = environment(
        force=str(tmp_path / "model.toml"), randomise=("joint_friction",), spread=0.0
    )
    assert float(finger.loop.numbers("joint_dry_friction", "fraction").max()) == 0.0
    friction = float(finger.loop.bench_numbers("friction")[0, 0])
    assert friction == pytest.approx(0.25 * 0.045 * 1.75, rel=1e-6)


def test_a_form_that_the_model_leaves_out_is_not_drawn() -> None:
    """A capstan without a stretch behind its guide stays one: the exponent alone differs."""
    model = stated_model(
        "ideal", {"gain": 4.2, "spool_radius": 0.0125}, {"routing_friction": {"exponent": 0.3}}
    )
    (drawn,) = effect_ranges("routing_friction", model, 0.2)
    assert (drawn.name, drawn.low, drawn.high) == (
        "exponent",
        pytest.approx(0.24),
        pytest.approx(0.36),
    )


def test_worlds_differ_about_the_numbers_of_the_model(tmp_path: Path) -> None:
    """An effect's within the spread of its own, and a scale that the model lacks about 1."""
    model = stated_model(
        "ideal", {"gain": 4.2, "spool_radius": 0.0125}, {"tendon_compliance": {"stiffness": 8000.0}}
    )
    write_model(tmp_path / "model.toml", model)
    force, names = str(tmp_path / "model.toml"), ("tendon_compliance", "gain_error")
    finger = environment(force=force, randomise=names, worlds=300, spread=0.2)
    for owner, name, middle in (
        ("tendon_compliance", "stiffness", 8000.0),
        ("gain_error", "scale", 1.0),
    ):
        share = finger.loop.numbers(owner, name) / middle
        assert 0.8 - 1e-6 <= float(share.min()) < 0.82
        assert 1.18 < float(share.max()) <= 1.2 + 1e-6
    with pytest.raises(InvalidParameter, match="drawn about the model's own length"):
        environment(force=force, randomise=("tendon_slack",))


def test_the_numbers_are_those_of_splitmix64() -> None:
    """The first three after the seed 1234567, from the reference implementation in C."""
    state = torch.tensor([1234567], dtype=torch.int64)
    golden = -7046029254386353131
    found = [int(mixed(state + torch.tensor(n) * golden)) % 2**64 for n in (1, 2, 3)]
    assert found == [6457827717110365317, 3203168211198807973, 9817491932198370423]


def test_a_world_draws_the_same_whatever_the_others_do() -> None:
    """World 1 draws five numbers; that world 0 draws more often, or is not there, is nothing."""
    draws, busy = WorldDraws(2, seed=3), WorldDraws(2, seed=3)
    expected = torch.cat([draws.uniform(2)[1], draws.uniform(3)[1]])
    only = torch.tensor([True, False])
    busy.uniform(7, worlds=only)
    found = [busy.uniform(2, worlds=~only)[1]]
    busy.uniform(worlds=only)
    found.append(busy.uniform(3)[1])
    assert torch.equal(torch.cat(found), expected)
    assert torch.equal(WorldDraws(9, seed=3).uniform(5)[1], expected)


def test_numbers_are_uniform_within_and_across_worlds() -> None:
    """Mean and variance to 5 standard errors of a million; neighbours without correlation."""
    values = WorldDraws(1000, seed=0).uniform(1000).double().numpy()
    assert values.min() >= 0.0
    assert values.max() < 1.0
    for sample in (values, values[:, 0], values[0]):
        error = 5.0 * np.sqrt(1.0 / 12.0 / sample.size)
        assert abs(sample.mean() - 0.5) < error
        assert abs(sample.var() - 1.0 / 12.0) < error
    for one, other in ((values[:, 1:], values[:, :-1]), (values[1:], values[:-1])):
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 5.0 / np.sqrt(one.size)
    again = WorldDraws(1000, seed=1).uniform(1000).double().numpy()
    assert abs(np.corrcoef(values.ravel(), again.ravel())[0, 1]) < 5.0e-3
