"""How a training takes its steps, and what it does to its windows."""

import numpy as np
import pytest
import torch
from torch import nn

from tendon_train.actuator.fitting.descent import WARM_UP, Descent, cycle
from tendon_train.actuator.samples.changed_windows import ANGLE, COMMAND, SPEED, ZERO, disturbed

WINDOWS = torch.zeros(4000, 30, 3)


def test_the_learning_rate_is_one_cycle() -> None:
    """Nothing at the start, all after the warm-up, nothing at the end, and no step back between."""
    rates = np.array([cycle(share) for share in np.linspace(0.0, 1.0, 1001)])
    top = int(np.argmax(rates))
    assert rates[0] == pytest.approx(0.0) == rates[-1]
    assert rates[top] == pytest.approx(1.0)
    assert top == pytest.approx(1000 * WARM_UP, abs=1)
    assert np.all(np.diff(rates[: top + 1]) > 0.0)
    assert np.all(np.diff(rates[top:]) < 0.0)


def test_wide_matrices_move_alike_in_all_directions() -> None:
    """Muon's step of a matrix has singular values within a factor of two of each other.

    Its five iterations bring them to 0.7 to 1.2, not to one; the gradient's differ tenfold here.
    """
    torch.manual_seed(0)
    layer = nn.Linear(24, 24)
    before = layer.weight.detach().clone()
    inputs = torch.randn(500, 24) * torch.logspace(0.0, -0.5, 24)
    loss = (layer(inputs) - inputs.flip(1)).square().mean()
    (gradient,) = torch.autograd.grad(loss, layer.weight, retain_graph=True)
    Descent(layer, 1.0e-3).step(loss, WARM_UP)
    assert spread(gradient) > 5.0
    assert spread(layer.weight.detach() - before) < 2.0


def spread(matrix: torch.Tensor) -> float:
    """Return the largest singular value over the smallest [1]."""
    sizes = torch.linalg.svdvals(matrix)
    return float(sizes[0] / sizes[-1])


def test_narrow_layers_are_left_to_adam() -> None:
    """The first step of Adam has the size of its learning rate, whatever the gradient."""
    torch.manual_seed(0)
    layer = nn.Linear(3, 16)
    before = [p.detach().clone() for p in layer.parameters()]
    Descent(layer, 1.0e-3).step(layer(torch.randn(50, 3)).square().mean(), WARM_UP)
    for parameter, old in zip(layer.parameters(), before, strict=True):
        moved = (parameter.detach() - old).abs()
        torch.testing.assert_close(moved, torch.full_like(moved, 1.0e-3), rtol=1e-3, atol=0.0)


def test_windows_are_disturbed_as_stated() -> None:
    """Both angles share a zero, the command has its own error for a window, samples have noise.

    4,000 windows: standard deviations to 5 %.
    """
    moved = disturbed(WINDOWS, torch.Generator().manual_seed(0))
    command, angle, speed = moved.unbind(dim=2)
    assert float(command.std(dim=1).max()) < 1e-6
    assert float(command[:, 0].std()) == pytest.approx(np.hypot(ZERO, COMMAND), rel=0.05)
    assert float(angle.mean(dim=1).std()) == pytest.approx(ZERO, rel=0.05)
    assert float((angle - angle.mean(dim=1, keepdim=True)).std()) == pytest.approx(ANGLE, rel=0.05)
    assert float(speed.std()) == pytest.approx(SPEED, rel=0.05)
    assert float((command[:, 0] - angle.mean(dim=1)).std()) == pytest.approx(COMMAND, rel=0.05)


def test_a_generator_decides_how_windows_are_disturbed() -> None:
    """The same seed disturbs alike, and what was handed in stays as it was."""
    one = disturbed(WINDOWS, torch.Generator().manual_seed(1))
    torch.testing.assert_close(one, disturbed(WINDOWS, torch.Generator().manual_seed(1)))
    assert not WINDOWS.any()
