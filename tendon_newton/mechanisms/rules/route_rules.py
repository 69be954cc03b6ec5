"""Rules for the paths of routed tendons, in a USD stage."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.rules.chain import JOINT_TYPES, joints_below, movers
from tendon_newton.mechanisms.rules.link_rules import is_link
from tendon_newton.mechanisms.rules.rule_findings import AssetFinding, about
from tendon_newton.mechanisms.usd.usd_route import authored, path_targets, targets_of

# Two sites of a path closer than this [m] are one, and the string between has no direction
SAME_PLACE = 1.0e-5


def route_findings(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Apply every rule for the path of one routed tendon; later ones rely on those before."""
    for check in (_check_lists, _check_targets, _check_order, _check_pulleys, _check_places):
        findings = list(check(stage, prim))
        yield from findings
        if any(finding.severity == "error" for finding in findings):
            return
    yield from _check_chain(stage, prim)


def is_site(prim: Any) -> bool:
    """Tell whether a prim is a site, which a string may run through."""
    schemas = prim.GetPrimTypeInfo().GetAppliedAPISchemas()
    return "MjcSiteAPI" in schemas or "NewtonSiteAPI" in schemas


def _check_lists(_stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Check that the path is one line, and that what stands beside it agrees."""
    targets, sides = targets_of(prim, "mjc:path"), targets_of(prim, "mjc:sideSites")
    places = list(authored(prim, "mjc:path:indices", None) or range(len(targets)))
    side_of = list(authored(prim, "mjc:sideSites:indices", ()))
    if any(not 0 <= place < len(targets) for place in places):
        yield about(prim, "tendon_path").error(
            f"mjc:path:indices must count from 0 to {len(targets) - 1}; it is {places}",
            "Leave mjc:path:indices out, or count from 0",
        )
    if side_of and len(side_of) != len(places):
        yield about(prim, "tendon_path").error(
            f"mjc:sideSites:indices has one entry per place of the path; it has {len(side_of)} "
            f"for {len(places)}",
            "Write -1 for every place that is no pulley",
        )
    elif any(not -1 <= side < len(sides) for side in side_of):
        yield about(prim, "tendon_path").error(
            f"mjc:sideSites:indices must count mjc:sideSites from 0; it is {side_of}",
            "Write -1 for every place that is no pulley",
        )
    if len(authored(prim, "mjc:path:divisors", ())) or len(authored(prim, "mjc:path:segments", ())):
        yield about(prim, "tendon_path").error(
            "a string is one line from the spool to its end; mjc:path:segments divide it",
            "Leave mjc:path:segments and mjc:path:divisors out",
        )


def _check_targets(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Check that a path has sites, and nothing on it but sites and cylinders."""
    targets = path_targets(prim)
    for target in targets:
        there = stage.GetPrimAtPath(target.prim)
        if there and there.GetTypeName() in JOINT_TYPES:
            yield about(prim, "tendon_type").error(
                f"a routed tendon runs through sites; {target.prim} is a joint",
                'Write mjc:type = "fixed" and the moment arms as mjc:path:coef, or point mjc:path '
                "to sites",
            )
        elif not there or not (is_site(there) or there.GetTypeName() == "Cylinder"):
            yield about(prim, "tendon_path").error(
                "a routed tendon runs through sites and around cylinders that exist; "
                f"{target.prim} is neither",
                "Point mjc:path to prims with MjcSiteAPI and to Cylinders",
            )
    listed = targets_of(prim, "tendon:path")
    sites = [t.prim for t in targets if (p := stage.GetPrimAtPath(t.prim)) and is_site(p)]
    if listed and listed != sites:
        yield about(prim, "tendon_path").error(
            "tendon:path lists the sites of mjc:path in their order; the two differ",
            "Write the same sites into both",
        )
    if authored(prim, "tendon:direct", False):
        yield about(prim, "tendon_type").error(
            "a shaft turns a joint; one with tendon:direct cannot run through sites",
            'Write mjc:type = "fixed", or tendon:direct = false',
        )


def _check_order(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Check that every pulley stands between two sites."""
    kinds = [is_site(stage.GetPrimAtPath(target.prim)) for target in path_targets(prim)]
    if sum(kinds) < 2:
        yield about(prim, "tendon_path").error(
            f"a string has two ends; mjc:path has {sum(kinds)} sites",
            "Point mjc:path to the sites that the string runs through",
        )
    elif not (kinds[0] and kinds[-1]) or any(
        not here and not after for here, after in pairwise(kinds)
    ):
        yield about(prim, "tendon_path").error(
            "a site stands before and behind every pulley; one of the path's is at its end or next "
            "to another",
            "Add a site where the string leaves the one pulley for the other",
        )


def _check_pulleys(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Check that every pulley has a side on which the string passes."""
    for target in path_targets(prim):
        cylinder = stage.GetPrimAtPath(target.prim)
        if is_site(cylinder):
            continue
        radius = float(authored(cylinder, "radius", 1.0))
        side = stage.GetPrimAtPath(target.side) if target.side else None
        if not side or not is_site(side):
            yield about(prim, "pulley").error(
                f"a site says on which side of {target.prim} the string passes; there is none",
                "Name it in mjc:sideSites and mjc:sideSites:indices",
            )
        elif link_of(side) != link_of(cylinder):
            yield about(prim, "pulley").error(
                f"a side site moves with its pulley; {target.side} is on another link",
                f"Put it on the link of {target.prim}",
            )
        elif not radius > 0.0 or _off_axis(cylinder, side) <= radius:
            yield about(prim, "pulley").error(
                f"a string passes outside a pulley; {target.side} is within the radius of "
                f"{radius:g} m of {target.prim}",
                "Move the side site out, to where the string is",
            )


def _off_axis(cylinder: Any, site: Any) -> float:
    """Return the distance of a site from a cylinder's axis [m], as the asset is drawn."""
    from pxr import UsdGeom

    cache = UsdGeom.XformCache()
    local = cache.GetLocalToWorldTransform(cylinder).GetInverse().Transform(_place(site))
    axis = "XYZ".index(str(authored(cylinder, "axis", "Z")))
    return float(np.linalg.norm(np.delete(np.array(local), axis)))


def _place(prim: Any) -> Any:
    """Return where a prim is drawn [m]."""
    from pxr import UsdGeom

    return UsdGeom.XformCache().GetLocalToWorldTransform(prim).ExtractTranslation()


def _check_places(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Check that no two neighbours on the path are at one place."""
    sites = [t.prim for t in path_targets(prim) if is_site(stage.GetPrimAtPath(t.prim))]
    places: list[Array] = [np.array(_place(stage.GetPrimAtPath(site))) for site in sites]
    for k, (here, after) in enumerate(pairwise(places)):
        if np.linalg.norm(after - here) < SAME_PLACE:
            yield about(prim, "tendon_path").error(
                f"the string between two sites has a direction; {sites[k]} and {sites[k + 1]} are "
                "at one place",
                "Take one of them out of the path",
            )


def link_of(prim: Any) -> str | None:
    """Return the path of the link that a prim is drawn on; None on the base."""
    while prim and not is_link(prim):
        prim = prim.GetParent()
    return str(prim.GetPath()) if prim else None


def _check_chain(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Check that the string runs along one chain of links, and that it moves one."""
    table = movers(stage)
    links = [link_of(stage.GetPrimAtPath(target.prim)) for target in path_targets(prim)]
    carriers = [table[link] for link in links if link in table]
    farthest = max((joints_below(stage, joint) for joint in carriers), key=len, default=[])
    for link in dict.fromkeys(links):
        if link in table and table[link] not in farthest:
            yield about(prim, "tendon_path").warning(
                f"a tendon runs along one chain of links; {link} is on another branch than "
                f"{farthest[0].GetPath()} moves",
                "Give each chain its own tendon",
            )
    if len(set(links)) < 2:
        yield about(prim, "tendon_path").error(
            "a string moves what it runs to; all sites of this one are on the same link",
            "Let it end on a link that it shall move",
        )
