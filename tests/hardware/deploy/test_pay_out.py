"""The pay-out rule: far below home while there is tendon to pay out, and no farther than home."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.control.goals import FixedGoal
from tendon_hardware.deployment.deploy_log import read_steps
from tendon_hardware.deployment.deploy_settings import DeploySettings, loops_of, refuse_mismatch
from tendon_hardware.errors import PolicyMismatch
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.data.cards.policy_observation import motor_command
from tendon_newton.errors import InvalidParameter, InvalidPolicyFile
from tests.faults.injections import silence
from tests.hardware.deploy.policies import card_of, card_of_two, policy_of
from tests.hardware.deploy.runs import Flight

RANGE, RULE = (-1.2, 6.28), (0.0, 0.05)
PAYING = card_of(command_range=RANGE, pay_out=RULE)
SETTINGS = DeploySettings(duration=4.0, loop=loops_of(PAYING)[0])
angles = st.floats(-2.0, 8.0, width=32)


@given(position=angles, action=angles)
def test_a_motor_at_home_is_asked_for_no_less_than_home(position: float, action: float) -> None:
    """Beyond the second angle the whole range counts, up to it the range from home."""
    command = motor_command(np.float32(position), np.float32(action), RANGE, RULE)
    wanted = np.float32(position) + np.float32(action)
    low = np.float32(RANGE[0]) if position > RULE[1] else np.float32(RULE[0])
    assert command == wanted.clip(low, np.float32(RANGE[1]))


def test_numpy_and_torch_pay_out_alike(rng: np.random.Generator) -> None:
    """Training and deployment have the same rule, bit for bit, of one servo and of several."""
    position = rng.uniform(-0.5, 1.0, (200, 2)).astype(np.float32)
    action = rng.uniform(-3.0, 3.0, (200, 2)).astype(np.float32)
    each = (
        np.array([RANGE, (-3.0, 4.0)], np.float32).T,
        np.array([RULE, (-1.8, -1.7)], np.float32).T,
    )
    for limits in ((RANGE, RULE), tuple((pair[0], pair[1]) for pair in each)):
        command = motor_command(position, action, *limits)
        tensors = [
            tuple(torch.as_tensor(end) if isinstance(end, np.ndarray) else end for end in pair)
            for pair in limits
        ]
        same = motor_command(torch.from_numpy(position), torch.from_numpy(action), *tensors)  # pyright: ignore
        assert command.dtype == np.float32
        assert np.array_equal(same.numpy(), command)


def test_a_policy_without_the_rule_is_what_it_was(rng: np.random.Generator) -> None:
    """Its card has no further key, its loop and its commands are those of the range alone."""
    card = card_of(command_range=(-0.4, 6.28))
    assert "pay_out_rad" not in json.loads(card.to_json())
    assert loops_of(card) == (HostPositionLoop(position_range=(-0.4, 6.28)),)
    position, action = rng.normal(size=(2, 1000)).astype(np.float32)
    command = motor_command(position, action, card.command_range, card.pay_out)
    assert np.array_equal(command, (position + action).clip(-0.4, 6.28))


def test_the_rule_stands_on_the_card_of_every_servo() -> None:
    """Written and read; the range keeps its meaning, what a command can be."""
    further = replace(
        card_of_two().further_servos[0], command_range=(-3.0, 4.48), pay_out=(-1.8, -1.75)
    )
    card = card_of_two(command_range=RANGE, pay_out=RULE, further_servos=(further,))
    assert PolicyCard.from_json(card.to_json()) == card
    table = json.loads(card.to_json())
    assert table["command_range_rad"] == list(RANGE)
    assert table["pay_out_rad"] == list(RULE)
    assert table["further_servos"][0]["pay_out_rad"] == [-1.8, -1.75]
    assert [loop.position_range for loop in loops_of(card)] == [(0.0, 6.28), (-1.8, 4.48)]


@pytest.mark.parametrize(
    "changes",
    [
        {"pay_out": (-1.2, 0.05)},
        {"pay_out": (0.0, -0.1)},
        {"pay_out": (0.0, 6.5)},
        {"pay_out": (float("nan"), 0.05)},
        {"command_range": (-2.5, 6.28)},
        {"observation": card_of_two().observation, "further_servos": card_of_two().further_servos},
    ],
)
def test_a_rule_that_limits_nothing_is_refused(changes: dict[str, Any]) -> None:
    """Home lies in the range, at most 2 rad above its end, and every servo has a rule or none."""
    with pytest.raises(InvalidPolicyFile, match="pay_out_rad"):
        card_of(**{"command_range": RANGE, "pay_out": RULE} | changes)


@pytest.mark.parametrize("pay_out", [(0.0, 0.1), (-1.0, -0.1), (-1.0, 7.0)])
def test_a_loop_refuses_such_a_rule_as_well(pay_out: tuple[float, float]) -> None:
    """Its least command lies below the range, the angle of a wound-in spool in it."""
    with pytest.raises(InvalidParameter, match="pay_out must be"):
        HostPositionLoop(pay_out=pay_out)


def test_only_with_the_rule_a_command_may_lie_below_the_window() -> None:
    """The window is about the spool, and a spool at home is never asked to leave it."""
    address = BenchAddress(bench="finger", port="virtual")
    refuse_mismatch(PAYING, SETTINGS, address)
    for wrong in (card_of(command_range=RANGE), replace(PAYING, pay_out=(-0.6, 0.05))):
        with pytest.raises(PolicyMismatch, match="command_range_rad -"):
            refuse_mismatch(wrong, SETTINGS, address)


@given(command=angles, position=angles)
def test_the_loop_on_the_host_keeps_the_rule_itself(command: float, position: float) -> None:
    """Also for a command that was given when the spool still was wound in."""
    loop = SETTINGS.loop
    duty = loop.duty(command, position)
    assert not (position <= RULE[0] and duty < 0.0)
    if position <= RULE[1]:
        assert duty >= loop.gain * min(RULE[0] - position, 0.0) + loop.offset - 1e-12  # float64
    assert duty >= loop.gain * (RANGE[0] - position) + loop.offset - 1e-12 or position > 6.28


def test_the_spool_pays_out_sooner_and_stops_at_home(tmp_path: Path) -> None:
    """A policy that winds in for two seconds and then lets out with all its might, on the bench."""
    arrived = {}
    for name, card in (("range", card_of(command_range=(-0.4, 6.28))), ("rule", PAYING)):
        count = iter(range(1000))
        policy = policy_of(lambda sample, count=count: 1.5 if next(count) < 40 else -19.0, card)
        path = tmp_path / f"{name}.mcap"
        outcome = Flight(
            path=path,
            policy=policy,
            goals=FixedGoal(0.0, (0.0, 1.57)),
            settings=replace(SETTINGS, loop=loops_of(card)[0]),
        ).fly()
        assert outcome.fault is None
        steps = list(read_steps(path))
        angle = np.array([step.sample[0] for step in steps])
        command = np.array([step.command[0] for step in steps])
        assert angle.max() > 0.8
        assert command.min() == pytest.approx(card.command_range[0])
        low = card.turning_range[0]
        assert angle.min() > low - 0.05  # of a policy step at the speed of the last command
        if name == "rule":
            assert command[angle <= RULE[1]].min() >= RULE[0]
        arrived[name] = int(np.argmax((angle < 0.3) & (np.arange(len(angle)) > 40)))
    assert 40 < arrived["rule"] < arrived["range"]


@pytest.mark.parametrize("after", [2.5, 2.8, 2.9, 3.0, 3.1])
def test_a_silent_servo_that_pays_out_stays_within_the_window(after: float) -> None:
    """For 0.2 s it keeps its last duty, wherever on its way home; then it is off."""
    count = iter(range(1000))
    flight = Flight(
        policy=policy_of(lambda sample: 1.5 if next(count) < 40 else -19.0, PAYING),
        goals=FixedGoal(0.0, (0.0, 1.57)),
        settings=SETTINGS,
        after=after,
        fault=silence,
    )
    outcome = flight.fly()
    assert "silent for 0.2" in str(outcome.fault)
    assert not flight.torque_after
    assert flight.angle_after > -0.1  # 0.5 rad/s for 0.25 s, from 0.05 rad
