"""An MJCF or URDF file as one text that names no other file, so that no library opens one."""

import os
import posixpath
import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

from tendon_newton.data.files.text_file import read_text
from tendon_newton.errors import InvalidAsset, shown
from tendon_newton.mechanisms.asset_library import is_file

SIZE_LIMIT = 8_000_000  # Bytes of a file of joints and links with all that it includes
LEAST_SIZE = 8_000  # Bytes that each file counts at least, so that no more than a thousand are read
JOINT_LIMIT = 1000  # Joints of a file that we read; a hand has some dozens
PROMISE = "an MJCF or URDF file includes such files"
NAMES = ("file", "filename", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
"""Attributes that name files."""
SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")
NOT_A_NUMBER = re.compile(r"(?:^|\s)[+-]?nan(?:\s|$)", re.IGNORECASE)
PACKAGES = ("package", "model")  # Schemes of names that lie in packages of ROS
LEFT_OUT = ("mesh", "hfield", "skin", "texture", "model")  # Elements that come from files
LEFT_OUT_KINDS = ("mesh", "hfield", "sdf")  # Values of a geom's type, and its attributes


@dataclass(frozen=True, kw_only=True)
class ForeignText:
    """What is left of a file."""

    text: str
    meshes: int  # Shapes that come from files, which were left out


def closed_text(path: Path) -> ForeignText:
    """Return a file with what it includes and without meshes, pictures and other files' names.

    Raises:
        InvalidAsset: A file is broken, too large or not in the folder, a name is a URL or leads
            away, joints are coupled, or a link's inertia would come from its mesh.
    """
    try:
        root = read_tree(path, path, [SIZE_LIMIT])
        folder = next((c.get("meshdir", c.get("assetdir")) for c in root.iter("compiler")), None)
        for element in root.iter():
            for key, value in list(element.items()):
                if key in NAMES:
                    refuse_elsewhere(path, element.tag, posixpath.join(folder or "", value))
                    del element.attrib[key]
                elif NOT_A_NUMBER.search(value):
                    raise InvalidAsset(f"{path}: <{element.tag} {key}> must be numbers; {value!r}")
        if (joints := sum(1 for _ in root.iter("joint"))) > JOINT_LIMIT:
            raise InvalidAsset(f"{path}: has at most {JOINT_LIMIT} joints; there are {joints}")
        refuse_couplings(path, root)
        refuse_unknown_inertia(path, root)
        meshes = leave_out(root)
        return ForeignText(text=ET.tostring(root, encoding="unicode"), meshes=meshes)
    except (ET.ParseError, RecursionError) as error:
        raise InvalidAsset(f"Newton cannot read {path}: it is no XML: {error}") from error


def read_tree(main: Path, file: Path, left: list[int], above: tuple[Path, ...] = ()) -> ET.Element:
    """Return the elements of a file, those of what it includes in their places.

    Args:
        main: The file that is imported; files in its folder may be included.
        left: Bytes that may still be read, counted down here.
        above: Files that include this one.
    """
    text = read_text(file, InvalidAsset, PROMISE, size_limit=left[0])
    left[0] -= max(len(text), LEAST_SIZE)
    if "<!ENTITY" in text:
        raise InvalidAsset(
            f"{file}: an MJCF or URDF file needs no entities; write what they stand for"
        )
    root = ET.fromstring(text)
    for parent in list(root.iter()):
        for place, element in reversed(list(enumerate(parent))):
            if element.tag != "include":
                continue
            below = included(main, file, element.get("file", ""))
            if below in (file, *above):
                raise InvalidAsset(f"{file}: a file must not include itself; {below.name} does")
            parent[place : place + 1] = list(read_tree(main, below, left, (file, *above)))
    return root


def included(main: Path, file: Path, name: str) -> Path:
    """Return the file that is included: beside the imported one, or beside the including one."""
    home, folders = os.path.realpath(main.parent), (main.parent, file.parent)
    for below in (folder / name for folder in folders):
        if os.path.commonpath((home, os.path.realpath(below))) != home:
            raise InvalidAsset(
                f"{file}: an included file must lie in the folder of {main.name}; it is "
                f"{shown(name)}: copy it there"
            )
        if is_file(below):
            return below
    raise InvalidAsset(f"{file}: an included file must be there; {shown(name)} is not")


def refuse_elsewhere(path: Path, tag: str, name: str) -> None:
    """Refuse a name that is a URL, absolute, or leads out of the folder above the file's own."""
    scheme = SCHEME.match(name)
    if scheme is not None and scheme[1].lower() in PACKAGES:
        return
    away = posixpath.normpath(name.replace("\\", "/"))
    if scheme is not None or away.startswith(("/", "~", "../..")):
        raise InvalidAsset(
            f"{path}: what a file names lies beside it; <{tag}> names {shown(name)}: copy it there "
            "and write its name alone, or take the element out"
        )


def refuse_couplings(path: Path, root: ET.Element) -> None:
    """Refuse a URDF's mimic and an MJCF's equality: an asset's joints would be free of them."""
    for parent in (*root.findall("joint"), *root.findall("equality")):
        for element in parent.findall("mimic") if parent.tag == "joint" else parent:
            if element.get("active", "true") != "true":
                continue
            words = ET.tostring(element, encoding="unicode").strip().strip("</>")
            which = shown(parent.get("name", "")) if parent.tag == "joint" else "them"
            raise InvalidAsset(
                f"{path}: joints of an asset are coupled by strings alone; the file couples "
                f"{which} by <{words:.100}>, without which they would move freely: take it out if "
                "it may go, and give the string an arm at each joint (--moment-arm) if it is one "
                "that couples them"
            )


def refuse_unknown_inertia(path: Path, root: ET.Element) -> None:
    """Refuse links that move and whose mass would be that of a mesh, which is not read."""
    compilers = root.iter("compiler")
    inferred = any(c.get("inertiafromgeom", "").lower() == "true" for c in compilers)
    for link in moving_links(root):
        stated = link.find("inertial") is not None and not inferred
        shapes = (*link.findall("geom"), *link.findall("collision/geometry/mesh"))
        if not stated and any(shape.tag == "mesh" or comes_from_file(shape) for shape in shapes):
            raise InvalidAsset(
                f"{path}: meshes are not read; {link.get('name', 'a link')!r} has its mass from "
                "one: write an <inertial> with mass and inertia into it"
            )


def moving_links(root: ET.Element) -> list[ET.Element]:
    """Return the links or bodies that some joint moves."""
    carried, moved = defaultdict[str | None, list[str | None]](list), set[str | None]()
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            carried[parent.get("link")].append(child.get("link"))
            moved |= {child.get("link")} if joint.get("type") != "fixed" else set()
    names = [*moved]
    while names:
        further = [name for name in carried[names.pop()] if name not in moved]
        moved.update(further)
        names += further
    found = [link for link in root.findall("link") if link.get("name") in moved]
    waiting = [(body, False) for world in root.findall("worldbody") for body in world]
    while waiting:
        body, moves = waiting.pop()
        moves = moves or any(part.tag in ("joint", "freejoint") for part in body)
        waiting += [(part, moves) for part in body if part.tag in ("body", "frame")]
        if moves and body.tag == "body":
            found.append(body)
    return found


def comes_from_file(geom: ET.Element) -> bool:
    """Tell whether the shape of an MJCF geom is a mesh or a field of heights."""
    return geom.get("type") in LEFT_OUT_KINDS or any(kind in geom.attrib for kind in LEFT_OUT_KINDS)


def leave_out(root: ET.Element) -> int:
    """Take out what comes from files, and return how many shapes did."""
    meshes = 0
    for parent in root.iter():
        for element in list(parent):
            shape = element.tag == "geom" and comes_from_file(element)
            if shape or element.tag in LEFT_OUT:
                parent.remove(element)
                meshes += shape or parent.tag == "geometry"
    return meshes
