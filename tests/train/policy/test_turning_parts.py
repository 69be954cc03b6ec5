"""What turning a ball needs no simulation for: turns, figures, sample, card and camera."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from tendon_newton.data.cards.policy_card import FurtherServo, PolicyCard
from tendon_newton.data.cards.policy_observation import ObservationHistory, sample_of
from tendon_newton.data.cards.turning_task import TurningTask, half_turn
from tendon_newton.data.turning_figures import turning_figures
from tendon_newton.errors import InvalidParameter, InvalidPolicyFile
from tendon_newton.mechanisms.geometry.obstacles import Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.turning_config import TurningConfig
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.observation_tensors import ObservationTensors
from tendon_train.policy.worlds.task import TaskOutcome
from tendon_train.policy.worlds.turning import SimulatedCamera, Turning, body_of
from tendon_train.policy.worlds.world_draws import WorldDraws
from tests.hardware.deploy.policies import card_of

TASK = TurningTask(asset="hand_ball", axis=(0.0, 1.0, 0.0), drop_distance=0.015)
WORLDS = 200


def turning_card(**changes: Any) -> PolicyCard:
    """Return the card of a policy of four servos that turns a ball."""
    servo = FurtherServo(
        command_range=(-1.2, 6.28), spool_radius=0.0125, servo="xc330_t288_t", force_limit=21.0
    )
    own = {"observation": sample_of(4, "turn"), "further_servos": (servo,) * 3}
    return card_of(**{**own, "turning": TASK, "goal_range": (0.5, 1.5), **changes})


def test_a_turn_about_an_axis_is_what_rotations_say(rng: np.random.Generator) -> None:
    """For any posture before; a quaternion and its negative are one turn, in torch as in numpy."""
    angles = rng.uniform(-3.0, 3.0, 20)
    before = Rotation.random(20, random_state=1)
    after = (Rotation.from_rotvec(angles[:, None] * np.array(TASK.axis)) * before).as_quat()
    for later in (after, -after):
        sine, cosine = half_turn(before.as_quat(), later, np.array(TASK.axis))
        assert 2.0 * np.arctan2(sine, cosine) == pytest.approx(angles, abs=1e-12)
        seen = half_turn(*map(torch.from_numpy, (before.as_quat(), later, np.array(TASK.axis))))
        assert seen[0].numpy() == pytest.approx(sine, abs=1e-15)
    aside = (Rotation.from_rotvec([0.3, 0.0, 0.0]) * before).as_quat()
    assert half_turn(before.as_quat(), aside, np.array(TASK.axis))[0] == pytest.approx(0.0)


def test_turns_count_in_the_cup_and_each_way_out_is_a_drop() -> None:
    """0.1 rad a row; the first ball is out in two rows of ten, and three turns touch those."""
    pose = np.zeros((10, 2, 7))
    turned = 0.1 * np.arange(10)[:, None] * np.array(TASK.axis)
    pose[:, :, 3:] = Rotation.from_rotvec(turned).as_quat()[:, None]
    pose[4:6, 0, 2] = 0.016
    tension = np.zeros((10, 2, 4))
    tension[3, 1, 2] = 7.5
    found = turning_figures(TASK, period=0.05, pose=pose, start=np.zeros(3), tension=tension)
    assert found.turned == pytest.approx([0.6, 0.9])
    assert found.drops.tolist() == [1, 0]
    assert found.turned_per_minute == pytest.approx(0.75 * 120.0)
    assert found.drops_per_minute == pytest.approx(60.0)
    assert found.largest_tension == 7.5


def test_the_card_of_a_policy_that_turns_says_so_and_comes_back() -> None:
    """Task, axis, rates and drop distance; a card of a tip has none of these keys."""
    card = turning_card()
    assert (card.task, card_of().task) == ("turn", "tip")
    assert PolicyCard.from_json(card.to_json()) == card
    assert '"rate_range_rad_s"' in card.to_json()
    assert "turn" not in card_of().to_json()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"turning": None}, "observation must be"),
        ({"goal_range": (2.0, 1.0)}, "rate_range_rad_s"),
        ({"turning": TurningTask(asset="", axis=(0.0, 1.0, 0.0), drop_distance=0.1)}, "asset"),
        ({"turning": TurningTask(asset="a", axis=(0.0, 2.0, 0.0), drop_distance=0.1)}, "axis"),
        ({"turning": TurningTask(asset="a", axis=(0.0, 1.0, 0.0), drop_distance=0.0)}, "drop"),
    ],
)
def test_a_wrong_card_of_a_policy_that_turns_is_named(changes: dict[str, Any], said: str) -> None:
    """The first number that cannot be is."""
    with pytest.raises(InvalidPolicyFile, match=said):
        turning_card(**changes)


def test_an_axis_that_is_no_vector_is_refused() -> None:
    """As it stands in a file."""
    with pytest.raises(InvalidPolicyFile, match="axis must be 3 finite numbers"):
        PolicyCard.from_json(turning_card().to_json().replace('"axis": [', '"axis": [0.0, '))


def test_deployment_and_training_build_the_same_sample(rng: np.random.Generator) -> None:
    """Servos, then the rate, then the ball; bit for bit."""
    deployed, tensors = (
        ObservationHistory(3, 5, 4, "turn"),
        ObservationTensors(3, 5, "cpu", 4, "turn"),
    )
    for _ in range(8):
        position, velocity, action = rng.normal(size=(3, 3, 4)).astype(np.float32)
        goal, ball = (
            rng.normal(size=3).astype(np.float32),
            rng.normal(size=(3, 4)).astype(np.float32),
        )
        seen = deployed.observe(position, velocity, goal, ball)
        tensors.observe(*map(torch.from_numpy, (position, velocity, goal, ball)))
        assert np.array_equal(seen, tensors.flat().numpy())
        assert np.array_equal(seen[:, -5:], np.column_stack([goal, ball]))
        deployed.act(action)
        tensors.act(torch.from_numpy(action))
    own = [name for name, _ in sample_of(4, "turn")[-5:]]
    assert own == ["rate", "behind", "ball_x", "ball_y", "ball_z"]


class StillHands:
    """Balls in cups that a test moves, as a loop of worlds shows them."""

    def __init__(self) -> None:
        self.body_pose = torch.zeros(WORLDS, 7)
        self.body_pose[:, 6] = 1.0
        self.body_velocity = torch.zeros(WORLDS, 6)
        self.reading = SimpleNamespace(force=torch.zeros(WORLDS, 4))
        self.numbers = {
            "body_mass": torch.zeros(WORLDS),
            "body_inertia": torch.zeros(WORLDS, 3),
            "obstacle_size": torch.zeros(WORLDS, 5, 3),
            "obstacle_friction": torch.zeros(WORLDS, 5),
        }

    def bench_numbers(self, name: str) -> torch.Tensor:
        """Return a number of all worlds."""
        return self.numbers[name]


def paid(task: Turning) -> TaskOutcome:
    """Return the pay of a step."""
    return task.score()


def turning(loop: Any, hand: str = "hand_ball", **changes: Any) -> Turning:
    """Return the task to turn what such hands hold at 1 rad/s."""
    own = TurningConfig(turn_rates=(1.0, 1.0), **changes)
    config = EnvironmentConfig(task="turn", worlds=WORLDS, spread=0.3, turning=own)
    task = Turning(config, loop, load_mechanism(hand), WorldDraws(WORLDS))
    task.begin(torch.ones(WORLDS, dtype=torch.bool))
    return task


@pytest.mark.parametrize(
    ("rate", "behind", "pay"),
    [(1.0, 0.0, 1.0), (0.5, 1.0, 0.0), (0.0, 1.0, -0.5), (1.5, -1.0, 0.0), (-0.5, 1.0, -1.0)],
)
def test_a_hand_is_paid_for_turning_its_ball_as_fast_as_it_was_told(rate, behind, pay) -> None:
    """A steady turn for ten time constants; a hand 1 rad behind shall catch up in 2 s."""
    loop = StillHands()
    task = turning(loop, camera_noise=(0.0, 0.0), camera_delay=(0, 0), catch_up_time=2.0)
    task.seen()
    reward = torch.zeros(WORLDS)
    for step in range(1, 201):
        turned = Rotation.from_rotvec(rate * step / 20.0 * np.array(TASK.axis)).as_quat()
        loop.body_pose[:, 3:] = torch.from_numpy(turned)
        reward = paid(task).reward
        (seen,) = task.seen()
    expected = behind or 0.05  # the turn of the first step, before the camera has seen any
    assert seen[:, 0].numpy() == pytest.approx(expected, abs=1e-3)
    pay = pay if behind else 1.0 - expected / 2.0
    assert reward.numpy() == pytest.approx(pay, abs=1e-3)  # exp(-10) and float32


def test_a_ball_out_of_its_cup_costs_its_way_and_its_drop() -> None:
    """Beside 20 a metre 10 for a drop, which begins 15 mm away and ends the episode."""
    loop = StillHands()
    task = turning(loop)
    loop.body_pose[0, 0], loop.body_pose[1, 2] = 0.014, 0.016
    outcome = paid(task)
    assert outcome.reward[:3].tolist() == pytest.approx([-0.28, -0.3 - 10.0, 0.0], abs=1e-6)
    assert outcome.failed.tolist() == [world == 1 for world in range(WORLDS)]


def test_strings_that_stretch_want_short_steps() -> None:
    """At 2.5 ms such a hand turns its ball by what the solver makes up: refused in one line."""
    own = EnvironmentConfig(
        task="turn", worlds=1, max_step=2.5e-3,
        force="lab/studies/turning_models/stretching.toml",
    )  # fmt: skip
    with pytest.raises(InvalidParameter, match=r"max_step must be 0\.001 s at most"):
        FingerEnvironment(own)


def test_each_ball_has_its_own_mass_friction_and_size() -> None:
    """Each uniform within its spread about the asset's number, and none follows another."""
    loop = StillHands()
    turning(loop).place(torch.ones(WORLDS, dtype=torch.bool))
    ball = load_mechanism("hand_ball").obstacles[0]
    assert isinstance(ball, Sphere)
    shares = [
        loop.numbers["body_mass"] / ball.mass - 1.0,
        loop.numbers["obstacle_friction"][:, 0] / ball.friction - 1.0,
        loop.numbers["obstacle_size"][:, 0, 0] / ball.radius - 1.0,
    ]
    for share, spread in zip(shares, (0.3, 0.3, 0.02), strict=True):
        assert float(share.abs().max()) <= spread * 1.001
        # a uniform draw's deviation is its half width / sqrt(3), known to 1 / sqrt(200) here
        assert float(share.std()) == pytest.approx(spread / np.sqrt(3.0), rel=0.15)
    assert np.abs(np.corrcoef(shares) - np.eye(3)).max() < 0.3  # four deviations of 200 numbers


