"""A training's checkpoint as a file: numbers and names, and no code."""

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import torch

from tendon_newton.data.files.text_file import write_bytes
from tendon_newton.errors import TendonNewtonError


def write_checkpoint(path: Path, settings: Mapping[str, Any], **parts: Any) -> None:
    """Write a checkpoint; a process that is killed leaves the old one or the new one."""
    content = BytesIO()  # torch tells of a full disk by an error of its own
    torch.save({"settings": dict(settings), **parts}, content)
    write_bytes(path, content.getvalue())


@contextmanager
def read_checkpoint(
    path: Path,
    settings: Mapping[str, Any],
    device: Any,
    fault: type[TendonNewtonError],
    remedy: str,
) -> Generator[dict[str, Any]]:
    """Give what a checkpoint holds; what cannot be made of it in the block is its damage.

    Args:
        settings: Settings of the training; the checkpoint must have been written under the same.
        fault: Error for a file that is damaged, or belongs to another training.
        remedy: Why a damaged one may be deleted.
    """
    try:
        table = torch.load(path, map_location=device, weights_only=True)
        for key, value in settings.items():
            if (saved := table["settings"].get(key)) != value:
                raise fault(
                    f"{path}: this training began with {key} = {saved!r}, and now it is {value!r}; "
                    "use another folder"
                )
        yield table
    except fault:
        raise
    except Exception as error:  # torch's reader of damaged bytes fails in any way
        raise fault(
            f"{path}: the checkpoint of a training is damaged or of another version "
            f"({type(error).__name__}); delete it to {remedy}"
        ) from error
