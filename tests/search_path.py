"""Where Python finds the packages of a clone."""

import os
from pathlib import Path


def search_path(clone: Path) -> str:
    """Return the PYTHONPATH of a clone: three of its packages stand in folders of their own."""
    return os.pathsep.join(str(clone / part) for part in ("", "train", "hardware", "lab"))
