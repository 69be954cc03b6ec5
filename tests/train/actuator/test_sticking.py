"""Windows in which a motor sticks are asked for what would not have moved it, and nothing else."""

import numpy as np
import pytest
import torch

from tendon_train.actuator.samples.changed_windows import FEWEST, SHARE, held_fast, resting
from tendon_train.actuator.samples.servo_law import NO_LAW, ServoLaw, fit_servo_law
from tendon_train.actuator.samples.windows import (
    REST_SPEED,
    WindowShape,
    extract_windows,
    to_device,
)
from tests.train.actuator.servo_logs import servo_log

LAW = ServoLaw(stiffness=6.0, damping=10.0, dry_friction=1.5, load_friction=0.5)
COUNT = 4000


def stopping(rest: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Return windows in which a motor stops for so many samples, and the tension then [N]."""
    angle, speed = torch.ones(COUNT, 30), torch.zeros(COUNT, 30)
    angle[:, : 30 - rest] -= torch.arange(30 - rest, 0, -1) * 0.01
    speed[:, : 30 - rest] = 0.2
    force = torch.linspace(1.0, 15.0, COUNT)
    command = angle + (force / LAW.stiffness)[:, None]
    return torch.stack([command, angle, speed], dim=2), force


def test_a_motor_that_sticks_is_asked_for_what_its_friction_holds() -> None:
    """Half of the windows, only from the stop on, only the command, and within the band.

    The last command may stand anywhere in it: standard deviation 1 / sqrt(12) of its width, at most
    (some commands are still on their way), and at least half of that.
    """
    windows, force = stopping(12)
    asked = held_fast(windows, force, LAW, torch.Generator().manual_seed(0))
    changed = (asked != windows).any(dim=2)
    assert float(changed.any(dim=1).float().mean()) == pytest.approx(SHARE, rel=0.05)
    assert not changed[:, :18].any()
    assert torch.equal(asked[:, :, 1:], windows[:, :, 1:])
    pull = LAW.stiffness * (asked[:, :, 0] - asked[:, :, 1])
    band = LAW.dry_friction + LAW.load_friction * force
    place = ((pull - force[:, None]) / band[:, None])[changed.any(dim=1), -1]
    assert float(place.abs().max()) <= 1.0 + 1e-5
    assert 0.5 / 3.0**0.5 < float(place.std()) < 1.0 / 3.0**0.5 + 0.02


@pytest.mark.parametrize(
    ("rest", "tension", "law"),
    [(0, 5.0, LAW), (FEWEST - 1, 5.0, LAW), (12, 0.1, LAW), (12, 5.0, NO_LAW)],
    ids=["moving", "just stopped", "slack", "unknown"],
)
def test_nothing_else_is_touched(rest: int, tension: float, law: ServoLaw) -> None:
    """A motor that moved just now, a tendon that hangs, a servo of which nothing is known."""
    windows, force = stopping(rest)
    force = torch.full_like(force, tension)
    assert torch.equal(held_fast(windows, force, law, torch.Generator().manual_seed(0)), windows)


def test_rest_is_counted_from_the_end() -> None:
    """A stop that was left again is none."""
    speed = torch.tensor([[0.0, 0.0, 1.0, 0.0, REST_SPEED], [-1.0, 0.0, 0.0, 0.0, 0.0]])
    assert resting(speed).tolist() == [[0.0, 0.0, 0.0, 1.0, 1.0], [0.0, 1.0, 1.0, 1.0, 1.0]]


def test_a_plant_that_sticks_gives_the_same_force_at_what_it_is_asked() -> None:
    """Recorded rests lie in the band that the sliding rows of the same logs tell, but for noise.

    The plant holds 1 N by friction. Nine in ten of its resting rows are within a tenth of that.
    """
    logs = [servo_log(f"{k}.csv", excitation="random_steps", seed=k) for k in range(4)]
    windows = extract_windows(logs, WindowShape())
    law = fit_servo_law(windows)
    data = to_device(windows, "cpu")
    inputs = data.batch(torch.arange(windows.window_count))
    force = data.force[data.rows[:, -1]]
    still = resting(inputs[:, :, 2]).sum(dim=1) >= FEWEST
    pull = law.stiffness * (inputs[:, -1, 0] - inputs[:, -1, 1])
    band = law.dry_friction + law.load_friction * force
    inside = ((pull - force).abs() <= band + 0.1)[still & (force > 0.5)]
    assert inside.numel() > 500
    assert np.mean(inside.numpy()) > 0.9
