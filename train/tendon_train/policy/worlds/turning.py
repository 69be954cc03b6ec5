r"""The task of a hand that turns a ball in its palm about an axis.

.. math:: r = w_r (\Omega - \lvert \max(\Omega + b / T, 0) - \bar\omega \rvert)
    - w_p d - p\,[d > d_{drop}]

with the commanded rate :math:`\Omega`, the mean rate :math:`\bar\omega` over the last second or so,
the turn :math:`b` by which the ball is seen behind, which is to be made up for in the time
:math:`T`, and the distance :math:`d` of the ball's middle from where it starts.
"""

from math import exp

import numpy as np
import torch
from torch import Tensor

from tendon_newton.data.cards.policy_observation import behind_now
from tendon_newton.data.cards.turning_task import TurningTask, half_turn
from tendon_newton.data.model_file import Model
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.turning_config import TurningConfig
from tendon_train.policy.worlds.task import TaskOutcome
from tendon_train.policy.worlds.world_draws import WorldDraws

AXIS = (0.0, 1.0, 0.0)  # Across the palm in the base frame; closing fingers turn the ball about it
LONGEST_STEP = 1.0e-3
"""Longest step with strings that stretch [s]: at 2.5 ms balls turn up to seven times as far."""
LIFT = 1.5
"""By how much more than its radius a greater ball stands higher in its cup [1]: it rests on beads
that stand beside its middle."""


def body_of(mechanism: Mechanism) -> int:
    """Return the number of what is free to move among the obstacles, a ball or a block.

    Raises:
        InvalidParameter: There is none.
    """
    for number, obstacle in enumerate(mechanism.obstacles):
        if obstacle.mass is not None:
            return number
    raise InvalidParameter(
        f"a hand turns a ball or a block that is free to move; {mechanism.name!r} has none: name a "
        "hand with an obstacle that has a mass, such as hand_ball"
    )


def refuse_long_steps(max_step: float, model: Model) -> None:
    """Refuse steps of a simulation [s] in which strings that stretch turn a ball of themselves.

    Raises:
        InvalidParameter: The model's strings stretch, and steps are longer than is right.
    """
    stretches = any(effect.name == "tendon_compliance" for effect in model.effects)
    if stretches and max_step > LONGEST_STEP:
        raise InvalidParameter(
            f"max_step must be {LONGEST_STEP:g} s at most where strings stretch, else balls turn "
            f"several times as far as they would; it is {max_step:g}"
        )


