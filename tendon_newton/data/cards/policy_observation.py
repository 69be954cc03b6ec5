r"""What a policy sees and does: the one definition, for training and for deployment.

A sample holds, in this order, the motor position and velocity, the action last applied, the one
before it, and the goal angle. With several servos each of the first four stands once per servo, in
the order of the asset's tendons: `(theta_0, theta_1, theta_dot_0, theta_dot_1, ..., alpha)`. An
observation is the latest samples, oldest first, one behind the other: `(sample 0, sample 1, ...)`.
A policy that turns a ball sees the commanded rate in place of the goal angle. Behind it stand how
far the ball is behind a turn at that rate, by :func:`behind_now`, and where a camera sees the
ball's middle, in the axes of the base and from where the ball was at first:
`(..., rate, behind, ball_x, ball_y, ball_z)`. Everything is float32 in SI units, and normalisation
is the policy's own business: it stands inside its file.

One policy step, at instant k with the motor at position :math:`\theta_k`:

1. The sample `(theta_k, theta_dot_k, a_k, a_{k-1}, alpha_k)` enters the history, where a_k is the
   action that was applied in the step that has just ended.
2. The policy gives a number. :func:`applied_action` cuts it to the card's clip, and so makes it
   a_{k+1}.
3. :func:`motor_command` gives the command until the next step,
   :math:`\theta_d = clip(\theta_k + a_{k+1})` to the command range. The cut of the command does
   not change the action that the policy sees. Where the card has a pay-out rule, the lower end of
   the range counts only while the tendon is wound in; else the command ends at home.
4. The command changes by `COMMAND_SPEED` at most; the first one, from where the motor stands.

A policy of several servos gives one number for each, and the same holds servo by servo.

Before the first step no action was applied: both are zero, and the first sample fills the history.
"""

from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tendon_newton.errors import InvalidParameter

SAMPLE: tuple[tuple[str, str], ...] = (
    ("theta", "rad"),
    ("theta_dot", "rad/s"),
    ("action", "rad"),
    ("previous_action", "rad"),
    ("alpha", "rad"),
)
"""Name and unit of each number of a sample of one servo, in their order."""
Task = Literal["tip", "turn"]
"""What a policy is for: its finger's tip goes to a goal, or its hand turns a ball."""
GOALS: dict[Task, tuple[tuple[str, str], ...]] = {
    "tip": SAMPLE[-1:],
    "turn": (
        ("rate", "rad/s"),
        ("behind", "rad"),
        ("ball_x", "m"),
        ("ball_y", "m"),
        ("ball_z", "m"),
    ),
}
"""Name and unit of what a sample holds behind the servos' numbers: a goal, then what is seen."""
HISTORY = 30  # Samples in an observation, as the paper has them
RATE = 20.0  # Policy steps per second [Hz]
SERVO_RATE = 80.0  # Readings of the servo per second [Hz]

COMMAND_SPEED = 80.0  # Greatest change of the command [rad/s]: four radians in a policy step
FARTHEST_BEHIND = 1.0
"""Turn by which a ball counts as behind or ahead at most [rad]: a hand that could not keep up for a
minute does not make up for it in the next."""
Values = TypeVar("Values", bound=Any)  # NumPy arrays and torch tensors alike


def sample_of(servos: int, task: Task = "tip") -> tuple[tuple[str, str], ...]:
    """Return name and unit of each number of a sample of some servos, in their order."""
    own = SAMPLE[:-1]
    if servos > 1:
        own = tuple((f"{name}_{d}", unit) for name, unit in own for d in range(servos))
    return (*own, *GOALS[task])


def applied_action(output: Values, clip: float) -> Values:
    """Return the action [rad] that a policy's output stands for.

    Args:
        output: Output of the policy [rad], any shape.
        clip: Greatest offset either way [rad].
    """
    return output.clip(-clip, clip)


def behind_now(behind: Values, asked: Values, turned: Values) -> Values:
    """Return how far a ball is behind a turn at the commanded rate [rad], ahead below zero.

    Args:
        behind: How far it was one policy step ago; zero at first [rad].
        asked: Turn that the commanded rate asks for in a policy step [rad].
        turned: Turn that the camera has seen since then [rad].
    """
    return (behind + asked - turned).clip(-FARTHEST_BEHIND, FARTHEST_BEHIND)


