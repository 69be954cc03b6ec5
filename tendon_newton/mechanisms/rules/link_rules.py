"""Rules for links: mass, inertia, centre of mass, tip."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterator
from typing import Any

import numpy as np

from tendon_newton.mechanisms.rules.rule_findings import AssetFinding, about
from tendon_newton.mechanisms.usd.usd_route import stated

# What the rules read of a link, and what counts where it has none
LINK = {
    "physics:mass": 0.0,
    "physics:diagonalInertia": (0.0, 0.0, 0.0),
    "physics:principalAxes": None,
    "physics:centerOfMass": None,
}
# Masses that a bench on a table has [kg]; outside, grams or millimetres slipped in
MASS_RANGE = (1.0e-4, 10.0)
# Distance of a centre of mass from its link's frame [m] that no bench on a table exceeds, and share
# of what is drawn of a link [1] by which neither centre nor site lies beside it; motors that nobody
# draws bring it to a tenth of that
REACH, BESIDE = 0.5, 0.25
GYRATION_LIMIT = 0.3  # Radius of gyration [m] that no link of a bench on a table exceeds


def link_findings(stage: Any) -> Iterator[AssetFinding]:
    """Apply every rule for links to a stage."""
    for prim in stage.Traverse():
        if is_link(prim):
            link = stated(prim, LINK)
            yield from _check_mass(prim, link)
            yield from _check_inertia(prim, link)
            yield from _check_center(prim, link["physics:centerOfMass"])
            yield from _check_drawn(prim, link)
    yield from _check_tip(stage)


def is_link(prim: Any) -> bool:
    """Tell whether a prim is a rigid body that may move."""
    return "PhysicsRigidBodyAPI" in prim.GetAppliedSchemas()


def _check_mass(prim: Any, link: dict[str, Any]) -> Iterator[AssetFinding]:
    mass = float(link["physics:mass"])
    if "PhysicsMassAPI" not in prim.GetAppliedSchemas():
        yield about(prim, "mass").error(
            "a link has its own mass; PhysicsMassAPI is not applied",
            'Add "PhysicsMassAPI" to its apiSchemas and write physics:mass',
        )
    elif not mass > 0.0:
        yield about(prim, "mass").error(
            f"a link's mass must be positive; it is {mass:g} kg", "Write physics:mass in kilograms"
        )
    elif not MASS_RANGE[0] <= mass <= MASS_RANGE[1]:
        yield about(prim, "mass").warning(
            f"a bench's link weighs 0.1 g to 10 kg; this one {mass:g} kg",
            "Check the unit of physics:mass: kilograms",
        )


def _check_inertia(prim: Any, link: dict[str, Any]) -> Iterator[AssetFinding]:
    moments = sorted(float(x) for x in link["physics:diagonalInertia"])
    if not moments[0] > 0.0:
        yield about(prim, "inertia").error(
            f"principal moments of inertia must be positive; they are {moments}",
            "Write physics:diagonalInertia in kg m^2",
        )
        return
    if moments[0] + moments[1] < moments[2] * (1.0 - 1e-6):  # float32 slack of a thin rod
        yield about(prim, "inertia").error(
            f"no principal moment of inertia may exceed the sum of the others; they are {moments}",
            "Check physics:diagonalInertia against the link's shape",
        )
    axes = link["physics:principalAxes"]
    if axes is not None and abs(float(axes.GetLength()) - 1.0) > 1e-3:
        yield about(prim, "inertia").error(
            "physics:principalAxes must be a rotation, a quaternion "
            f"of length 1; its length is {float(axes.GetLength()):.3g}",
            "Write (1, 0, 0, 0) where the moments are along the axes",
        )


def _check_center(prim: Any, center: Any) -> Iterator[AssetFinding]:
    if center is None:
        yield about(prim, "center_of_mass").warning(
            "a link gives physics:centerOfMass; it is missing, and its frame's origin is used",
            "Write physics:centerOfMass in metres, in the link's frame",
        )


def _check_drawn(link: Any, numbers: dict[str, Any]) -> Iterator[AssetFinding]:
    """Compare centre of mass, inertia and sites with what is drawn of a link, or with its frame."""
    from pxr import Gf, Usd, UsdGeom

    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), UsdGeom.Imageable.GetOrderedPurposeTokens())
    center = numbers["physics:centerOfMass"]
    box, places = Gf.Range3d(), [(link, "center_of_mass", "physics:centerOfMass", center)]
    for prim in (prim for prim in Usd.PrimRange(link) if _carrier(prim) == link):
        bound = cache.ComputeRelativeBound(prim, link)
        if is_site(prim):
            rule = "tip" if prim.GetName() == "tip" else "tendon_path"
            places.append((prim, rule, "xformOp:translate", bound.ComputeCentroid()))
        elif prim.IsA(UsdGeom.Gprim):
            box.UnionWith(bound.ComputeAlignedRange())
    drawn = not box.IsEmpty()
    low, high = (np.array(box.GetMin()), np.array(box.GetMax())) if drawn else np.zeros((2, 3))
    size = float(np.linalg.norm(high - low))
    for prim, rule, name, place in places:
        beside = 0.0 if place is None else np.linalg.norm(place - np.clip(place, low, high))
        if beside > (BESIDE * size if drawn else REACH):
            what = "the centre of mass" if prim == link else prim.GetName()
            where = f"the {size:.3g} m that are drawn of it" if drawn else "its frame"
            yield about(prim, rule).warning(
                f"{what} of {link.GetName()} lies in {where}; it is {beside:.3g} m beside",
                f"Check {name}: metres in the link's frame",
            )
    mass, most = float(numbers["physics:mass"]), max(numbers["physics:diagonalInertia"])
    apart = (most / mass) ** 0.5 if mass > 0.0 and most > 0.0 else 0.0
    if apart > (limit := (0.5 + BESIDE / 2.0) * size if drawn else GYRATION_LIMIT):
        yield about(link, "inertia").warning(
            f"the largest moment of inertia, {most:g} kg m^2, is that of {mass:g} kg at {apart:.3g}"
            f" m from the centre; no part of {link.GetName()} is farther than {limit:.3g} m",
            "Check the unit of physics:diagonalInertia: kg m^2; a rod has m L^2 / 12",
        )


def _carrier(prim: Any) -> Any:
    """Return the link that a prim is a part of; nothing valid where it is a part of the base."""
    while prim and not is_link(prim):
        prim = prim.GetParent()
    return prim


def is_site(prim: Any) -> bool:
    """Tell whether a prim is a site; `GetAppliedSchemas` leaves out schemas unknown to USD."""
    return "MjcSiteAPI" in prim.GetPrimTypeInfo().GetAppliedAPISchemas()


def _check_tip(stage: Any) -> Iterator[AssetFinding]:
    tips = [prim for prim in stage.Traverse() if prim.GetName() == "tip"]
    sites = [prim for prim in tips if is_site(prim)]
    for prim in tips:
        if prim not in sites:
            yield about(prim, "tip").warning(
                "the tip is a site; MjcSiteAPI is not applied",
                'Write prepend apiSchemas = ["MjcSiteAPI"], or another name',
            )
    for prim in sites[1:]:
        yield about(prim, "tip").warning(
            f"a mechanism has one tip; {sites[0].GetPath()} is one too", "Rename one of them"
        )