def test_a_pen_of_another_size_keeps_its_shape() -> None:
    """All edges grow alike, and the inertia is that of the solid that is drawn."""
    loop = StillHands()
    turning(loop, "hand_pen").place(torch.ones(WORLDS, dtype=torch.bool))
    hand = load_mechanism("hand_pen")
    body = body_of(hand)
    pen = hand.obstacles[body]
    half, mass = loop.numbers["obstacle_size"][:, body], loop.numbers["body_mass"]
    share = half / half.new_tensor(pen.size)
    assert share.numpy() == pytest.approx(share[:, :1].expand(-1, 3).numpy(), rel=1e-6)  # float32
    assert 0.015 < float((share - 1.0).abs().max()) <= 0.02 * 1.001
    solid = mass[:, None] / 3.0 * (half.square().sum(dim=1, keepdim=True) - half.square())
    assert loop.numbers["body_inertia"].numpy() == pytest.approx(solid.numpy(), rel=1e-5)


def test_the_longest_pen_starts_free_between_the_beads_at_its_ends() -> None:
    """Of all sizes that training draws; a tenth of a millimetre is left at least."""
    hand = load_mechanism("hand_pen")
    pen = hand.obstacles[body_of(hand)]
    longest = (1.0 + TurningConfig().size_spread) * pen.size[1]
    beads = [each for each in hand.obstacles if isinstance(each, Sphere)]
    ends = [each for each in beads if abs(each.position[1]) > pen.size[1]]
    assert len(ends) == 2
    for bead in ends:
        assert abs(bead.position[1]) - bead.radius > longest + 1e-4


