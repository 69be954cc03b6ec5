"""Assets flattened to one text, so that a test can spoil a line of them."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

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


def two_strings(folder: Path) -> Path:
    """Write the finger with a second string of constant arms, which opens what the first closes."""
    from pxr import Sdf

    layer = open_stage(asset_path("finger")).Flatten()
    flexor, extensor = "/finger/tendons/flexor", "/finger/tendons/extensor"
    Sdf.CopySpec(layer, flexor, layer, extensor)
    arms = layer.GetAttributeAtPath(f"{extensor}.mjc:path:coef")
    arms.default = [-arm for arm in arms.default]
    path = folder / "finger.usda"
    layer.Export(str(path))
    return path
