"""A servo's own law is found in its recordings, and networks for simulations learn it."""

from pathlib import Path

import numpy as np
import pytest
import torch

from tendon_train.actuator.fitting.training import train_network
from tendon_train.actuator.samples.sample_departure import (
    ANGLE,
    FIRST_SHARE,
    SHARE,
    SPEED,
    ZERO,
    departed,
    departing_share,
)
from tendon_train.actuator.samples.servo_law import FEWEST, NO_LAW, ServoLaw, fit_servo_law
from tendon_train.actuator.samples.windows import Windows, WindowShape, extract_windows, to_device
from tendon_train.actuator.training_config import Purpose, TrainingConfig
from tests.train.actuator.servo_logs import servo_log

LAW = ServoLaw(stiffness=6.0, damping=10.0, dry_friction=1.2, load_friction=0.2)
RATE = 20.0  # Hz
COUNT = 4000


def sliding_rows(count: int, rng: np.random.Generator) -> Windows:
    """Return rows of a motor with friction, under loads of every kind; each is a window."""
    angle, speed = rng.uniform(0.0, 2.0, count), rng.normal(0.0, 0.5, count)
    force = rng.uniform(1.0, 15.0, count)
    friction = (LAW.dry_friction + LAW.load_friction * force) * np.sign(speed)
    command = angle + (force + LAW.damping * speed + friction) / LAW.stiffness
    rows = np.arange(count)[:, None]
    return Windows(
        inputs=np.stack([command, angle, speed], axis=1),
        force=force + rng.normal(0.0, 0.05, count),
        rows=rows,
        source=np.zeros(count, dtype=int),
    )


def test_the_law_of_a_servo_is_found_beside_its_friction(rng: np.random.Generator) -> None:
    """All to 1 %, from 3,000 rows with 0.05 N of noise, or to 0.02 N and 0.005."""
    law = fit_servo_law(sliding_rows(3000, rng))
    assert law.stiffness == pytest.approx(LAW.stiffness, rel=0.01)
    assert law.damping == pytest.approx(LAW.damping, rel=0.01)
    assert law.dry_friction == pytest.approx(LAW.dry_friction, abs=0.02)
    assert law.load_friction == pytest.approx(LAW.load_friction, abs=0.005)


def test_a_servo_that_hardly_slid_has_no_law(rng: np.random.Generator) -> None:
    """Its force is held as the paper does."""
    assert fit_servo_law(sliding_rows(FEWEST - 1, rng)) == NO_LAW


def test_a_network_for_predictions_ends_on_recordings() -> None:
    """Some of its windows depart at first, ever fewer, none in the last fifth.

    In a training for simulations half of them do to the end.
    """
    shares = [departing_share("prediction", done) for done in (0.0, 0.4, 0.8, 0.95)]
    assert shares == pytest.approx([FIRST_SHARE, 0.5 * FIRST_SHARE, 0.0, 0.0])
    assert departing_share("simulation", 0.95) == SHARE


def test_windows_depart_as_stated() -> None:
    """Half of them, by an angle that is the integral of a speed; the force is what the law says.

    4,000 windows: shares and standard deviations to 5 %.
    """
    still = torch.zeros(COUNT, 30, 3)
    moved, force = departed(still, LAW, RATE, SHARE, torch.Generator().manual_seed(0))
    command, angle, speed = moved.unbind(dim=2)
    gone = command[:, 0] != 0.0
    assert float(gone.float().mean()) == pytest.approx(SHARE, rel=0.05)
    assert not moved[~gone].any()
    assert not force[~gone].any()
    assert float(command[gone, 0].std()) == pytest.approx(ZERO, rel=0.05)
    assert float(command.std(dim=1).max()) < 1e-6
    turned = angle - command
    assert float(turned[gone, 0].std()) == pytest.approx(ANGLE, rel=0.05)
    steps = 0.5 * (speed[:, 1:] + speed[:, :-1]) / RATE
    torch.testing.assert_close(turned.diff(dim=1), steps, atol=1e-5, rtol=0.0)
    # evenly drawn sizes: a third of the largest variance
    assert float(speed[gone].std()) == pytest.approx(SPEED / 3.0**0.5, rel=0.05)
    assert float(speed[gone, 0].std()) == pytest.approx(float(speed[gone, -1].std()), rel=0.1)
    expected = -LAW.stiffness * turned - LAW.damping * speed
    torch.testing.assert_close(force, expected)


@pytest.mark.parametrize(("purpose", "follows"), [("simulation", True), ("prediction", False)])
def test_a_network_for_simulations_knows_the_force_beside_the_recordings(
    tmp_path: Path, purpose: Purpose, follows: bool
) -> None:
    """Where the shaft stands off its recording by 0.2 rad, the force is off as the law says.

    That is 1.2 N, to a third after a short training. Recordings of one load alone do not teach it.
    """
    logs = [
        servo_log(f"{seed}.csv", excitation=kind, seed=seed)
        for seed, kind in enumerate(("random_steps", "sine", "ramps", "random_steps"))
    ]
    fit, held_out = (extract_windows(part, WindowShape()) for part in (logs[:3], logs[3:]))
    config = TrainingConfig(
        network="mlp", purpose=purpose, epochs=6, windows_per_epoch=4096, learning_rate=6.0e-3
    )
    network, _ = train_network(config, fit, held_out, tmp_path / "a.checkpoint", law=LAW)
    windows = to_device(held_out, "cpu").batch(torch.arange(0, held_out.window_count, 4))
    beside = windows.clone()
    beside[:, :, 1] += 0.2
    with torch.no_grad():
        fall = float((network(windows) - network(beside)).mean())
    assert (fall == pytest.approx(0.2 * LAW.stiffness, rel=1.0 / 3.0)) == follows
