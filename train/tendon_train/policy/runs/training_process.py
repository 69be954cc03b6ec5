"""The processes of one training, of which ``torchrun`` starts one per GPU."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import torch

from tendon_newton.errors import InvalidParameter


@dataclass(frozen=True, kw_only=True)
class Process:
    """One of the processes, or the only one."""

    rank: int  # Number of the process among all
    local_rank: int  # Number of the process on its machine
    count: int  # Processes in all

    @staticmethod
    def own() -> Process:
        """Return what ``torchrun`` says of this process."""
        rank, local_rank, count = (
            int(os.environ.get(name, default))
            for name, default in (("RANK", "0"), ("LOCAL_RANK", "0"), ("WORLD_SIZE", "1"))
        )
        return Process(rank=rank, local_rank=local_rank, count=count)

    def device(self, wanted: str) -> str:
        """Return the device of this process.

        Args:
            wanted: ``cpu``, ``cuda``, or ``auto`` for a GPU where torch finds one.

        Raises:
            InvalidParameter: There is none, or several processes would share a CPU.
        """
        if wanted == "auto":
            wanted = "cuda" if torch.cuda.is_available() else "cpu"
        try:
            kind = torch.device(wanted).type
        except RuntimeError as error:
            raise InvalidParameter(f"device must be cpu, cuda or auto; it is {wanted!r}") from error
        if kind not in ("cpu", "cuda"):
            raise InvalidParameter(f"device must be cpu, cuda or auto; it is {wanted!r}")
        if kind == "cuda" and not torch.cuda.is_available():
            raise InvalidParameter("device cuda needs an NVIDIA GPU and torch for CUDA; use cpu")
        if self.count == 1:
            return "cuda:0" if wanted == "cuda" else wanted
        if kind != "cuda":
            raise InvalidParameter(
                f"{self.count} processes need a GPU each, device cuda; it is {wanted}"
            )
        return f"cuda:{self.local_rank}"

    def seed_draws(self, seed: int, iteration: int) -> int:
        """Seed torch for what this process draws after an iteration, and return the seed."""
        words = np.random.SeedSequence((seed, self.rank, iteration)).generate_state(1, np.uint64)
        drawn = int(words[0]) >> 1  # torch takes what fits into a signed number
        torch.manual_seed(drawn)
        return drawn
