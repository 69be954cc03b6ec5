"""Sound assets to spoil, and how they are read."""

from __future__ import annotations

from pathlib import Path

from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.usd.stage_file import open_stage
from tests.mechanisms.broken.flat_assets import flat_text


def text_asset(folder: Path) -> Path:
    """Write the finger as one text."""
    (folder / "finger.usda").write_text(flat_text("finger"))
    return folder / "finger.usda"


def binary_asset(folder: Path) -> Path:
    """Write the finger in USD's binary form."""
    open_stage(asset_path("finger")).Flatten().Export(str(folder / "finger.usdc"))
    return folder / "finger.usdc"


def read_asset(path: Path) -> None:
    """Check an asset, and load it if nothing is wrong."""
    if not any(finding.severity == "error" for finding in check_asset(path)):
        load_mechanism(path)