def motor_command(
    position: Values,
    action: Values,
    command_range: tuple[Any, Any],
    pay_out: tuple[Any, Any] | None = None,
) -> Values:
    """Return the desired motor angle [rad]: the action as an offset from where the motor is.

    A gear with friction pays a tendon out only for a command well below where the motor stands, the
    farther the faster. With a pay-out rule the range goes as far down as that takes, as long as
    there is tendon to pay out. At home the command ends at the rule's first angle, so that the
    motor does not run on into the slack.

    Args:
        position: Measured motor angle [rad].
        action: Applied action [rad], of the same shape.
        command_range: Least and greatest command [rad], or of each servo, shape (D,).
        pay_out: The pay-out rule: the least command of a motor at home, and the angle beyond which
            it is not at home [rad], or of each servo, shape (D,).
    """
    command = (position + action).clip(*command_range)
    if pay_out is None:
        return command
    home, wound_in = pay_out
    at_home = command.clip(home, command_range[1])
    return command * (position > wound_in) + at_home * (position <= wound_in)


def goal_angle(x: ArrayLike, z: ArrayLike) -> NDArray[np.float64]:
    """Return alpha = atan2(-z, x) [rad] of points seen from the PIP axis: 0 where it is straight.

    Args:
        x: Towards the tip of the straight finger [m].
        z: Against the direction in which it flexes [m].
    """
    return np.arctan2(np.negative(z), x)


class ObservationHistory:
    """The samples that W policies see, and the actions that they are made of.

    Numbers of each servo have the shape (W, D), or (W,) where there is one.

    Args:
        worlds: Number of policies W.
        servos: Number of servos D of each.
        task: What they are for; behind its goal stand N numbers that are seen.
    """

    def __init__(
        self, worlds: int = 1, history: int = HISTORY, servos: int = 1, task: Task = "tip"
    ) -> None:
        if worlds < 1 or history < 1 or servos < 1:
            raise InvalidParameter(
                f"worlds, history and servos must be 1 or more; they are {worlds}, {history} and "
                f"{servos}"
            )
        shape = (worlds, history, len(sample_of(servos, task)))
        self._samples = np.zeros(shape, dtype=np.float32)
        self._action = np.zeros((worlds, servos), dtype=np.float32)
        self._previous = np.zeros_like(self._action)
        self._fresh = np.ones(worlds, dtype=bool)

    @property
    def size(self) -> int:
        """Numbers in an observation."""
        return self._samples.shape[1] * self._samples.shape[2]

    def reset(self, chosen: NDArray[np.bool_] | None = None) -> None:
        """Forget what was seen and done, in the chosen worlds or in all."""
        chosen = np.ones_like(self._fresh) if chosen is None else np.asarray(chosen, dtype=bool)
        self._action[chosen] = 0.0
        self._previous[chosen] = 0.0
        self._fresh |= chosen

    def observe(
        self, position: ArrayLike, velocity: ArrayLike, goal: ArrayLike, seen: ArrayLike = ()
    ) -> NDArray[np.float32]:
        """Enter a sample and return the observations, a row per policy, as a new array.

        Args:
            position: Motor angles [rad].
            velocity: Motor speeds [rad/s].
            goal: Goals of the task, angles [rad] or rates [rad/s], shape (W,).
            seen: What a camera tells, shape (W, N), of a task that has it.
        """
        samples = self._samples
        samples[:, :-1] = samples[:, 1:]
        servos = self._action.shape[1]
        latest = (position, velocity, self._action, self._previous)
        for place, values in enumerate(latest):
            columns = slice(place * servos, (place + 1) * servos)
            samples[:, -1, columns] = self._per_servo(values)
        samples[:, -1, len(latest) * servos] = np.asarray(goal, dtype=np.float32)
        further = np.asarray(seen, dtype=np.float32)
        samples[:, -1, len(latest) * servos + 1 :] = further.reshape(len(samples), -1)
        samples[self._fresh] = samples[self._fresh, -1:]
        self._fresh[:] = False
        return samples.reshape(len(samples), -1).copy()

    def act(self, action: ArrayLike) -> None:
        """Note the actions [rad] that are applied from now on, already cut."""
        self._previous[:] = self._action
        self._action[:] = self._per_servo(action)

    def _per_servo(self, values: ArrayLike) -> NDArray[np.float32]:
        """Return numbers of each servo, shape (W, D)."""
        return np.asarray(values, dtype=np.float32).reshape(self._action.shape)
