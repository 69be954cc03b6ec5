"""Random numbers of worlds: uniform, independent of each other, and of what other worlds draw."""

import numpy as np
import torch

from tendon_train.policy.worlds.world_draws import WorldDraws, mixed


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
