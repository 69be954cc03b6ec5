"""Opening a USD file that may be anybody's.

The parser believes the sizes that a binary layer claims, and may take gigabytes or die of them.
An asset with such a layer is therefore first opened in a process of its own.
"""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import os
import re
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from tendon_newton.data.files.guarded import TooMuch, guarded
from tendon_newton.errors import InvalidAsset, shown
from tendon_newton.mechanisms.asset_library import FOLDERS_VARIABLE, asset_folders, is_file

# Bytes that opening an asset with binary layers may take; those of a hand take a tenth
MEMORY = 1 << 29
# Prims of a stage that we read; a hand has some hundreds, and validators take 0.2 ms for each
PRIM_LIMIT = 5000
REASON_LENGTH = 500  # Most that is repeated of what USD says [characters]


def open_stage(path: Path) -> Any:
    """Open a USD stage, or say why it cannot be read."""
    if not check_layers(path):
        try:
            guarded(try_open, path.absolute(), places_of(path), memory=MEMORY)
        except TooMuch as error:
            raise InvalidAsset(f"An asset must be a USD file; opening {path} {error}.") from error
    return opened(path)


def try_open(path: Path, places: Sequence[str]) -> None:
    """Open a stage and all its layers, binary ones too, for the errors that come of it."""
    from pxr import UsdUtils

    waiting, seen = [path], set[Path]()
    while waiting:
        layer = waiting.pop()
        if layer in seen or not is_file(layer):
            continue
        seen.add(layer)
        if len(seen) > LAYER_LIMIT:
            raise InvalidAsset(f"An asset has at most {LAYER_LIMIT} layers; {path} has more.")
        with usd_errors(layer):
            kinds = UsdUtils.ExtractExternalReferences(str(layer))
        waiting += [below_of(layer, name, path, places) for names in kinds for name in names]
    opened(path)


def opened(path: Path) -> Any:
    """Return a stage whose names and values can be read."""
    from pxr import Usd

    with usd_errors(path):
        stage = Usd.Stage.Open(str(path))
        stage.Reload()  # USD keeps layers in memory; one may have been edited since
    if sum(1 for _ in islice(stage.Traverse(), PRIM_LIMIT + 1)) > PRIM_LIMIT:
        raise InvalidAsset(f"An asset has at most {PRIM_LIMIT} prims; {path} has more.")
    refuse_other_text(stage)
    refuse_urls(stage, path)
    return stage


def refuse_urls(stage: Any, path: Path) -> None:
    """Refuse values that name what Newton would fetch from elsewhere, such as pictures."""
    from pxr import Usd

    every = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate))
    for attribute in (each for prim in every for each in prim.GetAuthoredAttributes()):
        if attribute.GetTypeName().scalarType not in ("string", "token", "asset"):
            continue
        value = attribute.Get()
        for one in [value] if attribute.GetTypeName().isScalar else value or ():
            name = getattr(one, "path", one)
            if isinstance(name, str) and URL.match(name):
                raise elsewhere(path, str(attribute.GetPath()), name)


def places_of(asset: Path) -> tuple[str, ...]:
    """Return the folders in which an asset's layers may lie."""
    places = (asset.absolute().parent / "..", Path.cwd(), *asset_folders())
    return tuple(os.path.realpath(place) for place in places)


def below_of(layer: Path, name: str, asset: Path, places: Sequence[str]) -> Path:
    """Return the file that a layer names.

    Raises:
        InvalidAsset: The name is a URL, or leads out of the places.
    """
    below = layer.parent / name.partition("[")[0]  # of a file in an archive, the archive
    real = os.path.realpath(below)
    inside = any(os.path.commonpath((place, real)) == place for place in places)
    if URL.match(name) or "`" in name or not inside:  # an expression may give any name
        raise elsewhere(asset, str(layer), name)
    return below


def elsewhere(asset: Path, where: str, name: str) -> InvalidAsset:
    """Build the error for a name that leads away."""
    return InvalidAsset(
        f"What an asset names lies in the folder above its own, the current one, or one in "
        f"{FOLDERS_VARIABLE}; in {asset} {where} names {shown(name)}: copy it there."
    )


