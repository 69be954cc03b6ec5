"""How tendons come in from USD: rows of ``model.tendon`` beside Newton's own arrays.

A tendon is a prim of type ``MjcTendon`` with a few attributes of ours. Newton hands every prim to
the functions here and appends the rows that they return; ``replicate()`` then shifts the indices
of bodies, joints and tendons to each world.

====================  ==========  =====================================================
``model.tendon.``     shape       meaning
====================  ==========  =====================================================
``world``             (W D,)      world that the tendon belongs to
``spool_radius``      (W D,)      the motor angle is ``theta = l / spool_radius`` [m]
``force_limit``       (W D,)      the most that its servo can pull [N]
``excursion_offset``  (W D,)      excursion ``l`` at q = 0 [m]
``direct``            (W D,)      1: a shaft, which pushes as well as pulls; 0: a string
``arm_tendon``        (W A,)      tendon (row of the arrays above) of a moment arm
``arm_joint``         (W A,)      its joint
``arm_dof``           (W A,)      its degree of freedom
``arm_coef``          (W A,)      the moment arm, positive closes [m]
``path_tendon``       (W N,)      tendon of a site or cylinder on a routed tendon's path
``path_shape``        (W N,)      its shape
``path_body``         (W N,)      body that carries it, -1 for the base
``path_point``        (W N,)      its place in that body's frame [m], vec3
``path_rotation``     (W N,)      from a cylinder's frame, axis along z, to the body's, quat
``path_radius``       (W N,)      radius of a cylinder [m], 0 for a site
``path_side``         (W N,)      the cylinder's side site in the body's frame [m], vec3
``path_turn``         (W N,)      1: the string goes round it counterclockwise; -1: clockwise
``tip_world``         (W,)        world that the tip belongs to
``tip_body``          (W,)        body that carries the tip
``tip_point``         (W,)        the tip in that body's frame [m], vec3
====================  ==========  =====================================================
"""

from collections.abc import Iterable
from typing import Any

import newton
import warp as wp
from newton.solvers import SolverMuJoCo

from tendon_newton.mechanisms.usd.usd_route import authored, is_routed, path_rows, targets_of

NAMESPACE = "tendon"
TENDON = "tendon:tendon"
ARM = "tendon:arm"
PATH = "tendon:path"
TIP = "tendon:tip"

# Attributes of a tendon's prim, and what counts where it gives none: the nominal bench's numbers
TENDON_NUMBERS = {
    "spool_radius": ("tendon:spoolRadius", 0.0125),  # [m]
    "force_limit": ("tendon:forceLimit", 21.0),  # [N]
    "excursion_offset": ("tendon:excursionOffset", 0.0),  # [m]
}

Attribute = tuple[str, str, type, str | None, float]
"""Name, rows, type, what an index refers to, default."""
_ATTRIBUTES: tuple[Attribute, ...] = (
    ("world", TENDON, wp.int32, "world", 0),
    *((name, TENDON, wp.float32, None, usual) for name, (_, usual) in TENDON_NUMBERS.items()),
    ("direct", TENDON, wp.int32, None, 0),
    ("arm_tendon", ARM, wp.int32, TENDON, 0),
    ("arm_joint", ARM, wp.int32, "joint", 0),
    ("arm_dof", ARM, wp.int32, "joint_dof", 0),
    ("arm_coef", ARM, wp.float32, None, 0.0),
    ("path_tendon", PATH, wp.int32, TENDON, 0),
    ("path_shape", PATH, wp.int32, "shape", 0),
    ("path_body", PATH, wp.int32, "body", -1),
    ("path_point", PATH, wp.vec3, None, 0.0),
    ("path_rotation", PATH, wp.quat, None, 0.0),
    ("path_radius", PATH, wp.float32, None, 0.0),
    ("path_side", PATH, wp.vec3, None, 0.0),
    ("path_turn", PATH, wp.float32, None, 1.0),
    ("tip_world", TIP, wp.int32, "world", 0),
    ("tip_body", TIP, wp.int32, "body", 0),
    ("tip_point", TIP, wp.vec3, None, 0.0),
)


