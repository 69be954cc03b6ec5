"""Trainings that begin anew where what they began with has changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from shutil import rmtree
from typing import TypeVar

from tendon_newton.errors import InvalidNetworkFile, InvalidPolicyFile

Result = TypeVar("Result")


def anew_if_other(begun: Path, train: Callable[[], Result], tell: Callable[[str], None]) -> Result:
    """Train, or go on; from the start where a checkpoint is damaged or of other data or settings.

    Args:
        begun: The checkpoint that the training goes on from, or the folder of its checkpoints.
        train: Trains, and refuses a checkpoint that is not its own.
        tell: Told why it began anew.
    """
    try:
        return train()
    except (InvalidNetworkFile, InvalidPolicyFile) as error:
        if not begun.exists():
            raise
        tell(f"  begins anew: {str(error).removesuffix('; use another folder')}")
        if begun.is_dir():
            rmtree(begun)
        else:
            begun.unlink()
        return train()
