"""A hand in the kernels of one finger: its fingers move as they would alone."""

import numpy as np
import pytest
import torch

from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts import rollout
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.replay import rollout_of
from tests.conftest import SEED
from tests.physics.runs import ideal_model, run_of, simulate, stairs

FINGERS, WORLDS = 4, 3


def loop_of(name: str, worlds: int) -> ControlLoop:
    """Return worlds of an asset, in the kernels that other tests compile."""
    return ControlLoop(load_mechanism(name), ideal_model(), worlds, max_step=2.0e-3, device="cpu")


def commands(count: int) -> torch.Tensor:
    """Return commands [rad] of all fingers, shape (count, W, 4)."""
    generator = torch.Generator().manual_seed(SEED)
    return 5.0 * torch.rand(count, WORLDS, FINGERS, generator=generator)


def test_each_finger_of_a_hand_moves_like_one_of_its_own() -> None:
    """12 hands' fingers and 12 fingers, with softer springs in one: to the asset's float32."""
    hand, finger = loop_of("hand", WORLDS), loop_of("finger_routed", WORLDS * FINGERS)
    assert (hand.solver.chain_count, finger.solver.chain_count) == (FINGERS, 1)
    assert (hand.joint_count, hand.tendon_count) == (12, 4)
    hand.bench_numbers("stiffness")[1, 6:9] *= 0.8  # the third finger of the second hand
    finger.bench_numbers("stiffness")[6] *= 0.8
    hand.numbers("ideal", "gain")[2, 3] = 3.0
    finger.numbers("ideal", "gain")[11] = 3.0
    first, *others = commands(16)
    hand.reset(first)
    finger.reset(first.reshape(-1, 1))
    for command in others:
        seen, alone = hand.step(command), finger.step(command.reshape(-1, 1))
        for name in ("motor_position", "force"):
            own = getattr(alone, name).reshape(WORLDS, FINGERS)
            assert getattr(seen, name).numpy() == pytest.approx(own.numpy(), abs=2e-4)
        joints = alone.joint_position.reshape(WORLDS, 12)
        assert seen.joint_position.numpy() == pytest.approx(joints.numpy(), abs=5e-5)
    assert seen.tip is not None
    assert np.ptp(seen.joint_position.numpy()) > 0.5


def test_a_hand_that_is_lost_or_begins_anew_leaves_the_others_alone() -> None:
    """A finger that is no number marks its hand; a masked reset heals it, to the last bit."""
    hand, healthy = loop_of("hand", WORLDS), loop_of("hand", WORLDS)
    first, second, third = commands(3)
    for loop in (hand, healthy):
        loop.reset(first)
    hand.bench_numbers("mass")[1, 4] = torch.nan
    hand.step(second)
    healthy.step(second)
    assert hand.reading.diverged.tolist() == [False, True, False]
    hand.bench_numbers("mass").copy_(healthy.bench_numbers("mass"))
    mask = torch.tensor([False, True, False])
    for loop in (hand, healthy):
        loop.reset(first, mask)
        loop.step(third)
    assert not hand.reading.diverged.any()
    assert torch.equal(hand.reading.joint_position, healthy.reading.joint_position)
    assert torch.equal(hand.reading.force, healthy.reading.force)


def test_recordings_of_a_hand_are_replayed_finger_by_finger() -> None:
    """Two recordings of different length, at once: each finger as it would be alone.

    To the asset's float32, from rest and from a measured start, and with numbers of each recording.
    """
    rng = np.random.default_rng(SEED)
    rows = (13, 17)
    commands = [
        np.stack([stairs(rng, count, 0.5, 3.0, 4) for _ in range(FINGERS)], axis=1)
        for count in rows
    ]
    starts = ({}, {"start": "first_row", "angle": 0.6, "speed": 0.4})
    gains = ({}, {"actuator_overrides": {"gain": 3.5}})
    model = ideal_model()
    hand = rollout_of(
        load_mechanism("hand"),
        [
            run_of(command, bench="hand", **start, **gain)
            for command, start, gain in zip(commands, starts, gains, strict=True)
        ],
        model,
        device="cpu",
    )
    assert hand.kernels.structure.joint_count == 3
    whole = hand.run(hand.base_vectors(model)[None])[0]
    finger = rollout_of(
        load_mechanism("finger_routed"),
        [
            run_of(command[:, k], bench="finger_routed", **start, **gain)
            for command, start, gain in zip(commands, starts, gains, strict=True)
            for k in range(FINGERS)
        ],
        model,
        device="cpu",
    )
    alone = finger.run(finger.base_vectors(model)[None])[0]
    for r, count in enumerate(rows):
        assert whole[r].joint_position.shape == (count, 12)
        own = alone[r * FINGERS : (r + 1) * FINGERS]
        for name, tolerance in (
            ("joint_position", 5e-5),
            ("motor_position", 2e-4),
            ("force", 1e-3),
        ):
            expected = np.concatenate([getattr(each, name) for each in own], axis=1)
            assert getattr(whole[r], name) == pytest.approx(expected, abs=tolerance)


def test_space_and_plane_give_the_same_finger(monkeypatch, rng) -> None:
    """The general equations, told nothing of the plane, lead to the same motion."""
    runs = [run_of(stairs(rng, 81, 0.5, 3.0, 20))]
    planar = simulate(runs, ideal_model(), time_step=5e-4)[0]
    monkeypatch.setattr(rollout, "plane_of", lambda *_: None)
    spatial = simulate(runs, ideal_model(), time_step=5e-4)[0]
    # rounding of float64 over 2,000 steps
    assert spatial.joint_position == pytest.approx(planar.joint_position, abs=1e-10)
    assert spatial.force == pytest.approx(planar.force, abs=1e-8)
