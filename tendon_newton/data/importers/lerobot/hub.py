"""Datasets of Hugging Face's Hub, of which the rows alone are fetched."""

import importlib
import importlib.util
import re
from pathlib import Path
from typing import Any

from tendon_newton.errors import InvalidRecording, MissingDependency

HUB_ID = re.compile(r"[A-Za-z0-9][\w.-]*/[A-Za-z0-9][\w.-]*")
"""How an id is written: OWNER/NAME."""
WANTED = ["meta/*", "data/*"]  # All but the videos


def local_folder(name: str) -> Path:
    """Return a folder as it is, or a copy of the Hub's dataset of that id.

    Raises:
        MissingDependency: huggingface_hub is not installed.
        InvalidRecording: The Hub has no such dataset, or cannot be reached.
    """
    path = Path(name)
    if path.exists() or not HUB_ID.fullmatch(name):
        return path
    if importlib.util.find_spec("huggingface_hub") is None:
        raise MissingDependency(
            f"{name}: no such folder; to fetch it from Hugging Face's Hub the package "
            "'huggingface_hub' is needed, which is not installed: pip install 'tendon-newton[hub]'"
        )
    hub: Any = importlib.import_module("huggingface_hub")
    try:
        return Path(hub.snapshot_download(name, repo_type="dataset", allow_patterns=WANTED))
    except Exception as error:  # of a library that has many, each with its own parents
        told = " ".join(str(error).split())[:200]
        raise InvalidRecording(
            f"{name}: no such folder, and Hugging Face's Hub does not give a dataset of this id "
            f"({type(error).__name__}: {told}): check the id and the network, or download it and "
            "name its folder"
        ) from error
