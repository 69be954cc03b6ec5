"""Files that are no asset, or too much of one: a clear error or finding, quickly, no traceback."""

import os
from collections.abc import Callable
from pathlib import Path
from time import process_time

import pytest

from tendon_newton.cli import main
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.usd.stage_file import open_stage
from tests.mechanisms.broken.flat_assets import flat_text

LIMIT = 10.0  # Time of a core in which an answer must come [s]
HEAD = '#usda 1.0\n(\n    defaultPrim = "finger"\n    upAxis = "Z"\n    metersPerUnit = 1\n)\n'
BASE = 'def Xform "base"'

Damage = Callable[[Path], Path]


def content(name: str, data: bytes) -> Damage:
    """A file of these bytes."""

    def write(folder: Path) -> Path:
        (folder / name).write_bytes(data)
        return folder / name

    return write


def arc(reference: str) -> Damage:
    """The finger whose base also composes something else."""
    return lambda folder: content(
        "finger.usda", flat_text("finger").replace(BASE, f"{BASE} ({reference})").encode()
    )(folder)


def crowd(kind: str, count: int) -> Damage:
    """The finger with many more prims: 7 MB of text, a little less than may be read."""
    prims = "".join(f'def {kind} "p{n}"\n{{\ndouble size = 1\n}}\n' for n in range(count))

    def write(folder: Path) -> Path:
        inside = f'def Scope "crowd"\n{{\n{prims}}}\n{BASE}'
        return content("finger.usda", flat_text("finger").replace(BASE, inside).encode())(folder)

    return write


