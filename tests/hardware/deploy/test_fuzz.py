"""A thousand broken inputs: each is refused or survived, and nothing moves out of its limits."""

import json
import os
import random
from pathlib import Path

import numpy as np

from tendon_hardware.control.goals import LineGoals, parse_goal, read_goals
from tendon_hardware.control.keyboard import split_keys
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.virtual_bench import Faults
from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.errors import TendonNewtonError
from tests.fuzz.mutations import flip
from tests.hardware.deploy.policies import card_of
from tests.hardware.deploy.runs import Flight


def test_broken_cards_are_refused_or_still_true() -> None:
    """Of 600 broken cards each is refused, or is a card that keeps every promise."""
    rng = random.Random(1)
    text = card_of().to_json()
    table = json.loads(text)
    values = (None, True, -1, 0, 1e308, "x", [], {}, [[]], "9" * 5000, 10**400, float("nan"))
    for count in range(600):
        if count % 2:
            key = rng.choice(list(table))
            broken = json.dumps(table | {key: rng.choice(values)})
        else:
            broken = flip(text.encode(), rng).decode("utf-8", errors="replace")
        try:
            card = PolicyCard.from_json(broken)
        except TendonNewtonError:
            continue
        assert PolicyCard.from_json(card.to_json()) == card


def test_broken_goals_change_nothing(tmp_path: Path) -> None:
    """Of 570 broken lines, files and keys each gives a number, an error of ours, or nothing."""
    rng = random.Random(2)
    for _ in range(270):
        line = flip(b"0.7854", rng).decode("latin-1")
        try:
            assert np.isfinite(parse_goal(line))
        except TendonNewtonError:
            continue
    path = tmp_path / "goals.txt"
    for _ in range(100):
        path.write_bytes(flip(b"0 0.1\n1.5, 0.9\n3 0\n# end\n", rng))
        try:
            read_goals(path)
        except TendonNewtonError:
            continue
    read_end, write_end = os.pipe()
    goals = LineGoals(0.3, read_end)
    for _ in range(200):
        os.write(write_end, flip(b"0.5\n0.7\n", rng))
        assert np.isfinite(goals.value(0.0))
        split_keys(flip(b"\x1b[A\x1b[B q5", rng))
    assert len(goals.notes) <= 1, "a flood of nonsense is told once"
    os.close(read_end)
    os.close(write_end)


def test_broken_serial_streams_never_move_the_spool_out_of_its_limits() -> None:
    """Answers dropped, broken and drowned in noise, and the same for the load cell's lines."""
    rng = random.Random(3)
    for _ in range(30):
        worst = Faults(
            dropped_replies=rng.uniform(0.0, 0.4),
            corrupted_replies=rng.uniform(0.0, 0.4),
            line_noise=rng.uniform(0.0, 0.6),
            garbled_lines=rng.uniform(0.0, 0.9),
            lost_lines=rng.uniform(0.0, 0.5),
            extra_latency=rng.choice((0.0, 0.002, 0.01)),
        )
        angles: list[float] = []

        def spoil(bench, stop, worst=worst) -> None:
            bench.controls.set_faults(worst)

        flight = Flight(settings=DeploySettings(duration=2.0), fault=spoil, after=0.3)
        flight.operator.show = lambda progress, angles=angles: angles.extend(progress.position)
        flight.fly()
        assert not flight.torque_after or any("SUPPLY OFF" in t for t in flight.operator.told)
        assert -0.1 < flight.angle_after < 1.5
        assert all(-0.1 < angle < 1.5 for angle in angles)