def layers_of(path: Path) -> dict[str, Path]:
    """Return the files of an asset by their place from its folder, its own first."""
    stage, own = open_stage(path), path.resolve()  # layers live as long as their stage
    files = [Path(layer.realPath).resolve() for layer in stage.GetUsedLayers() if layer.realPath]
    return {own.name: own, **{os.path.relpath(p, own.parent): p for p in sorted(files)}}


def refuse_other_text(stage: Any) -> None:
    """Refuse layers with names or values that Python cannot read as text."""
    for layer in stage.GetUsedLayers():
        try:
            with usd_errors(Path(layer.realPath)):
                layer.ExportToString()
        except UnicodeDecodeError as error:
            raise InvalidAsset(
                f"An asset must be a USD file; {layer.realPath} holds text that is not UTF-8."
            ) from error


@contextmanager
def usd_errors(path: Path) -> Generator[None]:
    """Turn an error of USD's into one line of ours, and keep what it writes off the terminal."""
    from pxr import Tf, UsdUtils

    listener = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    except Tf.ErrorException as error:
        try:
            reason = " ".join(str(error.args[0].commentary).split())[:REASON_LENGTH]
        except UnicodeDecodeError:  # it repeats the bytes that it cannot read
            reason = "it holds text that is not UTF-8"
        raise InvalidAsset(f"An asset must be a USD file; {path} is unreadable: {reason}") from None
    finally:
        del listener


def take_units(layer: Any, stage: Any) -> None:
    """Give a layer above a stage its up axis, units and default prim."""
    source = stage.GetRootLayer()
    for key in ("upAxis", "metersPerUnit", "kilogramsPerUnit"):
        if source.pseudoRoot.HasInfo(key):
            layer.pseudoRoot.SetInfo(key, source.pseudoRoot.GetInfo(key))
    layer.defaultPrim = source.defaultPrim


# Opening braces of a text layer; each prim has one, and 20,000 nested ones still parse
BRACE_LIMIT = 20_000
# Bytes of all text layers of an asset. Parsed arrays take a hundred times as much; what is larger
# belongs into a binary layer.
TEXT_LIMIT = 8_000_000
LAYER_LIMIT = 200  # Layers of one asset that are looked at
REFERENCE = re.compile(rb"@([^@\n]+)@")
URL = re.compile(r"\s*(?:[A-Za-z][A-Za-z0-9+.-]*://|file:|data:)", re.IGNORECASE)


def check_layers(path: Path) -> bool:
    """Refuse an asset whose text layers cannot be parsed within reason.

    Returns:
        Whether all layers that were seen are text; binary ones are not looked into.

    Raises:
        InvalidAsset: A layer cannot be read, is empty, or has more prims than any bench.
    """
    waiting, seen, places = [path], {path}, places_of(path)
    all_text, size = True, 0
    while waiting and len(seen) < LAYER_LIMIT:
        layer = waiting.pop()
        text = read_layer(layer)
        if not text:
            raise InvalidAsset(f"An asset must be a USD file; {layer} is empty.")
        if not text.startswith(b"#usda"):
            all_text = False
            continue
        size += len(text)
        if size > TEXT_LIMIT:
            raise InvalidAsset(
                f"An asset's text layers have at most {TEXT_LIMIT} bytes; with {layer} there are "
                f"{size}. Write what is large as .usdc: usdcat --out NAME.usdc NAME.usda."
            )
        if text.count(b"{") > BRACE_LIMIT:
            raise InvalidAsset(
                f"An asset must be a USD file of at most {BRACE_LIMIT} prims; {layer} opens "
                f"{text.count(b'{')} braces."
            )
        for name in REFERENCE.findall(text):
            below = below_of(layer, name.decode("utf-8", "replace"), path, places)
            if below not in seen and is_file(below):
                seen.add(below)
                waiting.append(below)
    return all_text and not waiting


def read_layer(path: Path) -> bytes:
    """Return the bytes of a layer."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise InvalidAsset(
            f"An asset must be a USD file; {path} cannot be read: {error.strerror or error}."
        ) from error
