"""A look at the layers of an asset as plain files, before USD's parser sees them.

The parser descends into braces by recursion and ends the whole process where they are too deep, so
that what no bench needs is refused by counting.
"""

from __future__ import annotations

import re
from pathlib import Path

from tendon_newton.errors import InvalidAsset

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


def is_file(path: Path) -> bool:
    """Tell whether a path is a file; a name that no file system takes is none."""
    try:
        return path.is_file()
    except OSError:
        return False
