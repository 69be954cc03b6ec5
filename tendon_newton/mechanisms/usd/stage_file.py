"""Opening a USD file that may be anybody's.

The parser believes the sizes that a binary layer claims, and may take gigabytes or die of them.
An asset with such a layer is therefore first opened in a process of its own.
"""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import re
from collections.abc import Generator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from tendon_newton.data.files.guarded import TooMuch, guarded
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.asset_library import is_file

# Bytes that opening an asset with binary layers may take; those of a hand take a tenth
MEMORY = 1 << 29
# Prims of a stage that we read; a hand has some hundreds, and validators take 0.2 ms for each
PRIM_LIMIT = 5000
REASON_LENGTH = 500  # Most that is repeated of what USD says [characters]


def open_stage(path: Path) -> Any:
    """Open a USD stage, or say why it cannot be read."""
    if not check_layers(path):
        try:
            guarded(try_open, str(path.absolute()), memory=MEMORY)
        except TooMuch as error:
            raise InvalidAsset(f"An asset must be a USD file; opening {path} {error}.") from error
    return opened(path)


def try_open(path: str) -> None:
    """Open a stage, for the errors that come of it."""
    opened(Path(path))


def opened(path: Path) -> Any:
    """Return a stage whose names and values can be read."""
    from pxr import Usd

    with usd_errors(path):
        stage = Usd.Stage.Open(str(path))
        stage.Reload()  # USD keeps layers in memory; one may have been edited since
    if sum(1 for _ in islice(stage.Traverse(), PRIM_LIMIT + 1)) > PRIM_LIMIT:
        raise InvalidAsset(f"An asset has at most {PRIM_LIMIT} prims; {path} has more.")
    refuse_other_text(stage)
    return stage


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
REFERENCE = re.compile(rb"@([^@\n]{1,1000})@")


def check_layers(path: Path) -> bool:
    """Refuse an asset whose text layers cannot be parsed within reason.

    Returns:
        Whether all layers that were seen are text; binary ones are not looked into.

    Raises:
        InvalidAsset: A layer cannot be read, is empty, or has more prims than any bench.
    """
    waiting, seen = [path], {path}
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
            below = layer.parent / name.decode("utf-8", "replace")
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
