"""Find the numbers of several benches from this: one servo pulls them all.

A small network, the witness, sees how far the servo is from its command and how fast it turns, and
not where it is. What it says must be what every bench's line implies. A stiff bench whose line
gives by an unknown amount is so weighed against a soft one, where that hardly matters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from tendon_newton.errors import InvalidDataset
from train.actuator.sensorless_line import Line, LinePrior, line_from, line_prior
from train.actuator.sensorless_motion import Motion
from train.actuator.windows import WindowShape, window_rows

SHAPE = WindowShape()
WIDTHS = (96, 32)
ERROR = 0.5
"""Error of the witness [N] beyond whose triple it counts no longer squared: what the past does not
tell, such as where a motor stuck long ago, must not move a bench's numbers."""
TENSION = (7.0, 5.0)
"""Offset and scale of what the witness gives [N], so that it starts in the middle of 0 to 21 N."""
LEARNING_RATES = (3.0e-3, 2.0e-2)
"""Of the witness, and of the numbers in their standard deviations."""


@dataclass(frozen=True, kw_only=True)
class LineFit:
    """How long lines are fitted."""

    steps: int = 1920
    batch: int = 512
    """Windows per step."""
    seed: int = 0
    threads: int = 1
    """Threads of torch: the same number gives the same lines."""


@dataclass(frozen=True, kw_only=True)
class FittedRows:
    """All rows that the fit sees."""

    inputs: Tensor
    """theta_d - theta, theta_dot, both in standard deviations, shape (N, 2)."""
    windows: Tensor
    """Rows of each window, oldest first, shape (W, window)."""
    seen: Tensor
    """wound [m], direction [1], joint angles [rad], shape (N, 2 + J); zeros for missing joints."""
    bench: Tensor
    """Number of each row's bench, shape (N,)."""


def fit_lines(
    motions: Sequence[Motion],
    config: LineFit,
    *,
    report: Callable[[int, float], None] = lambda step, loss: None,
) -> tuple[Line, ...]:
    """Find one line per bench.

    A recording counts as one independent piece of evidence, however many rows it has: what the
    witness misses is the same all along it.

    Args:
        motions: Recordings without force.
        config: How long.
        report: Called now and then with steps done and loss.
    """
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    rng = np.random.default_rng(config.seed)
    priors = priors_of(motions)
    rows = rows_of(motions, [prior.bench for prior in priors])
    mean, spread = padded(priors)
    deviation = torch.zeros_like(mean, requires_grad=True)
    witness = nn.Sequential(
        nn.Linear(2 * SHAPE.window, WIDTHS[0]), nn.Tanh(), nn.Linear(WIDTHS[0], WIDTHS[1]),
        nn.Tanh(), nn.Linear(WIDTHS[1], 1),
    )  # fmt: skip
    optimizer = torch.optim.Adam(
        [
            {"params": witness.parameters(), "lr": LEARNING_RATES[0]},
            {"params": [deviation], "lr": LEARNING_RATES[1]},
        ]
    )
    scheduler = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, config.steps)
    for step in range(1, config.steps + 1):
        chosen = rows.windows[torch.from_numpy(rng.integers(len(rows.windows), size=config.batch))]
        numbers = mean + spread * deviation
        errors = bench_errors(witness, rows, chosen, numbers, mean) / ERROR
        misfit = nn.functional.huber_loss(errors, torch.zeros_like(errors), delta=3.0)
        loss = misfit + 0.5 * (deviation**2).sum() / len(motions)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        scheduler.step()
        if step % max(1, config.steps // 8) == 0:
            report(step, float(loss.detach()))
    found = (mean + spread * deviation).detach().double().numpy()
    return tuple(
        line_from(prior.bench, numbers[: prior.mean.size])
        for prior, numbers in zip(priors, found, strict=True)
    )


def bench_errors(
    witness: nn.Module, rows: FittedRows, windows: Tensor, numbers: Tensor, nominal: Tensor
) -> Tensor:
    """Return what the witness says less what the lines imply, shape (W,).

    In newtons of the nominal stiffness: that is in the motion, of which a bench's numbers cannot
    make less by calling all forces small.
    """
    last = windows[:, -1]
    own, seen = numbers[rows.bench[last]], rows.seen[last]
    stretch = seen[:, 0] - own[:, 1] - (own[:, 3:] * seen[:, 2:]).sum(dim=1)
    implied = torch.exp(own[:, 0]) * stretch * (1.0 + own[:, 2] * seen[:, 1])
    said = TENSION[0] + TENSION[1] * witness(rows.inputs[windows].flatten(1))[:, 0]
    return (said - implied) * torch.exp(nominal[rows.bench[last], 0] - own[:, 0])


def priors_of(motions: Sequence[Motion]) -> tuple[LinePrior, ...]:
    """Return what is known of each bench; its recordings must agree on that."""
    priors: dict[str, LinePrior] = {}
    for motion in motions:
        bench = motion.recording.bench
        prior = line_prior(bench, motion.mechanism)
        known = priors.setdefault(bench, prior)
        if not np.array_equal(known.mean, prior.mean):
            raise InvalidDataset(
                f"{motion.recording.name}: without a load cell all recordings of a bench must have "
                f"the same spring and moment arms; other recordings of {bench} have others"
            )
    return tuple(priors.values())


def padded(priors: Sequence[LinePrior]) -> tuple[Tensor, Tensor]:
    """Return means and spreads of all benches, shape (B, 3 + J); missing arms are zero."""
    width = max(prior.mean.size for prior in priors)
    tables = [
        np.array([np.pad(values, (0, width - values.size)) for values in column])
        for column in ([p.mean for p in priors], [p.spread for p in priors])
    ]
    mean, spread = (torch.tensor(table, dtype=torch.float32) for table in tables)
    return mean, spread


def rows_of(motions: Sequence[Motion], benches: Sequence[str]) -> FittedRows:
    """Put all motions one after the other."""
    width = max(motion.joints.shape[1] for motion in motions)
    inputs, windows, seen, bench, offset = [], [], [], [], 0
    for motion in motions:
        recording = motion.recording
        assert recording.command is not None
        lead = recording.command[:, 0] - recording.motor_position[:, 0]
        inputs.append(np.column_stack([lead, recording.motor_velocity[:, 0]]))
        windows.append(window_rows(recording, SHAPE) + offset)
        joints = np.pad(motion.joints, ((0, 0), (0, width - motion.joints.shape[1])))
        seen.append(np.column_stack([motion.wound, motion.direction, joints]))
        bench.append(np.full(recording.sample_count, benches.index(recording.bench)))
        offset += recording.sample_count
    table = np.concatenate(inputs)
    table = (table - table.mean(axis=0)) / np.maximum(table.std(axis=0), 1.0e-6)
    return FittedRows(
        inputs=torch.tensor(table, dtype=torch.float32),
        windows=torch.tensor(np.concatenate(windows)),
        seen=torch.tensor(np.concatenate(seen), dtype=torch.float32),
        bench=torch.tensor(np.concatenate(bench)),
    )
