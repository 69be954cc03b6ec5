"""Thousands of fingers as an environment of rsl-rl."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
import warp as wp
from rsl_rl.env import VecEnv
from tensordict import TensorDict
from torch import Tensor

from tendon_newton.data.cards.policy_observation import COMMAND_SPEED, applied_action, motor_command
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import HIDDEN, OBSERVED
from tendon_train.policy.worlds.force_model import open_force_model
from tendon_train.policy.worlds.goal_path import GoalPath, of_each_servo
from tendon_train.policy.worlds.observation_tensors import ObservationTensors
from tendon_train.policy.worlds.randomisation import Randomiser, effects_of, ranges_of
from tendon_train.policy.worlds.task import Task
from tendon_train.policy.worlds.tip_goal import TipGoal
from tendon_train.policy.worlds.turning import Turning, refuse_long_steps
from tendon_train.policy.worlds.world_draws import WorldDraws

PHASES = 4
"""Groups of worlds whose episodes end at different times, so that no iteration sees starts alone.
Resets cost the more the more groups there are."""
KEPT_DIVERGENCES = 1000


@dataclass(frozen=True, kw_only=True)
class Divergence:
    """A world that left every physical range and began anew."""

    world: int
    step: int  # Steps of the environment before it
    goal: float  # Goal of the world: an angle [rad] or a rate [rad/s]
    action: tuple[float, ...]  # Action of the policy for each servo [rad]; may be no number

    def __str__(self) -> str:
        """Say it in words."""
        action = ", ".join(f"{each:.3f}" for each in self.action)
        return (
            f"world {self.world} diverged in step {self.step}, with goal {self.goal:.3f} and "
            f"action {action} rad; it began anew"
        )


class FingerEnvironment(VecEnv):
    """W fingers, or hands, that are paid for what their task is: tips at goals, balls that turn.

    Everything is a torch tensor on one device; a step brings one flag to the host, whether any
    world begins anew. The tensors that a step returns are fresh. `torch.manual_seed` does not
    matter here: all draws come from `seed`, and each world has its own.

    Args:
        simulator: Worlds of another program in place of ours, with `reset`, `step` and `reading` of
            a `ControlLoop`. Nothing is randomised in them.

    Raises:
        InvalidParameter: Something shall differ between the worlds of another program, or the
            finger cannot do what is asked.
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
        self.mechanism = load_mechanism(config.finger)
        self.num_envs, self.num_actions = config.worlds, len(self.mechanism.tendons)
        self.force = open_force_model(config.force, self.mechanism)
        path = GoalPath(self.mechanism, self.device) if config.task == "tip" else None
        if path is None:
            refuse_long_steps(config.max_step, self.force.model)
        else:
            path.require(config.goals)
        ranges = ranges_of(config, self.force.model)
        drawn = ranges or config.task != "tip"
        if simulator is not None and drawn:
            raise InvalidParameter(
                "another simulator's worlds are all alike: randomise must be none; it is "
                f"{', '.join(config.randomise)}. The task must be tip; it is {config.task}"
            )
        self.loop: ControlLoop = simulator or self._own_loop(effects_of(ranges))
        self._draws = WorldDraws(config.worlds, self.device)
        self.randomiser = Randomiser(
            self.loop, ranges, joint_friction=config.joint_friction, draws=self._draws
        )
        self.task: Task = (
            TipGoal(config, self.loop, path, self._draws)
            if path is not None
            else Turning(config, self.loop, self.mechanism, self._draws)
        )
        """What the fingers are for."""
        # Least and greatest command of each servo [rad]
        self.command_ranges = of_each_servo(self.mechanism, config.command_range, self.spool_radius)
        self.pay_outs = (
            of_each_servo(self.mechanism, config.pay_out, self.spool_radius)
            if config.pays_out
            else (None,) * self.num_actions
        )
        """Pay-out rule of each servo [rad], where the config asks for it."""
        self._ends = self._columns(self.command_ranges)
        self._pay_out = self._columns(self.pay_outs) if config.pays_out else None
        self._least_at_rest = self._ends[0] if self._pay_out is None else self._pay_out[0]
        self._greatest_at_rest = self._ends[1].clamp(max=self.task.greatest_start)
        self.history = ObservationTensors(
            config.worlds, config.history, self.device, self.num_actions, config.task
        )
        self._command = self.loop.reading.motor_position.clone()
        """Last commands [rad], shape (W, D); of a new episode, where the motors stand."""
        self.episode_length_buf = torch.zeros(config.worlds, dtype=torch.long, device=self.device)
        self.steps = 0  # Steps since the environment was made
        # The last worlds that diverged
        self.divergences: deque[Divergence] = deque(maxlen=KEPT_DIVERGENCES)
        self.divergence_count = 0
        self.reset(seed=seed)

    @property
    def goal(self) -> Tensor:
        """Goals of the task, shape (W,)."""
        return self.task.goal

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
        """Return what the policies see, shape (W, history * (4 D + 1 + N)), named ``policy``.

        What only their critic sees, where a task has something, is named ``hidden``.
        """
        seen, hidden = {OBSERVED: self.history.flat()}, self.task.hidden()
        if hidden is not None:
            seen[HIDDEN] = hidden
        return TensorDict(seen, batch_size=[self.num_envs])

    def step(self, actions: Tensor) -> tuple[TensorDict, Tensor, Tensor, dict[str, Any]]:
        """Let all policies act for one step.

        A world that diverges begins anew, and counts as one whose time is over, so that a policy
        neither seeks nor fears it; `divergences` names it.

        Args:
            actions: Offsets of the commands from the motors, in `action_unit`, shape (W, D).

        Returns:
            Observations, rewards (W,), whether an episode ended (W,), and for rsl-rl ``time_outs``
            and what is to be logged.

        Raises:
            SimulationDiverged: More than half of all worlds diverged at once.
        """
        asked = actions.detach().to(self.device, torch.float32)
        asked = self.config.action_unit * asked.reshape(self.num_envs, self.num_actions)
        change = self._apply(asked)
        self.steps += 1
        self.episode_length_buf += 1
        reading = self.loop.reading
        outcome = self.task.score()
        reward = outcome.reward - self.config.smooth_weight * change.abs().sum(dim=-1)
        diverged = reading.diverged.clone()
        late = self.episode_length_buf >= self.max_episode_length
        dones = time_outs = diverged | late
        if outcome.failed is not None:
            dones, time_outs = dones | outcome.failed, time_outs & ~outcome.failed
        log = {
            **outcome.log,
            "/action_change_rad": change.abs().mean(),
            "/diverged_worlds": diverged.sum().float(),
        }
        self.task.renew(dones)
        if bool(dones.any()):
            self._note_divergences(diverged, asked)
            self._begin(dones)
        self._observe()
        extras = {"time_outs": time_outs.float(), "log": log}
        return self.get_observations(), reward, dones, extras

    def _apply(self, asked: Tensor) -> Tensor:
        """Hold the commands of what policies ask for, (W, D), and return how actions change."""
        action = applied_action(asked, self.config.action_clip)
        position = self.loop.reading.motor_position
        command = motor_command(position, action, self._ends, self._pay_out)
        reach = COMMAND_SPEED / self.config.rate
        self._command = command.clip(self._command - reach, self._command + reach)
        self.loop.step(self._command)
        before = self.history.action.clone()
        self.history.act(torch.where(torch.isfinite(action), action, 0.0))
        return self.history.action - before

    def _begin(self, worlds: Tensor) -> None:
        """Begin episodes: new numbers, at rest under a command, the smaller the likelier."""
        self.randomiser.draw(worlds)
        placed = self.task.place(worlds)
        share = self._draws.uniform(self.num_actions, worlds=worlds).square()
        least, greatest = self._least_at_rest, self._greatest_at_rest
        self.loop.reset(least + (greatest - least) * share, worlds, **placed)
        standing = self.loop.reading.motor_position
        self._command = torch.where(worlds[:, None], standing, self._command)
        self.history.reset(worlds)
        self.task.begin(worlds)
        self.episode_length_buf.masked_fill_(worlds, 0)

    def _own_loop(self, effects: tuple[str, ...]) -> ControlLoop:
        """Return our own worlds, in which these effects may differ."""
        config = self.config
        return ControlLoop(
            self.mechanism,
            self.force.model,
            config.worlds,
            rate=config.rate,
            max_step=config.max_step,
            precision=config.precision,
            effects=effects,
            device=str(wp.device_from_torch(self.device)),
        )

    def _columns(self, angles: Sequence[Any]) -> tuple[Tensor, Tensor]:
        """Return two angles [rad] of each servo as two tensors, shape (D,)."""
        first, second = torch.tensor(angles, dtype=torch.float32, device=self.device).unbind(dim=1)
        return first, second

    def _observe(self) -> None:
        """Let the policies see what the sensors report."""
        position, velocity = self.loop.reading.motor_position, self.loop.reading.motor_velocity
        self.history.observe(position, velocity, self.goal, *self.task.seen())

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