def truncated(folder: Path) -> Path:
    """The finger's first half."""
    text = flat_text("finger")
    return content("finger.usda", text[: len(text) // 2].encode())(folder)


def binary(folder: Path) -> Path:
    """A binary asset with its middle overwritten."""
    path = folder / "finger.usdc"
    open_stage(asset_path("finger")).Flatten().Export(str(path))
    data = bytearray(path.read_bytes())
    third = len(data) // 3
    data[third : 2 * third] = (bytes(range(256)) * (third // 256 + 1))[:third]
    path.write_bytes(bytes(data))
    return path


def deep_below(folder: Path) -> Path:
    """An asset whose sublayer would take USD's parser, and the process with it, down."""
    count = 100_000
    content("deep.usda", (HEAD + 'def Xform "a"\n{\n' * count + "}\n" * count).encode())(folder)
    text = HEAD.replace("upAxis", "subLayers = [@./deep.usda@]\n    upAxis")
    return content("finger.usda", text.encode())(folder)


def cycle_of_two(folder: Path) -> Path:
    """Two layers, each the other's sublayer."""
    for name, other in (("finger", "other"), ("other", "finger")):
        text = HEAD.replace("upAxis", f"subLayers = [@./{other}.usda@]\n    upAxis")
        content(f"{name}.usda", text.encode())(folder)
    return folder / "finger.usda"


def in_its_place(put: Callable[[Path], object]) -> Damage:
    """Something that is no regular file under an asset's name."""

    def write(folder: Path) -> Path:
        put(folder / "finger.usda")
        return folder / "finger.usda"

    return write


# what is written -> exit code and what is said
CASES: dict[str, tuple[Damage, int, str]] = {
    "empty": (content("finger.usda", b""), 2, "is empty"),
    "zero bytes": (content("finger.usda", bytes(1000)), 2, "must be a USD file"),
    "junk": (content("finger.usda", bytes(range(256)) * 50), 2, "must be a USD file"),
    "UTF-16": (content("finger.usda", HEAD.encode("utf-16")), 2, "must be a USD file"),
    "a name in another encoding": (content("finger.usda", b'#usda 1.0\ndef "a\xff" {}\n'), 2,
        "text that is not UTF-8"),
    "a value in another encoding": (content("finger.usda",
        HEAD.encode() + b'def Xform "finger" { string note = "\xff" }\n'), 2,
        "text that is not UTF-8"),
    "a reference in another encoding": (content("finger.usda",
        HEAD.encode() + b'def "finger" (references = @./a\xff.usda@) {}\n'), 2,
        "text that is not UTF-8"),
    "a picture": (content("finger.usd", b"\x89PNG\r\n\x1a\n" + bytes(500)), 2,
        "must be a USD file"),
    "junk in a binary": (binary, 2, "finger.usdc"),
    "a binary's head": (content("finger.usdc", b"PXR-USDC" + bytes(range(256))), 2,
        "must be a USD"),
    "text in a binary": (content("finger.usdc", HEAD.encode()), 2, "must be a USD file"),
    "text in a package": (content("finger.usdz", HEAD.encode()), 2, "must be a USD file"),
    "a broken archive": (content("finger.usdz", b"PK\x03\x04" + bytes(300)), 2,
        "must be a USD file"),
    "half a file": (truncated, 2, "must be a USD file"),
    "a foreign version": (content("finger.usda", b"#usda 9.9\n"), 2, "must be a USD file"),
    "no prims": (content("finger.usda", HEAD.encode()), 1, "default_prim"),
    "an unclosed brace": (content("finger.usda", (HEAD + 'def Xform "finger"\n{').encode()), 2,
        "USD"),
    "a million braces": (content("finger.usda", (HEAD + 1_000_000 * "{").encode()), 2, "braces"),
    "nesting that ends a process": (content("finger.usda",
        (HEAD + 'def Xform "a"\n{\n' * 100_000 + "}\n" * 100_000).encode()), 2,
        "opens 100000 braces"),
    "the same in a sublayer": (deep_below, 2, "deep.usda opens 100000 braces"),
    "7 MB of prims": (crowd("Xform", 180_000), 2, "at most 20000 prims"),
    "more prims than a hand": (crowd("Xform", 6000), 2, "at most 5000 prims"),
    "7 MB of comment": (content("finger.usda", (HEAD + "# x" * 2_500_000).encode()), 1,
        "default_prim"),
    "a reference to itself": (arc("references = </finger>"), 1, "must not lead back"),
    "a reference to its own file": (arc("references = @./finger.usda@"), 1, "must not lead back"),
    "sublayers in a circle": (cycle_of_two, 1, "must not lead back"),
    "a missing payload": (arc("payload = @./nowhere.usda@"), 1, "every layer must be found"),
    "a missing reference": (arc("references = @./nowhere.usda@"), 1, "every layer must be found"),
    "a reference to the web": (arc("references = @https://example.com/finger.usda@"), 2,
        "lies in the folder above its own"),
    "a reference with a line of 5 kB": (arc(f"references = @./{5000 * 'x'}.usda@"), 1,
        "every layer must be found"),
    "a reference to a missing prim": (arc("references = @./finger.usda@</no>"), 1, "composition"),
    "a folder": (in_its_place(Path.mkdir), 2, "does not exist"),
    "a loop": (in_its_place(lambda path: path.symlink_to(path.name)), 2, "does not exist"),
    "a pipe": (in_its_place(os.mkfifo), 2, "does not exist"),
    "unreadable": (in_its_place(lambda path: path.symlink_to("/proc/self/mem")), 2,
        "cannot be read"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_file_that_is_no_asset_is_answered_quickly(case, tmp_path, capsys) -> None:
    """Exit code 2 and one line, or 1 and a finding where USD could open it."""
    damage, code, said = CASES[case]
    path = damage(tmp_path)
    began = process_time()
    assert main(["asset", "check", str(path)]) == code
    assert process_time() - began < LIMIT
    printed = capsys.readouterr()
    assert said in printed.out + printed.err
    if code == 2:
        (line,) = printed.err.splitlines()
        assert line.startswith("error: ")
        assert len(line) < 1500
    assert main(["asset", "show", str(path), "--out", str(tmp_path / "picture.png")]) == 2
