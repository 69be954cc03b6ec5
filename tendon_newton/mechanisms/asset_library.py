"""Where the assets lie: in the repository, or inside an installed wheel."""

from __future__ import annotations

from pathlib import Path

from tendon_newton.errors import InvalidAsset, unknown_name

USD_SUFFIXES = (".usda", ".usd", ".usdc", ".usdz")

_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "_assets", _PACKAGE.parent / "assets")
"""A wheel carries its assets inside the package; a clone has them beside it."""


def asset_folder() -> Path:
    """Return the folder that holds one folder per asset."""
    for folder in _FOLDERS:
        if folder.is_dir():
            return folder
    raise InvalidAsset(
        f"The assets that belong to this program are missing; looked for {_FOLDERS[0]} "
        f"and {_FOLDERS[1]}."
    )


def asset_names() -> tuple[str, ...]:
    """Return the names of all assets, sorted.

    An asset is a folder that holds a ``.usda`` file of the folder's own name. Folders without one
    hold parts that several assets share.
    """
    folder = asset_folder()
    return tuple(sorted(p.name for p in folder.iterdir() if (p / f"{p.name}.usda").is_file()))


def asset_path(name_or_file: str | Path) -> Path:
    """Return the USD file of an asset that is given by its name or by a path.

    Args:
        name_or_file: A name under ``assets/``, or the path of a USD file.
    """
    path = Path(name_or_file)
    if path.suffix in USD_SUFFIXES:
        if not path.is_file():
            raise InvalidAsset(f"An asset must be a USD file; {path} does not exist.")
        return path.resolve()
    names = asset_names()
    if str(name_or_file) not in names:
        raise unknown_name("asset", str(name_or_file), names)
    return asset_folder() / str(name_or_file) / f"{name_or_file}.usda"
