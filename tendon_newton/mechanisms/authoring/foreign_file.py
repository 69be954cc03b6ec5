"""MJCF and URDF files, read by Newton."""

import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import newton
import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidAsset, listed
from tendon_newton.mechanisms.authoring.asset_plan import NAME
from tendon_newton.mechanisms.authoring.foreign_text import closed_text
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.usd.stage_file import REASON_LENGTH
from tendon_newton.mechanisms.usd.usd_asset import read_gravity, read_joints
from tendon_newton.mechanisms.usd.usd_tendon import register_tendon_attributes

SUFFIXES = (".xml", ".mjcf", ".urdf")
TAKEN = ("base", "joints", "tendons", "scene")  # Names that prims of every imported asset have


@dataclass(frozen=True, kw_only=True)
class ForeignFinger:
    """Content of a foreign file, before anything is added."""

    source: Path
    joints: tuple[Joint, ...]
    links: tuple[str, ...]
    gravity: Array
    # Joint whose link has the site named ``tip``, and its place there [m]
    tip: tuple[int, Array] | None
    meshes: int  # Shapes that were left out, since they come from other files


def read_foreign(path: Path) -> ForeignFinger:
    """Let Newton read an MJCF or URDF file; its base is fixed, its fixed joints are merged.

    Raises:
        InvalidAsset: The file is of neither kind, is broken, or is no tree of hinges and slides.
    """
    if path.suffix not in SUFFIXES:
        raise InvalidAsset(f"{path}: a file to import ends with {listed(SUFFIXES)}")
    if not path.is_file():
        raise InvalidAsset(f"{path}: an MJCF or URDF file is imported; there is none")
    source = closed_text(path)
    builder = newton.ModelBuilder()
    register_tendon_attributes(builder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that are not imported anyway
        try:
            if path.suffix == ".urdf":
                builder.add_urdf(source.text, floating=False, collapse_fixed_joints=True)
            else:
                builder.add_mjcf(source.text, parse_meshes=False, collapse_fixed_joints=True)
        except Exception as error:  # Newton raises whatever its code meets in a strange file
            reason = " ".join(str(error).split())[:REASON_LENGTH]
            raise InvalidAsset(f"Newton cannot read {path}: {reason}") from error
    joints = read_joints(builder, path)
    if not joints:
        raise InvalidAsset(f"{path}: a finger has joints; Newton found none")
    refuse_no_numbers(path, joints)
    return ForeignFinger(
        source=path,
        joints=joints,
        links=unique([word(label) for label in builder.body_label], TAKEN),
        gravity=read_gravity(builder),
        tip=site_named_tip(builder),
        meshes=source.meshes,
    )


def refuse_no_numbers(path: Path, joints: tuple[Joint, ...]) -> None:
    """Refuse joints with numbers that are none; ranges may be without an end."""
    for joint in joints:
        for name, value in vars(joint).items():
            if isinstance(value, float | tuple | np.ndarray) and not np.all(
                ~np.isnan(value) if name == "limits" else np.isfinite(value)
            ):
                raise InvalidAsset(f"{path}: {joint.name}: {name} must be finite; it is {value}")
        if not np.any(joint.axis):
            raise InvalidAsset(f"{path}: {joint.name}: its axis must be a direction")


def site_named_tip(builder: newton.ModelBuilder) -> tuple[int, Array] | None:
    """Return where a file has a site named ``tip`` on a link that moves."""
    for shape, label in enumerate(builder.shape_label):
        is_site = bool(builder.shape_flags[shape] & newton.ShapeFlags.SITE)
        named = label.rsplit("/", maxsplit=1)[-1] == "tip"
        if is_site and named and builder.shape_body[shape] >= 0:
            place = np.array(builder.shape_transform[shape])[:3].astype(np.float64)
            return int(builder.shape_body[shape]), place
    return None


def word(label: str) -> str:
    """Return the last part of a label as a prim's name."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", label.rsplit("/", maxsplit=1)[-1])
    return name if NAME.fullmatch(name) else f"part_{name}"[:64]


def unique(names: list[str], taken: tuple[str, ...]) -> tuple[str, ...]:
    """Number names that stand twice, or are taken."""
    out: list[str] = []
    for name in names:
        choice, number = name, 2
        while choice in out or choice in taken:
            choice, number = f"{name}_{number}", number + 1
        out.append(choice)
    return tuple(out)