def register_tendon_attributes(builder: newton.ModelBuilder) -> None:
    """Teach a builder to read tendons; call it before ``builder.add_usd``.

    MuJoCo's own attributes are registered too, so that ``SolverMuJoCo`` knows the same tendons.
    """
    SolverMuJoCo.register_custom_attributes(builder)
    add_frequency(builder, TENDON, is_tendon_prim, _tendon_rows)
    add_frequency(builder, ARM, is_tendon_prim, _arm_rows)
    add_frequency(builder, PATH, is_tendon_prim, _path_rows)
    add_frequency(builder, TIP, is_tip_prim, _tip_rows)
    add_attributes(builder, _ATTRIBUTES)


def add_frequency(
    builder: newton.ModelBuilder, frequency: str, prim_filter: Any = None, expander: Any = None
) -> None:
    """Teach a builder rows of our own, and which prims of a stage they come from, if any."""
    builder.add_custom_frequency(
        newton.ModelBuilder.CustomFrequency(
            name=frequency.removeprefix(f"{NAMESPACE}:"),
            namespace=NAMESPACE,
            usd_prim_filter=prim_filter,
            usd_entry_expander=expander,
        )
    )


def add_attributes(builder: newton.ModelBuilder, attributes: Iterable[Attribute]) -> None:
    """Teach a builder the columns of such rows."""
    for name, frequency, dtype, references, default in attributes:
        builder.add_custom_attribute(
            newton.ModelBuilder.CustomAttribute(
                name=name,
                namespace=NAMESPACE,
                frequency=frequency,
                dtype=dtype,
                references=references,
                default=dtype() if dtype in (wp.vec3, wp.quat) else default,
            )
        )


def is_tendon_prim(prim: Any, _context: dict[str, Any]) -> bool:
    """Tell whether a prim is a tendon."""
    return prim.GetTypeName() == "MjcTendon"


def is_tip_prim(prim: Any, context: dict[str, Any]) -> bool:
    """Tell whether a prim is the site named ``tip`` on a moving body."""
    shape = context["result"]["path_shape_map"].get(str(prim.GetPath()))
    if shape is None or prim.GetName() != "tip":
        return False
    builder = context["builder"]
    is_site = bool(builder.shape_flags[shape] & newton.ShapeFlags.SITE)
    return is_site and builder.shape_body[shape] >= 0


def tendon_numbers(prim: Any) -> dict[str, float]:
    """Return the numbers of a tendon prim by their names in a mechanism."""
    return {name: float(authored(prim, *own)) for name, own in TENDON_NUMBERS.items()}


def tendon_arms(prim: Any) -> list[tuple[str, float]]:
    """Return the (joint path, moment arm [m]) pairs of a tendon prim, in its own order.

    A routed one has none of its own: they follow from its path. An index that points nowhere is
    left out.
    """
    if is_routed(prim):
        return []
    targets = targets_of(prim, "mjc:path")
    indices = authored(prim, "mjc:path:indices", None) or range(len(targets))
    coefficients = authored(prim, "mjc:path:coef", ())
    pairs = zip(indices, coefficients, strict=False)
    return [(targets[place], float(arm)) for place, arm in pairs if 0 <= place < len(targets)]


def _tendon_rows(prim: Any, _context: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the one row of a tendon."""
    numbers = {f"tendon:{name}": value for name, value in tendon_numbers(prim).items()}
    return [{**numbers, "tendon:direct": int(authored(prim, "tendon:direct", False))}]


def _arm_rows(prim: Any, context: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row per joint that a tendon acts on.

    Newton asks for a prim's rows in the order of registration, so the tendon's own row is the last.
    """
    joints = context["result"]["path_joint_map"]
    builder = context["builder"]
    return [
        {
            "tendon:arm_tendon": _newest_tendon(builder),
            "tendon:arm_joint": joints[path],
            "tendon:arm_dof": builder.joint_qd_start[joints[path]],
            "tendon:arm_coef": coefficient,
        }
        for path, coefficient in tendon_arms(prim)
    ]


def _path_rows(prim: Any, context: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row per site or cylinder on the path of a routed tendon."""
    if not is_routed(prim):
        return []
    return path_rows(prim, context, _newest_tendon(context["builder"]))


def _newest_tendon(builder: newton.ModelBuilder) -> int:
    """Return the row of the tendon that was read last."""
    return len(builder.custom_attributes["tendon:spool_radius"].values or []) - 1


def _tip_rows(prim: Any, context: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the one row of the tip."""
    builder = context["builder"]
    shape = context["result"]["path_shape_map"][str(prim.GetPath())]
    return [
        {
            "tendon:tip_body": builder.shape_body[shape],
            "tendon:tip_point": wp.transform_get_translation(builder.shape_transform[shape]),
        }
    ]
