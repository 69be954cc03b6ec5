"""Gradients through a closed loop with a force network inside, against central differences."""

from collections.abc import Callable

import numpy as np
import pytest
import torch

from tendon_newton.data.recording import Array
from tendon_newton.errors import UnknownName
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.gradients.network_course import TapedNetwork
from tendon_newton.gradients.trajectory_gradient import simulate_with_gradients
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.network_source import NetworkSource
from tendon_newton.simulation.hosts.rollout import Rollout, Stepping
from tests.conftest import SEED
from tests.physics.gradients.test_gradients import loss_of, random_seeds, two_runs
from tests.physics.learned.networks import (
    EFFECTS,
    HOLD,
    RATE,
    WINDOW,
    force_network,
    force_query,
    learned_model,
)
from tests.physics.runs import ROWS

STEP = 5.0e-4  # s
RUN_ROWS = int(1.5 * ROWS) + 1
NUDGE = 1.0e-6  # Relative step of a difference: float64 leaves 1e-8 of the result
DELAYED_ROW = 97  # The row whose command reaches the network in the query at row 100, 31 ms later
INSIGNIFICANT = 1.0e-6  # Share of the largest gradient below which a difference is rounding


@pytest.fixture(scope="module")
def rollout() -> DifferentiableRollout:
    """Two runs of 1.5 s, one from equilibrium and one in motion, with friction.

    The force answers to the shaft between two queries.
    """
    return DifferentiableRollout(
        load_mechanism("finger"),
        two_runs(RUN_ROWS),
        learned_model(hold=HOLD, **EFFECTS),
        network=TapedNetwork(module=force_network().double(), window=WINDOW, rate=RATE),
        time_step=STEP,
        device="cpu",
    )


@pytest.fixture(scope="module")
def seeds(rollout: DifferentiableRollout) -> dict[str, Array]:
    """A random loss by angle and force, each in units of its usual size."""
    return random_seeds(rollout)


def slope(loss: Callable[[], float], move: Callable[[float], None], step: float) -> float:
    """Return a central difference."""
    sides = []
    for sign in (1.0, -1.0):
        move(sign * step)
        sides.append(loss())
        move(-sign * step)
    return (sides[0] - sides[1]) / (2.0 * step)


def array_slope(
    array: object, place: tuple[int, ...], loss: Callable[[], float], size: float
) -> float:
    """Return a central difference by one number of a Warp array."""
    values = array.numpy().copy()

    def move(by: float) -> None:
        values[place] += by
        array.assign(values)

    return slope(loss, move, NUDGE * size)


@pytest.mark.slow
def test_gradients_by_the_weights(rollout: DifferentiableRollout, seeds: dict[str, Array]) -> None:
    """Ten weights at random, through 1.5 s of closed loop: to 1e-3 (1e-2 is asked for)."""
    rollout.forward()
    rollout.backward(**seeds)
    found = [gradient.clone() for gradient in rollout.weight_gradients]
    rng = np.random.default_rng(SEED)
    largest = max(float(gradient.abs().max()) for gradient in found)
    checked = 0
    while checked < 10:
        index = int(rng.integers(len(found)))
        weight = rollout.weights[index].data.view(-1)
        place = int(rng.integers(len(weight)))
        gradient = float(found[index].view(-1)[place])
        if abs(gradient) < INSIGNIFICANT * largest:
            continue  # such as a key's bias, which the softmax cancels
        size = max(abs(float(weight[place])), 0.1)

        def move(by: float, weight: torch.Tensor = weight, place: int = place) -> None:
            weight[place] += by

        expected = slope(lambda: loss_of(rollout, seeds), move, NUDGE * size)
        assert gradient == pytest.approx(expected, rel=1e-3, abs=INSIGNIFICANT * largest)
        checked += 1
    assert largest > 1.0