def test_a_camera_is_late_by_a_step_or_two_and_noisy_as_stated() -> None:
    """Places that grow by a millimetre a step; noise of 1 mm is that of 600 numbers."""
    everywhere = torch.ones(WORLDS, dtype=torch.bool)
    still = torch.zeros(WORLDS, 4)
    own = TurningConfig(camera_noise=(0.0, 0.0))
    sharp = SimulatedCamera(own, WORLDS, WorldDraws(WORLDS), 0.025)
    sharp.begin(everywhere)
    for step in range(1, 6):
        sharp.take(still + 1e-3 * step)
    late = (5.0 - 1e3 * sharp.seen()[:, 0]).round().to(torch.long)
    assert sorted(set(late.tolist())) == [1, 2]
    own = TurningConfig(camera_noise=(1e-3, 1e-3))
    noisy = SimulatedCamera(own, WORLDS, WorldDraws(WORLDS), 0.025)
    noisy.begin(everywhere)
    seen = noisy.seen()
    assert float(seen[:, :3].std()) == pytest.approx(1e-3, rel=0.1)  # 600 numbers: 3 % is usual
    assert float(seen[:, 3].std()) == pytest.approx(0.04, rel=0.15)  # 200 marks on a ball of 50 mm


def test_the_hand_looks_up_and_its_ball_touches_the_cup() -> None:
    """Gravity presses the ball of 50 mm into beads that are smoother than the ball."""
    hand = load_mechanism("hand_ball")
    assert hand.gravity == pytest.approx([0.0, 0.0, 9.81])
    ball, *beads = hand.obstacles
    assert isinstance(ball, Sphere)
    assert (ball.radius, ball.mass, ball.friction) == pytest.approx((0.025, 0.05, 0.8))
    assert len(beads) == 4
    for bead in beads:
        assert isinstance(bead, Sphere)
        assert (bead.mass, bead.friction) == (None, pytest.approx(0.1))
        gap = np.linalg.norm(bead.position - ball.position) - bead.radius - ball.radius
        assert gap == pytest.approx(0.0, abs=5e-5)  # the file's numbers end at 0.1 mm


def test_a_task_brings_its_hand() -> None:
    """The finger stays the tip's, and another hand may be named."""
    assert EnvironmentConfig().finger == "finger"
    assert EnvironmentConfig(task="turn").finger == "hand_ball"
    assert EnvironmentConfig(task="turn", finger="mine.usda").finger == "mine.usda"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"drop_distance": 0.0}, "drop_distance must be positive"),
        ({"place_weight": -1.0}, "place_weight must not be negative"),
        ({"turn_rates": (2.0, 1.0)}, "turn_rates must be a least and a greatest"),
        ({"size_spread": 0.5}, "size_spread must be at most"),
    ],
)
def test_wrong_settings_of_the_task_are_named(changes: dict[str, Any], said: str) -> None:
    """In words."""
    with pytest.raises(InvalidParameter, match=said):
        TurningConfig(**changes)
