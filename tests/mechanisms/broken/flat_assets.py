"""Assets flattened to one text, so that a test can spoil a line of them."""

from pathlib import Path

from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.usd.stage_file import open_stage


def flat_text(name: str) -> str:
    """Return an asset as one USD text."""
    return open_stage(asset_path(name)).Flatten().ExportToString()


def write_changed(folder: Path, name: str, *changes: tuple[str, str]) -> Path:
    """Write an asset with some of its text replaced; each old text must be there."""
    text = flat_text(name)
    for old, new in changes:
        assert old in text, f"{old!r} is not in the flattened {name}"
        text = text.replace(old, new)
    path = folder / f"{name}.usda"
    path.write_text(text)
    return path
