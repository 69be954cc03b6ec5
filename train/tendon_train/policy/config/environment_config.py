"""Settings of the environment in which a policy learns."""

from dataclasses import dataclass, field
from math import pi
from typing import Literal

from tendon_newton.data.cards.policy_observation import HISTORY, RATE, Task
from tendon_newton.errors import require
from tendon_train.policy.config.turning_config import TurningConfig

FINGERS: dict[Task, str] = {"tip": "finger", "turn": "hand_ball"}  # Default finger of each task.
POSITIVE = ("worlds", "history", "rate", "episode", "action_clip", "action_unit", "max_step")
NOT_NEGATIVE = ("joint_friction", "goal_weight", "smooth_weight")
ANGLES = ("goals", "command_range", "pay_out")


@dataclass(frozen=True, kw_only=True)
class EnvironmentConfig:
    """A finger, what pulls it, what differs between its worlds, and what it is paid for."""

    worlds: int = 4096  # Fingers that learn side by side.
    task: Task = "tip"
    """What is learned: to bring a finger's tip to goals, or to turn a ball in a hand's palm."""
    finger: str = FINGERS["tip"]
    """Finger with a tip and tendons that close it: a name under assets/, or a USD file. A hand that
    turns a ball has a ball with a mass; by default hand_ball."""
    force: str = "ideal"
    """Force model of the servo: ideal, a model file (.toml), a known servo (its name), or a force
    network (.safetensors)."""
    servo: str | None = None
    """Kind of the servo, which a deployment must name; by default a known servo's own, else that of
    the asset."""
    randomise: tuple[str, ...] = ("joint_friction", "link_mass", "spool_radius", "joint_spring")
    """Numbers that differ between worlds and are drawn anew for each episode. Names are those of
    the default, or effects, whose numbers are drawn about the model's own (gain_error: the force
    times a factor about 1); none draws nothing."""
    spread: float = 0.3
    """Most that a randomised number differs from its nominal value, as a share of it."""
    joint_friction: float = 0.1
    """Dry friction about which joint_friction is drawn, as a share of the torque of a joint's
    spring at the end of its range; a model's own joint_dry_friction counts instead."""
    rate: float = RATE  # Policy steps per second [Hz].
    history: int = HISTORY  # Samples that the policy sees.
    episode: float = 20.0  # Length of an episode [s].
    goals: tuple[float, float] = (0.0, 0.6 * pi)  # Least and greatest goal angle [rad].
    goal_change: float = 0.005  # Chance that a step ends with a new goal [1].
    command_range: tuple[float, float] = (-1.2, 2.0 * pi)
    """Least and greatest command of a servo that closes [rad]; of one that opens, counted from its
    angle in the closed finger. The range begins below zero, so that the servo pays the tendon out
    to its end, and at some speed. A gear does not move within 0.3 rad of a command, a worn one
    within 0.8."""
    pay_out: tuple[float, float] = (0.0, 0.05)
    """The pay-out rule [rad]: commands go below the first angle only while the motor stands beyond
    the second. So the motor stops at home and the tendon does not hang loose. A command range that
    begins higher has no rule."""
    action_clip: float = 3.0
    """Greatest offset of the command from the motor [rad]: at 4.2 N/rad the finger needs 2.5 rad to
    hold the greatest goal with springs that are 30 % too stiff."""
    action_unit: float = 1.0
    """Offset that an output of 1 of the network asks for [rad]. An update moves outputs as far
    whatever they mean, so that a task of large offsets is learned sooner with a large unit."""
    goal_weight: float = 5.0  # Price of the distance between tip and goal [1/m].
    smooth_weight: float = 0.001  # Price of the change of the action [1/rad].
    max_step: float = 5.0e-4  # Longest step of the simulation [s].
    precision: Literal["float32", "float64"] = "float32"  # Numbers inside the simulation.
    turning: TurningConfig = field(default_factory=TurningConfig)
    """Settings of the task to turn a ball."""

    def __post_init__(self) -> None:
        if self.finger == FINGERS["tip"]:  # this finger turns nothing
            object.__setattr__(self, "finger", FINGERS[self.task])
        require(self, "be positive", lambda x: x > 0, POSITIVE)
        require(self, "not be negative", lambda x: x >= 0.0, NOT_NEGATIVE)
        require(self, "be between 0 and 0.9", lambda x: 0.0 <= x <= 0.9, ["spread"])
        require(self, "be between 0 and 1", lambda x: 0.0 <= x <= 1.0, ["goal_change"])
        angles = "be a least and a greatest angle [rad]"
        require(self, angles, lambda x: -1000.0 <= x[0] < x[1] <= 1000.0, ANGLES)

    @property
    def pays_out(self) -> bool:
        """Whether the command range begins lower for a motor that is wound in."""
        return self.command_range[0] < self.pay_out[0]

    @property
    def episode_steps(self) -> int:
        """Steps in an episode."""
        return max(1, round(self.episode * self.rate))
