"""A USD layer of overrides above an asset: the numbers of a corrected mechanism."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import degrees, radians
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.text_file import write_text
from tendon_newton.mechanisms.authoring.correction import Correction
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon
from tendon_newton.mechanisms.usd.stage_file import open_stage, take_units, usd_errors
from tendon_newton.mechanisms.usd.usd_tendon import TENDON_NUMBERS

NUMBERS = "tendon_newton"  # Key of the model's numbers in the layer's ``customLayerData``
LONGER = "longer"  # Ending of a translation by which a part of a longer link moves
RELATIVE = 1.0e-9  # Difference of a number that is none [1]: the rest of the arithmetic

# Prim, attribute, name of its type in `Sdf.ValueTypeNames`, and value
Overrides = Iterator[tuple[str, str, str, Any]]
# Effect -> parameter -> value and unit, of all effects of a model, with a place in USD or not
Numbers = Mapping[str, Mapping[str, tuple[float, str]]]


def write_corrected_layer(path: Path, correction: Correction, numbers: Numbers) -> None:
    """Write the layer; it holds overrides only and names the asset as its sublayer.

    A file that is there is replaced.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    from pxr import Sdf, Usd

    asset = correction.asset.asset
    base = open_stage(asset)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.subLayerPaths.append(str(asset))
    with usd_errors(asset):
        stage = Usd.Stage.Open(layer)
        for prim, name, kind, value in overrides(correction, base):
            attribute = stage.GetPrimAtPath(prim).GetAttribute(name)
            if not attribute:
                type_name = getattr(Sdf.ValueTypeNames, kind)
                attribute = stage.OverridePrim(prim).CreateAttribute(name, type_name, False)
            attribute.Set(value)
    take_units(layer, base)
    layer.customLayerData = {NUMBERS: numbers_table(correction, numbers)}
    del stage  # an open one looks at once for what the next line says, from a layer without a place
    nearby = os.path.relpath(asset, path.resolve().parent)
    layer.subLayerPaths[0] = Path(nearby).as_posix()
    write_text(path, layer.ExportToString())


def overrides(correction: Correction, stage: Any) -> Overrides:
    """Yield every number that differs; the stage is the asset's."""
    before, after = correction.asset, correction.corrected
    for old, new in zip(before.joints, after.joints, strict=True):
        yield from joint_overrides(old, new)
        yield from link_overrides(stage, old, new)
    for old, new in zip(before.tendons, after.tendons, strict=True):
        yield from tendon_overrides(stage, before.joints, old, new)
    yield from moved_parts(stage, before, after)
    scenes = [str(p.GetPath()) for p in stage.Traverse() if p.GetTypeName() == "PhysicsScene"]
    if scenes and differs(before.gravity, after.gravity):
        size = float(np.linalg.norm(after.gravity))
        direction = tuple(float(x) for x in after.gravity / size)
        yield scenes[0], "physics:gravityDirection", "Vector3f", direction
        yield scenes[0], "physics:gravityMagnitude", "Float", size


def joint_overrides(old: Joint, new: Joint) -> Overrides:
    """Yield the numbers of a joint; USD counts a revolute one's range and damping in degrees."""
    turns = new.kind == "revolute"
    angle: Callable[[float], float] = degrees if turns else float
    slope: Callable[[float], float] = radians if turns else float
    if differs(old.stiffness, new.stiffness):
        yield new.prim, "mjc:stiffness", "Double", new.stiffness
    if differs(old.damping, new.damping):
        yield new.prim, "newton:damping", "Float", slope(new.damping)
    if differs(old.friction, new.friction):
        yield new.prim, "newton:friction", "Float", new.friction
    if differs(old.limits[1], new.limits[1]):
        yield new.prim, "physics:upperLimit", "Float", angle(new.limits[1])


def link_overrides(stage: Any, old: Joint, new: Joint) -> Overrides:
    """Yield what a link weighs, where, and what it resists."""
    from pxr import Gf

    link = link_of(stage, old).GetPath()
    if differs(old.mass, new.mass):
        yield str(link), "physics:mass", "Float", new.mass
    if differs(old.center_of_mass, new.center_of_mass):
        centre = Gf.Vec3f(*new.center_of_mass.tolist())
        yield str(link), "physics:centerOfMass", "Point3f", centre
    if differs(old.inertia, new.inertia):
        moments, axes = np.linalg.eigh(new.inertia)
        axes *= np.sign(np.linalg.det(axes))  # a rotation, no mirror
        turn = Gf.Matrix3d(axes.T.tolist()).ExtractRotation().GetQuat()
        yield str(link), "physics:diagonalInertia", "Float3", Gf.Vec3f(*moments.tolist())
        yield str(link), "physics:principalAxes", "Quatf", Gf.Quatf(turn)


