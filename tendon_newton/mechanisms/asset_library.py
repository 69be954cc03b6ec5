"""Folders of the assets: in the repository or an installed wheel, and in folders of the user's."""

import os
import shlex
from collections.abc import Iterable
from pathlib import Path

from tendon_newton.errors import InvalidAsset, UnknownName, unknown_name

USD_SUFFIXES = (".usda", ".usd", ".usdc", ".usdz")

# Environment variable that lists the user's own folders of assets
FOLDERS_VARIABLE = "TENDON_NEWTON_ASSETS"

_PACKAGE = Path(__file__).resolve().parents[1]
# A wheel carries its assets inside the package; a clone has them beside it
_FOLDERS = (_PACKAGE / "_assets", _PACKAGE.parent / "assets")


def asset_folder() -> Path:
    """Return the folder that holds one folder per asset."""
    for folder in _FOLDERS:
        if folder.is_dir():
            return folder
    raise InvalidAsset(
        f"The assets that belong to this program are missing; looked for {_FOLDERS[0]} "
        f"and {_FOLDERS[1]}."
    )


def asset_folders() -> tuple[Path, ...]:
    """Return the folders that hold one folder per asset: the program's own, then the user's.

    The user's stand in the environment variable ``TENDON_NEWTON_ASSETS``, separated as in ``PATH``.
    """
    own = os.environ.get(FOLDERS_VARIABLE, "")
    return (asset_folder(), *(Path(folder) for folder in own.split(os.pathsep) if folder))


def asset_names() -> tuple[str, ...]:
    """Return the names of all assets, sorted."""
    return tuple(sorted(asset_files()))


def check_new_name(name: str) -> None:
    """Refuse a name that an asset has already.

    Raises:
        InvalidAsset: The name is taken, or `asset_files` refuses a folder.
    """
    if (taken := asset_files().get(name)) is not None:
        raise InvalidAsset(f"an asset's name is its own; {name!r} is {taken}")


def asset_files() -> dict[str, Path]:
    """Return the USD file of every asset by its name.

    An asset is a folder that holds a ``.usda`` file of the folder's own name. Folders without one
    hold parts that several assets share.

    Raises:
        InvalidAsset: A folder of the user's is missing, or a name is there twice.
    """
    table: dict[str, Path] = {}
    for folder in asset_folders():
        if not folder.is_dir():
            raise InvalidAsset(f"{FOLDERS_VARIABLE} must list folders; {folder} is none.")
        for home in folder.iterdir():
            file = home / f"{home.name}.usda"
            if not file.is_file():
                continue
            if home.name in table and not table[home.name].samefile(file):
                raise InvalidAsset(
                    f"An asset's name is its own; {home.name!r} is both {table[home.name]} and "
                    f"{file}. Rename the folder, its file and its root prim."
                )
            table[home.name] = file
    return table


def asset_path(name_or_file: str | Path) -> Path:
    """Return the USD file of an asset that is given by its name or by a path.

    The name is one under ``assets/`` or in a folder of the user's; the path is that of a USD file
    or of an asset's folder.
    """
    path = Path(name_or_file)
    if path.suffix in USD_SUFFIXES:
        if not is_file(path):
            raise InvalidAsset(f"An asset must be a USD file; {path} does not exist.")
        return path.resolve()
    files = asset_files()
    if str(name_or_file) in files:
        return files[str(name_or_file)]
    inside = path / f"{path.resolve().name}.usda"
    if is_file(inside):
        return inside.resolve()
    if os.path.exists(path) or len(path.parts) > 1:  # noqa: PTH110 - as in `is_file`
        came = "this is neither" if os.path.exists(path) else "no such file or folder"  # noqa: PTH110
        raise InvalidAsset(
            f"{path}: an asset is a USD file, or a folder with a {inside.name} in it; {came} (URDF "
            "and MJCF come in by asset import)"
        )
    raise unknown_asset("asset", str(name_or_file))


def is_file(path: str | Path) -> bool:
    """Tell whether a file is there; a name that no file can have is none."""
    return os.path.isfile(path)  # noqa: PTH113 - pathlib raises for such a name


def unknown_asset(kind: str, name: str, known: Iterable[str] | None = None) -> UnknownName:
    """Build the error for an asset that is in none of the folders, and say how to name one.

    The kind is a word ("bench"); all assets are known unless given.
    """
    here = is_file(f"{name}/{name}.usda")
    mend = (
        f"{FOLDERS_VARIABLE}={shlex.quote(str(Path.cwd()))}"
        if here
        else f"folders in {FOLDERS_VARIABLE}"
    )
    own = f"./{name} is found with" if here else "your own are looked for in the"
    return UnknownName(f"{unknown_name(kind, name, known or asset_names())}; {own} {mend}")