@pytest.mark.slow
def test_gradients_by_effects_bench_and_actions(rollout, seeds) -> None:
    """To 1e-3, and not zero: every number of the effects, springs, masses, arms, commands."""
    rollout.forward()
    inputs = rollout.backward(**seeds)

    def loss() -> float:
        return loss_of(rollout, seeds)

    arrays = {"parameters": inputs.parameters, "command": inputs.command}
    arrays |= {n: getattr(inputs.mechanism, n) for n in ("stiffness", "mass", "arms", "damping")}
    taped = {name: array.grad.numpy().copy() for name, array in arrays.items()}
    for world in (0, 1):
        places: list[tuple[str, tuple[int, ...]]] = [
            ("parameters", (world, column))
            for column, (owner, _) in enumerate(rollout.table.owners)
            if owner != "command_delay"  # a held force does not answer to when a command came
        ]
        places += [
            ("stiffness", (world, 0)),
            ("mass", (world, 1)),
            ("arms", (world, 0, 1)),
            ("damping", (world, 0)),
            ("command", (RUN_ROWS * world + DELAYED_ROW, 0)),
        ]
        for name, place in places:
            size = max(abs(float(arrays[name].numpy()[place])), 1e-3)
            expected = array_slope(arrays[name], place, loss, size)
            assert expected != 0.0
            assert float(taped[name][place]) == pytest.approx(expected, rel=1e-3), (name, place)


def test_many_substeps_at_once_give_the_same(rollout, seeds, monkeypatch) -> None:
    """What a GPU does between two queries, against one substep after the other."""
    found = []
    for at_once in (False, True):
        monkeypatch.setattr(rollout.substeps, "at_once", at_once)
        rollout.graphs.clear()
        rollout.forward()
        inputs = rollout.backward(**seeds)
        arrays = [array.grad.numpy().copy() for array in (inputs.parameters, inputs.command)]
        found.append([*arrays, *(weight.numpy().copy() for weight in rollout.weight_gradients)])
    rollout.graphs.clear()
    for one_by_one, together in zip(*found, strict=True):
        size = np.abs(one_by_one).max()
        assert together == pytest.approx(one_by_one, rel=1e-9, abs=1e-9 * size)


def test_a_taped_run_is_a_replay(rollout: DifferentiableRollout) -> None:
    """The differentiable loop is the simulator's own, up to the float32 of the other's network."""
    model = learned_model(hold=HOLD, **EFFECTS)
    replay = Rollout(
        load_mechanism("finger"),
        rollout.recordings,
        model,
        force=NetworkSource(force_query()),
        stepping=Stepping(time_step=STEP),
        device="cpu",
    )
    runs = replay.run(replay.base_vectors(model)[None])[0]
    read = rollout.forward()
    expected = np.concatenate([run.motor_position for run in runs])
    assert read.motor_position.numpy() == pytest.approx(expected, abs=1e-5)
    expected = np.concatenate([run.force for run in runs])
    assert read.force.numpy() == pytest.approx(expected, abs=1e-4)


def test_torch_reaches_weights_numbers_and_actions(rollout, seeds) -> None:
    """`backward` of a torch loss gives the same gradients, also after another run in between."""
    parameters = torch.tensor(rollout.inputs.parameters.numpy(), requires_grad=True)
    command = torch.tensor(rollout.inputs.command.numpy(), requires_grad=True)
    stiffness = torch.tensor(rollout.inputs.mechanism.stiffness.numpy(), requires_grad=True)
    out = simulate_with_gradients(
        rollout, parameters=parameters, command=command, stiffness=stiffness
    )
    with torch.no_grad():
        simulate_with_gradients(rollout, command=command + 0.1)
    loss = sum((getattr(out, n) * torch.tensor(s)).sum() for n, s in seeds.items())
    for weight in rollout.weights:
        weight.grad = None
    assert isinstance(loss, torch.Tensor)
    loss.backward()
    rollout.forward()
    expected = rollout.backward(**seeds)
    assert parameters.grad is not None
    assert command.grad is not None
    assert stiffness.grad is not None
    assert torch.equal(parameters.grad, torch.tensor(expected.parameters.grad.numpy()))
    assert torch.equal(command.grad, torch.tensor(expected.command.grad.numpy()))
    assert torch.equal(stiffness.grad, torch.tensor(expected.mechanism.stiffness.grad.numpy()))
    for weight, gradient in zip(rollout.weights, rollout.weight_gradients, strict=True):
        assert weight.grad is not None
        assert torch.equal(weight.grad, gradient)
    with pytest.raises(UnknownName, match="differentiable number"):
        simulate_with_gradients(rollout, stifness=stiffness)
