"""The lines of all benches, as they deviate from what is known of them."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from tendon_lab.without_cell.sensorless_line import (
    ARM_SPREAD,
    CAMERA_SPREAD,
    KNOT_SPREAD,
    LINE_SPREAD,
    LINE_STIFFNESS,
    SLACK,
    SLACK_SPREAD,
    SPRING_SPREAD,
    Line,
    LinePrior,
)

SPRING, KNOT, PLAY, GUIDE, FIRST_ARM = range(5)
"""Columns of a bench's own deviations: of its spring, line, slack, guide and moment arms."""


class LineNumbers(nn.Module):
    """Numbers that a fit may change, all in standard deviations from what is known.

    Args:
        priors: What is known of B benches with J joints at most.
    """

    give: Tensor
    friction: Tensor
    friction_spread: Tensor
    nominal_arms: Tensor

    def __init__(self, priors: Sequence[LinePrior]) -> None:
        super().__init__()
        self._priors = tuple(priors)
        joints = max(len(prior.arms) for prior in priors)
        arms = [[*prior.arms, *[0.0] * (joints - len(prior.arms))] for prior in priors]
        self.line = nn.Parameter(torch.zeros(()))
        self.own = nn.Parameter(torch.zeros(len(priors), FIRST_ARM + joints))
        self.off = nn.Parameter(torch.zeros(len(priors), 2))
        self.register_buffer("give", torch.tensor([prior.give for prior in priors]))
        self.register_buffer("friction", torch.tensor([prior.friction for prior in priors]))
        spread = [prior.friction_spread for prior in priors]
        self.register_buffer("friction_spread", torch.tensor(spread))
        self.register_buffer("nominal_arms", torch.tensor(arms).reshape(len(priors), joints))

    def stiffness(self) -> Tensor:
        """Return kappa of each bench [N/m], its spring in series with its line, shape (B,)."""
        line = torch.exp(-LINE_SPREAD * self.line - KNOT_SPREAD * self.own[:, KNOT])
        spring = self.give * torch.exp(-SPRING_SPREAD * self.own[:, SPRING])
        return 1.0 / (spring + line / LINE_STIFFNESS)

    def nominal_stiffness(self) -> Tensor:
        """Return what is known of kappa [N/m], shape (B,)."""
        return 1.0 / (self.give + 1.0 / LINE_STIFFNESS)

    def slack(self) -> Tensor:
        """Return s of each bench [m], shape (B,)."""
        return SLACK + SLACK_SPREAD * self.own[:, PLAY]

    def guide(self) -> Tensor:
        """Return psi of each bench [1], shape (B,)."""
        return self.friction + self.friction_spread * self.own[:, GUIDE]

    def arms(self) -> Tensor:
        """Return the moment arms of each bench [m], zero where it has fewer, shape (B, J)."""
        return self.nominal_arms * (1.0 + ARM_SPREAD * self.own[:, FIRST_ARM:])

    def camera(self) -> Tensor:
        """Return by what x and z of a tip are seen off their place [m], shape (B, 2)."""
        return CAMERA_SPREAD * self.off

    def surprise(self) -> Tensor:
        """Return how unlikely such deviations are: half the sum of their squares."""
        return 0.5 * (self.line**2 + (self.own**2).sum() + (self.off**2).sum())

    def lines(self) -> tuple[Line, ...]:
        """Return each bench's line."""
        with torch.no_grad():
            stiffness, slack, guide = self.stiffness(), self.slack(), self.guide()
            arms, camera = self.arms(), self.camera()
        return tuple(
            Line(
                bench=prior.bench,
                stiffness=float(stiffness[row]),
                slack=float(slack[row]),
                friction=float(guide[row]),
                arms=tuple(float(arm) for arm in arms[row, : len(prior.arms)]),
                camera=tuple(float(part) for part in camera[row]) if prior.arms else (),
            )
            for row, prior in enumerate(self._priors)
        )
