"""Thousands of fingers as an environment of rsl-rl."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
import warp as wp
from rsl_rl.env import VecEnv
from tensordict import TensorDict
from torch import Tensor

from tendon_newton.data.cards.policy_observation import applied_action, motor_command
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from train.policy.config.environment_config import EnvironmentConfig
from train.policy.config.training_config import OBSERVED
from train.policy.worlds.force_model import open_force_model
from train.policy.worlds.goal_path import GoalPath
from train.policy.worlds.observation_tensors import ObservationTensors
from train.policy.worlds.obstacle import ObstaclePlacer, with_obstacle
from train.policy.worlds.randomisation import Randomiser, further_effects, ranges_of
from train.policy.worlds.reward import step_reward
from train.policy.worlds.world_draws import WorldDraws

PHASES = 4
"""Groups of worlds whose episodes end at different times, so that no iteration sees starts alone.
Resets cost the more the more groups there are."""
KEPT_DIVERGENCES = 1000


@dataclass(frozen=True, kw_only=True)
class Divergence:
    """A world that left every physical range and began anew."""

    world: int
    step: int
    """Steps of the environment before it."""
    goal: float
    """Goal angle of the world [rad]."""
    action: tuple[float, ...]
    """Action of the policy for each servo [rad]; may be no number."""

    def __str__(self) -> str:
        """Say it in words."""
        action = ", ".join(f"{each:.3f}" for each in self.action)
        return (
            f"world {self.world} diverged in step {self.step}, with goal {self.goal:.3f} rad and "
            f"action {action} rad; it began anew"
        )


class FingerEnvironment(VecEnv):
    """W fingers that are paid for keeping their tips at moving goals.

    Everything is a torch tensor on one device; a step brings one flag to the host, whether any
    world begins anew. The tensors that a step returns are fresh. `torch.manual_seed` does not
    matter here: all draws come from `seed`, and each world has its own.

    Args:
        config: Finger, force model, goals and rewards.
        seed: Seed of all draws.
        device: Torch device.
        simulator: Worlds of another program in place of ours, with `reset`, `step` and `reading` of
            a `ControlLoop`. Nothing is randomised in them.

    Raises:
        InvalidParameter: Something shall differ between the worlds of another program.
    """

    def __init__(
        self,
        config: EnvironmentConfig,
        *,
        seed: int = 0,
        device: torch.device | str = "cpu",
        simulator: Any = None,
    ) -> None:
        self.config = self.cfg = config
        self.device = torch.device(device)
        if self.device.type == "cuda" and self.device.index is None:  # Warp wants the number
            self.device = torch.device("cuda", torch.cuda.current_device())
        self.max_episode_length = config.episode_steps
        self.mechanism = with_obstacle(load_mechanism(config.finger), config.obstacle)
        self.num_envs, self.num_actions = config.worlds, len(self.mechanism.tendons)
        self.path = GoalPath(self.mechanism, self.device)
        self.path.require(config.goals)
        self.force = open_force_model(config.force, self.mechanism)
        ranges = ranges_of(config, self.force.model)
        if simulator is not None and (ranges or config.obstacle != "none"):
            raise InvalidParameter(
                "another simulator's worlds are all alike: randomise must be none, and so must "
                f"obstacle; they are {', '.join(config.randomise)} and {config.obstacle}"
            )
        self.loop: ControlLoop = simulator or ControlLoop(
            self.mechanism,
            self.force.model,
            config.worlds,
            rate=config.rate,
            max_step=config.max_step,
            precision=config.precision,
            effects=further_effects(ranges),
            network="fused",
            device=str(wp.device_from_torch(self.device)),
        )
        self._draws = WorldDraws(config.worlds, self.device)
        self.randomiser = Randomiser(
            self.loop, ranges, joint_friction=config.joint_friction, draws=self._draws
        )
        self.obstacle: ObstaclePlacer | None = None
        """Placer of the obstacles, where the config asks for some."""
        if config.obstacle != "none":
            self.obstacle = ObstaclePlacer(
                self.loop,
                config.obstacle,
                self.path,
                goals=config.goals,
                chance=config.obstacle_chance,
                spread=config.spread,
                draws=self._draws,
            )
        self.command_ranges = self.path.of_each_servo(config.command_range, self.spool_radius)
        """Least and greatest command of each servo [rad]."""
        self.pay_outs = (
            self.path.of_each_servo(config.pay_out, self.spool_radius)
            if config.pays_out
            else (None,) * self.num_actions
        )
        """Pay-out rule of each servo [rad], where the config asks for it."""
        self._ends = self._columns(self.command_ranges)
        self._pay_out = self._columns(self.pay_outs) if config.pays_out else None
        self._least_at_rest = self._ends[0] if self._pay_out is None else self._pay_out[0]
        self.history = ObservationTensors(
            config.worlds, config.history, self.device, self.num_actions
        )
        self.goal = torch.zeros(config.worlds, device=self.device)
        """Goal angles [rad], shape (W,)."""
        self.episode_length_buf = torch.zeros(config.worlds, dtype=torch.long, device=self.device)
        self.steps = 0
        """Steps since the environment was made."""
        self.divergences: deque[Divergence] = deque(maxlen=KEPT_DIVERGENCES)
        """The last worlds that diverged."""
        self.divergence_count = 0
        self.reset(seed=seed)

    @property
    def spool_radius(self) -> float:
        """Nominal radius of the spools [m]."""
        own = self.force.model.actuator.values.get("spool_radius")
        return self.mechanism.tendons[0].spool_radius if own is None else float(own)

    def reset(self, *, seed: int | None = None) -> TensorDict:
        """Begin anew in all worlds, at various ages of their episodes.

        Args:
            seed: Seed of all draws from now on; the draws go on without one.
        """
        if seed is not None:
            self._draws.manual_seed(seed)
        everywhere = torch.ones(self.num_envs, dtype=torch.bool, device=self.device)
        self._begin(everywhere)
        places = torch.arange(self.num_envs, device=self.device)
        self.episode_length_buf.copy_(places % PHASES * self.max_episode_length // PHASES)
        self._observe()
        return self.get_observations()

    def get_observations(self) -> TensorDict:
        """Return what the policies see, shape (W, history * (4 D + 1)), named ``policy``."""
        return TensorDict({OBSERVED: self.history.flat()}, batch_size=[self.num_envs])

    def step(self, actions: Tensor) -> tuple[TensorDict, Tensor, Tensor, dict[str, Any]]:
        """Let all policies act for one step.

        A world that diverges begins anew, and counts as one whose time is over, so that a policy
        neither seeks nor fears it; `divergences` names it.

        Args:
            actions: Offsets of the commands from the motors [rad], shape (W, D).

        Returns:
            Observations, rewards (W,), whether an episode ended (W,), and for rsl-rl ``time_outs``
            and what is to be logged.

        Raises:
            SimulationDiverged: More than half of all worlds diverged at once.
        """
        asked = actions.detach().to(self.device, torch.float32)
        asked = asked.reshape(self.num_envs, self.num_actions)
        change = self._apply(asked)
        self.steps += 1
        self.episode_length_buf += 1
        reading, tip_error = self.loop.reading, self.tip_error()
        rewards = step_reward(
            self.config,
            tip_error=tip_error,
            action=self.history.action,
            action_change=change,
            tendon_speed=self.spool_radius * reading.motor_velocity,
        )
        diverged = reading.diverged.clone()
        dones = diverged | (self.episode_length_buf >= self.max_episode_length)
        log = {
            "/tip_error_m": tip_error.mean(),
            "/action_change_rad": change.abs().mean(),
            "/diverged_worlds": diverged.sum().float(),
        }
        self._renew_goals(dones)
        if bool(dones.any()):
            self._note_divergences(diverged, asked)
            self._begin(dones)
        self._observe()
        return self.get_observations(), rewards, dones, {"time_outs": dones.float(), "log": log}

    def _apply(self, asked: Tensor) -> Tensor:
        """Hold the commands of what policies ask for, (W, D), and return how actions change."""
        action = applied_action(asked, self.config.action_clip)
        position = self.loop.reading.motor_position
        self.loop.step(motor_command(position, action, self._ends, self._pay_out))
        before = self.history.action.clone()
        self.history.act(torch.where(torch.isfinite(action), action, 0.0))
        return self.history.action - before

    def tip_error(self) -> Tensor:
        """Return the distances between tips and goal points [m], shape (W,)."""
        tip = self.loop.reading.tip
        assert tip is not None
        return torch.linalg.vector_norm(self.path.points(self.goal) - tip, dim=-1)

    def _begin(self, worlds: Tensor) -> None:
        """Begin episodes: new numbers, at rest under a command, the smaller the likelier."""
        self.randomiser.draw(worlds)
        if self.obstacle is not None:
            self.obstacle.draw(worlds)
        share = self._draws.uniform(self.num_actions, worlds=worlds).square()
        least, greatest = self._least_at_rest, self._ends[1]
        self.loop.reset(least + (greatest - least) * share, worlds)
        self.history.reset(worlds)
        goals = self._goals_at(self._draws.uniform(worlds=worlds))
        self.goal.copy_(torch.where(worlds, goals, self.goal))
        self.episode_length_buf.masked_fill_(worlds, 0)

    def _renew_goals(self, dones: Tensor) -> None:
        """Give some of the worlds that go on a new goal."""
        chance, share = self._draws.uniform(2).unbind(dim=1)
        renewed = (chance < self.config.goal_change) & ~dones
        self.goal.copy_(torch.where(renewed, self._goals_at(share), self.goal))

    def _goals_at(self, share: Tensor) -> Tensor:
        """Return the goals [rad] at some shares of their range."""
        low, high = self.config.goals
        return low + (high - low) * share

    def _columns(self, angles: Sequence[Any]) -> tuple[Tensor, Tensor]:
        """Return two angles [rad] of each servo as two tensors, shape (D,)."""
        first, second = torch.tensor(angles, dtype=torch.float32, device=self.device).unbind(dim=1)
        return first, second

    def _observe(self) -> None:
        """Let the policies see what the sensors report."""
        reading = self.loop.reading
        self.history.observe(reading.motor_position, reading.motor_velocity, self.goal)

    def _note_divergences(self, diverged: Tensor, asked: Tensor) -> None:
        """Name the worlds that diverged, and stop where it is not a few."""
        worlds = torch.nonzero(diverged).ravel().tolist()
        self.divergence_count += len(worlds)
        for world in worlds[-KEPT_DIVERGENCES:]:
            fault = Divergence(
                world=world,
                step=self.steps,
                goal=float(self.goal[world]),
                action=tuple(asked[world].tolist()),
            )
            self.divergences.append(fault)
        if 2 * len(worlds) > self.num_envs > 1:
            raise SimulationDiverged(
                f"a step must leave most worlds finite; {len(worlds)} of {self.num_envs} were not: "
                f"{self.divergences[-1]}"
            )