class Turning:
    """Balls that differ, commanded rates, and what a hand is paid for.

    Raises:
        InvalidParameter: The mechanism has nothing that is free to move.
    """

    def __init__(
        self, config: EnvironmentConfig, loop: ControlLoop, mechanism: Mechanism, draws: WorldDraws
    ) -> None:
        own, worlds, device = config.turning, config.worlds, draws.device
        self._config, self._loop, self._draws = config, loop, draws
        body = body_of(mechanism)
        self.greatest_start = own.start_command
        self.card = TurningTask(asset=mechanism.name, axis=AXIS, drop_distance=own.drop_distance)
        self.goal = torch.zeros(worlds, device=device)  # Commanded rates [rad/s], shape (W,)
        # Mean rates of the balls [rad/s], shape (W,)
        self.rate = torch.zeros(worlds, device=device)
        # Turns of the balls since their start, those seen last, and what they are behind [rad]
        self._turn = torch.zeros(worlds, device=device)
        self._turned = torch.zeros(worlds, device=device)
        self._behind = torch.zeros(worlds, device=device)
        self._axis = torch.tensor(AXIS, device=device)
        self._kept = exp(-1.0 / (own.rate_window * config.rate))
        self._mass = loop.bench_numbers("body_mass")
        self._inertia = loop.bench_numbers("body_inertia")
        self._size = loop.bench_numbers("obstacle_size")[:, body]
        self._friction = loop.bench_numbers("obstacle_friction")[:, body]
        self._nominal = mechanism.obstacles[body]
        self._camera = SimulatedCamera(own, worlds, draws, float(self._nominal.size[0]))
        down = mechanism.gravity / np.linalg.norm(mechanism.gravity)
        self._up = torch.tensor(-down, dtype=torch.float32, device=device)
        self._start = loop.body_pose.clone()  # Where the balls start, shape (W, 7)
        self._home = self._start.clone()
        self._orientation = self._start[:, 3:].clone()
        self.judged_pose = self._start.clone()
        # Where balls were when the last step was judged, from where they started, (W, 7)
        self.judged_pose[:, :3] = 0.0
        self.judged_tension = loop.reading.force.clone()  # Tensions then [N], shape (W, D)

    def place(self, worlds: Tensor) -> dict[str, Tensor]:
        """Draw mass, friction and size of balls, and put them into their cups."""
        mass, friction, size = self._draws.uniform(3, worlds=worlds).unbind(dim=1)
        nominal, spread = self._nominal, self._config.spread
        assert nominal.mass is not None
        size = 1.0 + self._config.turning.size_spread * (2.0 * size - 1.0)
        heavier = 1.0 + spread * (2.0 * mass - 1.0)
        rubbing = 1.0 + spread * (2.0 * friction - 1.0)
        extent, inertia = (size.new_tensor(each) for each in (nominal.size, nominal.inertia))
        lift = LIFT * float(nominal.size[0])
        for target, values in (
            (self._mass, nominal.mass * heavier),
            (self._inertia, inertia * heavier[:, None] * size.square()[:, None]),
            (self._friction, nominal.friction * rubbing),
            (self._size, extent * size[:, None]),
        ):
            chosen = worlds.reshape(-1, *[1] * (target.ndim - 1))
            target.copy_(torch.where(chosen, values.to(target.dtype), target))
        place = self._home.clone()
        place[:, :3] += lift * (size - 1.0)[:, None] * self._up
        self._start.copy_(torch.where(worlds[:, None], place, self._start))
        return {"body_pose": self._start}

    def begin(self, worlds: Tensor) -> None:
        """Draw rates and cameras; nothing turns yet."""
        low, high = self._config.turning.turn_rates
        goals = low + (high - low) * self._draws.uniform(worlds=worlds)
        self.goal.copy_(torch.where(worlds, goals, self.goal))
        for values in (self.rate, self._turn, self._turned, self._behind):
            values.masked_fill_(worlds, 0.0)
        fresh = torch.where(worlds[:, None], self._start[:, 3:], self._orientation)
        self._orientation.copy_(fresh)
        self._camera.begin(worlds)

    def score(self) -> TaskOutcome:
        """Pay for the mean rate, and price what the ball's place costs."""
        own, config = self._config.turning, self._config
        pose = self._loop.body_pose
        sine, cosine = half_turn(self._orientation, pose[:, 3:], self._axis)
        turn = 2.0 * torch.atan2(sine, cosine)
        self._turn += turn
        rate = config.rate * turn
        self.rate.mul_(self._kept).add_((1.0 - self._kept) * rate)
        self._orientation.copy_(pose[:, 3:])
        place = pose[:, :3] - self._start[:, :3]
        self.judged_pose.copy_(torch.cat([place, pose[:, 3:]], dim=-1))
        self.judged_tension.copy_(self._loop.reading.force)
        self._camera.take(torch.cat([place, self._turn[:, None]], dim=-1))
        away = torch.linalg.vector_norm(place, dim=-1)
        dropped = away > own.drop_distance
        wanted = (self.goal + self._behind / own.catch_up_time).clamp(min=0.0)
        price = own.rate_weight * ((wanted - self.rate).abs() - self.goal)
        price = price + own.place_weight * away.clamp(max=own.drop_distance)
        price = price + own.drop_price * dropped
        log = {
            "/turning_rate_rad_s": rate.mean(),
            "/displacement_m": away.mean(),
            "/drops_per_minute": dropped.float().mean() * (60.0 * config.rate),
        }
        return TaskOutcome(reward=-price, failed=dropped, log=log)

    def renew(self, ended: Tensor) -> None:
        """Leave the rate as it is: an episode has one."""

    def seen(self) -> tuple[Tensor, ...]:
        """Return how far the balls are behind [rad], and where a camera sees them [m], (W, 4)."""
        seen = self._camera.seen()
        moved = seen[:, 3] - self._turned
        self._turned.copy_(seen[:, 3])
        self._behind.copy_(behind_now(self._behind, self.goal / self._config.rate, moved))
        return (torch.cat([self._behind[:, None], seen[:, :3]], dim=-1),)

    def hidden(self) -> Tensor | None:
        """Return place [m], velocities, mean rate and what is drawn of the balls, (W, 13)."""
        drawn = (self._mass[:, None], self._friction[:, None], self._size[:, :1])
        place = self._loop.body_pose[:, :3] - self._start[:, :3]
        parts = (place, self._loop.body_velocity, self.rate[:, None], *drawn)
        return torch.cat([part.float() for part in parts], dim=-1)


class SimulatedCamera:
    """What W cameras give at each policy step; noise and delay differ by world and episode.

    A camera tells the turn from marks on the ball, which it sees as well as the ball's middle.

    Args:
        radius: Radius of the balls [m].
    """

    def __init__(
        self, config: TurningConfig, worlds: int, draws: WorldDraws, radius: float
    ) -> None:
        self._config, self._draws = config, draws
        kept = 1 + config.camera_delay[1]
        # Latest places [m] and turns [rad], the newest first
        self._places = torch.zeros(worlds, kept, 4, device=draws.device)
        self._arms = torch.tensor([1.0, 1.0, 1.0, 1.0 / radius], device=draws.device)
        self._delay = torch.zeros(worlds, dtype=torch.long, device=draws.device)
        self._noise = torch.zeros(worlds, device=draws.device)

    def begin(self, worlds: Tensor) -> None:
        """Draw noise and delay in some worlds, a mask, whose balls have lain still."""
        share, step = self._draws.uniform(2, worlds=worlds).unbind(dim=1)
        (low, high), (least, most) = self._config.camera_noise, self._config.camera_delay
        noise, delay = low + (high - low) * share, least + (step * (1 + most - least)).long()
        self._noise.copy_(torch.where(worlds, noise, self._noise))
        self._delay.copy_(torch.where(worlds, delay, self._delay))
        self._places.masked_fill_(worlds[:, None, None], 0.0)

    def take(self, place: Tensor) -> None:
        """Note where balls are now [m], and their turns [rad], shape (W, 4)."""
        self._places.copy_(torch.cat([place[:, None], self._places[:, :-1]], dim=1))

    def seen(self) -> Tensor:
        """Return what the cameras give [m, rad], shape (W, 4)."""
        late = self._delay[:, None, None].expand(-1, 1, 4)
        noise = self._noise[:, None] * self._arms * self._draws.normal(4)
        return self._places.gather(1, late).squeeze(1) + noise
