"""Find the numbers of several benches from this: one servo pulls them all.

A small network, the witness, sees how far the servo is from its command and how fast it turns, and
not where it is. What it says must be what every bench's line implies. A stiff bench whose line
gives by an unknown amount is so weighed against a soft one, where that hardly matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from tendon_lab.without_cell.sensorless_line import Line, LinePrior, line_prior
from tendon_lab.without_cell.sensorless_motion import SensorlessMotion
from tendon_lab.without_cell.sensorless_numbers import LineNumbers
from tendon_lab.without_cell.sensorless_rows import SlidingRows, sliding_rows
from tendon_newton.errors import InvalidDataset

WIDTHS = (24, 12)
EVIDENCE = 3.0
"""Independent pieces of evidence in a recording [1]: what the witness misses is nearly the same all
along it. Three and six find lines that are as good."""
SURE = 0.6
"""Error in standard deviations beyond which a row's weight falls [1], so that what a line or servo
does now and then does not move a bench's numbers."""
ERRORS = (0.3, 0.6)
"""Standard deviations of the witness [N] to start with, winding in and driven back. The fit finds
both too: a gear that is driven back holds anything within friction's band."""
TENSION = (7.0, 5.0)
"""Offset and scale of what the witness gives [N], so that it starts in the middle of 0 to 21 N."""
LEARNING_RATES = (1.0e-2, 2.0e-2)
"""Learning rates of the witness, and of the numbers in their standard deviations."""


@dataclass(frozen=True, kw_only=True)
class LineFit:
    """Steps, seed and threads of the fit of lines."""

    steps: int = 800
    seed: int = 0
    threads: int = 1  # Threads of torch: the same number gives the same lines


class Witness(nn.Module):
    """Says the tension from what is seen of the servo; a line and what bends it."""

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.line = nn.Linear(inputs, 1)
        self.bends = nn.Sequential(
            nn.Linear(inputs, WIDTHS[0]),
            nn.Tanh(),
            nn.Linear(WIDTHS[0], WIDTHS[1]),
            nn.Tanh(),
            nn.Linear(WIDTHS[1], 1),
        )

    def forward(self, servo: Tensor) -> Tensor:
        """Return tensions [N], shape (N,)."""
        return TENSION[0] + TENSION[1] * (self.line(servo) + self.bends(servo))[:, 0]


def fit_lines(motions: Sequence[SensorlessMotion], config: LineFit) -> tuple[Line, ...]:
    """Find one line per bench.

    Args:
        motions: Recordings without force.
        config: Length of the fit.

    Raises:
        InvalidDataset: Recordings of a bench disagree about it, or no servo turns.
    """
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    priors = priors_of(motions)
    rows = sliding_rows(motions, [prior.bench for prior in priors])
    numbers, witness = LineNumbers(priors), Witness(rows.servo.shape[1])
    spread = torch.tensor(ERRORS).log().requires_grad_()
    optimizer = torch.optim.Adam(
        [
            {"params": witness.parameters(), "lr": LEARNING_RATES[0]},
            {"params": [*numbers.parameters(), spread], "lr": LEARNING_RATES[1]},
        ]
    )
    scheduler = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, config.steps)
    for _ in range(config.steps):
        errors = bench_errors(witness, rows, numbers) / torch.exp(spread)[rows.unwinds]
        misfit = nn.functional.huber_loss(
            errors, torch.zeros_like(errors), delta=SURE, reduction="none"
        )
        misfit = (rows.weight * (misfit + spread[rows.unwinds])).sum()
        loss = (EVIDENCE * misfit + numbers.surprise()) / len(motions)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        scheduler.step()
    return numbers.lines()


def bench_errors(witness: Witness, rows: SlidingRows, numbers: LineNumbers) -> Tensor:
    """Return what the witness says less what the lines imply, shape (N,).

    In newtons of the nominal stiffness: that is in the motion, of which a bench's numbers cannot
    make less by calling all forces small.
    """
    stiffness, bench = numbers.stiffness(), rows.bench
    joints = rows.joints - (rows.joints_by_tip * numbers.camera()[bench][:, None, :]).sum(dim=2)
    stretch = rows.wound - numbers.slack()[bench] - (numbers.arms()[bench] * joints).sum(dim=1)
    felt = 1.0 + numbers.guide()[bench] * rows.direction
    implied = stiffness[bench] * stretch * felt
    return (witness(rows.servo) - implied) * (numbers.nominal_stiffness() / stiffness)[bench]


def priors_of(motions: Sequence[SensorlessMotion]) -> tuple[LinePrior, ...]:
    """Return what is known of each bench; its recordings must agree on that."""
    priors: dict[str, LinePrior] = {}
    for motion in motions:
        bench = motion.recording.bench
        prior = line_prior(bench, motion.mechanism)
        if priors.setdefault(bench, prior) != prior:
            raise InvalidDataset(
                f"{motion.recording.name}: without a load cell all recordings of a bench must have "
                f"the same spring and moment arms; other recordings of {bench} have others"
            )
    return tuple(priors.values())
