"""How a rollout is walked back, as a value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Adjoint:
    """How a `DifferentiableRollout` walks its run back."""

    segments: int = 1
    """In how many parts. Only one part's states are kept at a time, and all but the last are
    simulated again: a long run needs less memory."""
    at_once: bool | None = None
    """Whether many substeps are taken at once; None: on a GPU with room."""
