"""Changes of the windows that a training draws, each time anew.

For predictions, motors that stick are asked for something else, and angles and commands get another
zero and other noise. In the first part of the training motion departs from its recording. For
simulations motion departs to the end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from train.actuator.samples.departure import departed, departing_share
from train.actuator.samples.disturbance import disturbed
from train.actuator.samples.sticking import held_fast

if TYPE_CHECKING:
    import torch
    from torch import Tensor

    from train.actuator.samples.servo_law import ServoLaw
    from train.actuator.samples.window_tensors import WindowTensors
    from train.actuator.training_config import TrainingConfig


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
        data: All windows.
        chosen: Places of the drawn windows.
        config: Settings of the training, with its purpose.
        share: Share of the training that is done [1].
        law: Law of the servo's answer to its shaft.
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
