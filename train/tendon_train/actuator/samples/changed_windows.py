"""Changes of the windows that a training draws, each time anew.

For predictions, motors that stick are asked for something else, and angles and commands get another
zero and other noise. In the first part of the training motion departs from its recording. For
simulations motion departs to the end.
"""

import torch
from torch import Tensor

from tendon_train.actuator.samples.sample_departure import departed, departing_share
from tendon_train.actuator.samples.servo_law import TAUT, ServoLaw
from tendon_train.actuator.samples.windows import REST_SPEED, WindowTensors
from tendon_train.actuator.training_config import TrainingConfig

SHARE = 0.5  # Share of the windows that end at rest which are asked for something else [1]
FEWEST = 3  # Samples of rest that a window needs
LATEST = 0.8  # Latest that a command begins to change, in parts of the rest [1]
SHORTEST, LONGEST = 0.05, 1.05
"""How long it takes, in parts of the rest [1]; each window has its own: steps and ramps."""


def held_fast(windows: Tensor, force: Tensor, law: ServoLaw, generator: torch.Generator) -> Tensor:
    r"""Return windows of which half of those at rest are asked for something else.

    Where a gear sticks, the tension is what it was when the shaft came to rest, whatever is asked
    within friction's band. Recordings show this for a few commands per stop; a network takes the
    command for the cause and lets the force go down with it. Half of the windows that end at rest
    therefore get another command from some instant of the rest on, for which the same force is as
    true.

    The lead :math:`\theta_d - \theta` goes to where it would hold the same force F,

    .. math:: F (1 - \mu) - c \le P (\theta_d - \theta) \le F (1 + \mu) + c

    with the friction of a gear that slides; one that sticks holds more.

    Args:
        windows: theta_d [rad], theta [rad], theta_dot [rad/s], shape (W, window, 3).
        force: Tension at their end [N], shape (W,).
        generator: Draws, on the CPU, the same on every device.
    """
    count = len(windows)
    chance, place, begin, length = torch.rand(4, count, 1, generator=generator).to(windows.device)
    if law.stiffness == 0.0:
        return windows
    angle = windows[:, :, 1]
    lead = windows[:, :, 0] - angle
    rest = resting(windows[:, :, 2])
    samples = rest.sum(dim=1, keepdim=True)
    chosen = (chance < SHARE) & (samples >= FEWEST) & (force[:, None] > TAUT)
    band = law.load_friction * force[:, None] + law.dry_friction
    target = (force[:, None] + (2.0 * place - 1.0) * band) / law.stiffness
    age = torch.cumsum(rest, dim=1) / samples.clamp(min=1.0)
    way = (age - LATEST * begin) / (SHORTEST + (LONGEST - SHORTEST) * length)
    way = way.clamp(0.0, 1.0) * rest * chosen
    return torch.stack([angle + lead + way * (target - lead), angle, windows[:, :, 2]], dim=2)


def resting(speed: Tensor) -> Tensor:
    """Return 1 for each sample from which on a shaft rests to the end, else 0, (W, window)."""
    slow = speed.abs() <= REST_SPEED
    return slow.flip(1).cumprod(dim=1).flip(1).to(speed.dtype)


ZERO = 0.02
"""Standard deviation of a window's zero of both angles [rad]: a quarter of a millimetre of tendon,
to which one is tied again."""
COMMAND = 0.03
"""Standard deviation of the command's zero alone [rad]: an eighth of a newton at 4.2 N/rad."""
ANGLE = 0.003  # Standard deviation of each sample's angle [rad]: two counts of an encoder with 4096
SPEED = 0.03
"""Standard deviation of each sample's speed [rad/s]: the step of a DYNAMIXEL X register (0.229
rev/min, e-manual)."""


def disturbed(windows: Tensor, generator: torch.Generator) -> Tensor:
    """Return windows with another zero, another command and other noise.

    Another servo and another morning could have recorded them. A hold of some seconds is
    hundreds of windows that differ by noise alone, and its angles are like no other hold's: a
    network can learn it by heart. Every window is therefore changed a little whenever it is drawn,
    by less than what its force would notice.

    Args:
        windows: theta_d [rad], theta [rad], theta_dot [rad/s], shape (W, window, 3).
        generator: Draws, on the CPU, the same on every device.
    """
    count, length, _ = windows.shape
    zero, command = torch.randn(2, count, 1, generator=generator)
    angle, speed = torch.randn(2, count, length, generator=generator)
    change = torch.stack(
        [
            (ZERO * zero + COMMAND * command).expand(count, length),
            ZERO * zero + ANGLE * angle,
            SPEED * speed,
        ],
        dim=2,
    )
    return windows + change.to(windows.device)


def changed_batch(
    data: WindowTensors,
    chosen: Tensor,
    config: TrainingConfig,
    share: float,
    law: ServoLaw,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """Return windows as they might have been recorded as well, and the tension at every sample.

    Args:
        share: Share of the training that is done [1].
        generator: Draws, on the CPU.
    """
    windows, targets = data.batch(chosen), data.targets(chosen)
    simulated = config.purpose == "simulation"
    if config.disturb:
        if not simulated:
            windows = held_fast(windows, targets[:, -1], law, generator)
        windows = disturbed(windows, generator)
    departing = departing_share(config.purpose, share)
    if departing > 0.0 and (simulated or config.disturb):
        windows, change = departed(windows, law, config.rate, departing, generator)
        targets = targets + change
    return windows, targets