def link_of(stage: Any, joint: Joint) -> Any:
    """Return the prim of the link that a joint moves."""
    (link,) = stage.GetPrimAtPath(joint.prim).GetRelationship("physics:body1").GetTargets()
    return stage.GetPrimAtPath(link)


def moved_parts(stage: Any, before: Mechanism, after: Mechanism) -> Overrides:
    """Yield the places of joints, links and what lies in these, where links are longer."""
    from pxr import Gf, UsdGeom

    cache = UsdGeom.XformCache()
    frames = [cache.GetLocalToWorldTransform(link_of(stage, joint)) for joint in before.joints]
    links = {str(link_of(stage, joint).GetPath()): j for j, joint in enumerate(before.joints)}
    shifts: list[Any] = []  # of each link, in the world [m]
    for old, new in zip(before.joints, after.joints, strict=True):
        shift = Gf.Vec3d(*(new.parent_position - old.parent_position).tolist())
        if shift.GetLength() > 0.0:
            place = stage.GetPrimAtPath(old.prim).GetAttribute("physics:localPos0").Get()
            yield old.prim, "physics:localPos0", "Point3f", place + Gf.Vec3f(shift)
        if old.parent >= 0:
            shift = shifts[old.parent] + frames[old.parent].TransformDir(shift)
        shifts.append(shift)

    def moved(prim: Any) -> Any:
        """Return by how much a prim moves in the world [m]."""
        link = prim
        while link and str(link.GetPath()) not in links:
            link = link.GetParent()
        if not link:
            return Gf.Vec3d()
        j = links[str(link.GetPath())]
        old, new = before.joints[j], after.joints[j]
        if link == prim or old.length is None or new.length is None:
            return shifts[j]
        place = cache.GetLocalToWorldTransform(prim).ExtractTranslation()
        reach = frames[j].GetInverse().Transform(place) - Gf.Vec3d(*old.child_position.tolist())
        return shifts[j] + frames[j].TransformDir(reach * (new.length / old.length - 1.0))

    for prim in stage.Traverse():
        if own := UsdGeom.Xformable(prim):
            above = stage.GetPseudoRoot() if own.GetResetXformStack() else prim.GetParent()
            frame = cache.GetLocalToWorldTransform(above).GetInverse()
            by = frame.TransformDir(moved(prim) - moved(above))
            if by.GetLength() > 0.0:
                yield from translated(own, by)


def translated(part: Any, by: Any) -> Overrides:
    """Yield the place of a part that moves in the frame above it."""
    prim, operations = str(part.GetPrim().GetPath()), part.GetOrderedXformOps()
    if operations and operations[0].GetOpName() == "xformOp:translate":
        place = operations[0].Get()
        yield prim, "xformOp:translate", "Double3", place + type(place)(by)
        return
    order = [f"xformOp:translate:{LONGER}", *(each.GetOpName() for each in operations)]
    yield prim, order[0], "Double3", by
    yield (
        prim,
        "xformOpOrder",
        "TokenArray",
        ["!resetXformStack!"] * part.GetResetXformStack() + order,
    )


def tendon_overrides(stage: Any, joints: Sequence[Joint], old: Tendon, new: Tendon) -> Overrides:
    """Yield the numbers of a tendon."""
    for name, (key, _) in TENDON_NUMBERS.items():
        if differs(getattr(old, name), getattr(new, name)):
            yield new.prim, key, "Double", getattr(new, name)
    if new.route is None and differs(old.moment_arm, new.moment_arm):
        prim = stage.GetPrimAtPath(old.prim)
        arm = {j.prim: float(a) for j, a in zip(joints, new.moment_arm, strict=True)}
        targets = [str(target) for target in prim.GetRelationship("mjc:path").GetTargets()]
        places = prim.GetAttribute("mjc:path:indices").Get() or range(len(targets))
        yield new.prim, "mjc:path:coef", "DoubleArray", [arm[targets[i]] for i in places]


def differs(old: Any, new: Any) -> bool:
    """Tell whether a number, or one of several, is another."""
    return not np.allclose(old, new, rtol=RELATIVE, atol=0.0)


def numbers_table(correction: Correction, numbers: Numbers) -> dict[str, Any]:
    """Return what of a model stands in the layer and what has no place there, as USD holds it."""
    tables = {
        effect: {name: {"value": value, "unit": unit} for name, (value, unit) in own.items()}
        for effect, own in numbers.items()
    }
    return {
        "in_this_layer": {name: tables.get(name, {}) for name in correction.applied},
        "not_in_usd": {name: tables.get(name, {}) for name in correction.left},
    }
