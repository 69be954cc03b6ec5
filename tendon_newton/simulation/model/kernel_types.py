"""What each declaration of the device code stands for in the kernels of one structure."""

from collections.abc import Sequence
from functools import cache
from itertools import chain
from typing import Any

import warp as wp

from tendon_newton.actuators import find_actuator
from tendon_newton.device_code import placeholders as d
from tendon_newton.device_code.templates import Bindings
from tendon_newton.effects import Stage
from tendon_newton.errors import InvalidDeviceCode
from tendon_newton.simulation.contact.contact_plan import NO_LINK, SHAPES, LinkContactPlan
from tendon_newton.simulation.model.structure import Structure

# Speed below which a dry friction may stick [m/s, rad/s]: some roundings of a finger's speed
REST = {"float64": 1.0e-9, "float32": 1.0e-6}

# Longest step towards equilibrium [rad, m]: no tendon turns so much on the way that its pull
# misleads
STRIDE = 0.3
# Longest step towards equilibrium past obstacles [rad, m]: a link must not leap over one
TOUCHING_STRIDE = 0.02
MOST_EFFECTS = 63  # Bits of a whole number that is not negative


@cache
def kernel_types(structure: Structure) -> Bindings:
    """Return types, constants and structs.

    Raises:
        InvalidDeviceCode: There are more effects than `Drive.asleep` has bits.
    """
    if len(structure.effects) > MOST_EFFECTS:
        raise InvalidDeviceCode(
            f"a kernel takes at most {MOST_EFFECTS} effects; it has {len(structure.effects)}"
        )
    return Bindings(
        {
            **vector_types(structure),
            **code_constants(structure),
            **memory_constants(structure),
            **route_constants(structure),
            **contact_constants(structure),
        }
    )


def vector_types(structure: Structure) -> dict[Any, Any]:
    """Return scalar, vectors and matrices."""
    real = getattr(wp, structure.precision)
    joints, tendons = structure.coordinate_count, structure.tendon_count
    links = structure.joint_count
    rows, capsules = tendons + structure.spool_count, len(structure.touch.links)

    def vector(length: int, dtype: Any = real) -> Any:
        return wp.types.vector(length=length, dtype=dtype)

    def matrix(*shape: int) -> Any:
        return wp.types.matrix(shape=shape, dtype=real)

    return {
        d.real: real,
        d.Flags: wp.int64,
        d.Vec2: vector(2),
        d.Vec3: vector(3),
        d.Mat33: matrix(3, 3),
        d.Quaternion: wp.quatd if real is wp.float64 else wp.quatf,
        d.Place: vector(2) if structure.planar else vector(3),
        d.LinkInertia: real if structure.planar else matrix(3, 3),
        d.Jet: vector(3),
        d.Values: vector(5),
        d.MemoryVector: vector(max(structure.memory_count, 1)),
        d.JointVector: vector(joints),
        d.JointMatrix: matrix(joints, joints),
        d.LinkMatrix: matrix(links, links),
        d.PlaneMatrix: matrix(joints, 2),
        d.SpaceMatrix: matrix(joints, 3),
        d.TurnMatrix: matrix(3 * links, 3),
        d.CapsuleMatrix: matrix(max(capsules, 1), 3),
        d.TendonVector: vector(tendons),
        d.TendonRows: vector(tendons, wp.int32),
        d.ArmMatrix: matrix(tendons, joints),
        d.BendMatrix: matrix(tendons * links, links),
        d.WayVector: vector(joints, wp.int32),
        d.RowVector: vector(rows),
        d.RowMatrix: matrix(rows, joints),
        d.ParameterVector: vector(structure.parameter_count),
    }


def code_constants(structure: Structure) -> dict[Any, Any]:
    """Return what the mechanism and its frictions decide."""
    joints = structure.coordinate_count
    return {
        d.JOINTS: joints,
        d.LINKS: structure.joint_count,
        d.FIRST_BODY: structure.first_body,
        d.TENDONS: structure.tendon_count,
        d.ROWS: structure.tendon_count + structure.spool_count,
        d.PARENT: structure.coordinate_parents,
        d.REVOLUTE: (*structure.revolute, *[False] * (joints - structure.joint_count)),
        d.MOVES: structure.moves(),
        d.PLANAR: structure.planar,
        d.FREE_SPOOL: structure.free_spool,
        d.HAS_ROTOR: structure.has_rotor,
        d.HAS_LOAD: find_actuator(structure.actuator).kinematic,
        d.LED: structure.driven_by == "path",
        d.MAY_HOLD: structure.may_hold,
        d.HAS_DUTY: structure.uses(Stage.DUTY),
        d.DRY_OFFSETS: structure.dry_offsets,
        d.HAS_BRISTLES: structure.uses(Stage.SLIDING),
        d.SMOOTH_OFFSETS: structure.smooth_offsets,
        d.REST: REST[structure.precision],
    }


def memory_constants(structure: Structure) -> dict[Any, Any]:
    """Return what a world remembers, and where."""
    effects = [effect for effect in structure.declarations if structure.remembers(effect)]
    own = [
        (bit, p.null)
        for bit, e in enumerate(structure.declarations)
        for p in e.parameters * structure.copies(e.name)
    ]
    slow_cell = structure.uses(Stage.CELL_LAG) or structure.uses(Stage.CELL_CLOCK)
    return {
        d.HAS_MEMORY: bool(effects) or bool(structure.touch.contacts),
        d.MEMORY_SIZE: structure.memory_count,
        d.MEMORY_OFFSETS: tuple(
            at + e.memory_parameter for e in effects for at in structure.starts(e.name)
        ),
        d.MEMORY_NULLS: tuple(
            e.parameters[e.memory_parameter].null for e in effects for _ in structure.starts(e.name)
        ),
        d.COUNTS: tuple(
            (
                structure.memories[e.name][0] + tendon,
                structure.offsets[e.name] + e.counts_to + structure.stride(e.name) * tendon,
            )
            for e in effects
            if e.counts_to is not None
            for tendon in range(structure.tendon_count)
        ),
        d.EFFECT_COUNT: len(structure.effects),
        d.FIRST_OWN: min(structure.offsets.values(), default=0),
        d.OWN_BITS: tuple(bit for bit, _ in own),
        d.OWN_NULLS: tuple(null for _, null in own),
        d.HOLDS_FORCE: structure.holds_force,
        d.HELD_MEMORY: structure.held_memory,
        d.HAS_SLOW_CELL: slow_cell and structure.driven_by != "force",
        d.CELL_MEMORY: structure.cell_memory,
    }


def route_constants(structure: Structure) -> dict[Any, Any]:
    """Return the paths of routed tendons; see `routes`."""
    routes, parents = structure.routes, structure.coordinate_parents
    routed = bool(routes.spans)
    out = {
        d.ROUTED: routed,
        d.HOLDS_ROUTED: routed and structure.may_hold,
        d.FIRST_SPAN: routes.first_spans(structure.tendon_count),
    }
    if routed:
        points = wp.types.vector(length=len(routes.bodies), dtype=wp.int32)
        out |= {
            d.POINT_BODY: points(*routes.bodies),
            d.SPAN_TABLE: whole_table([(s.start, s.end, s.pulley) for s in routes.spans]),
            d.START_WAY: whole_table(routes.ways(parents, "start")),
            d.END_WAY: whole_table(routes.ways(parents, "end")),
        }
    return out


def contact_constants(structure: Structure) -> dict[Any, Any]:
    """Return which contacts may be; see `contacts`."""
    touch, joints = structure.touch, structure.coordinate_count
    out = {
        d.TOUCHES: bool(touch.contacts),
        d.STRIDE: TOUCHING_STRIDE if touch.contacts else STRIDE,
        d.CAPSULES: len(touch.links),
        d.CAPSULE_LINK: touch.links,
        d.CONTACTS: len(touch.contacts),
        d.CHAINS: touch.chains,
        d.HAS_BODY: touch.moves,
        d.HAS_PAIRS: bool(touch.pairs),
        d.SHARES_BODY: touch.moves and touch.chains > 1,
        **{
            has: shape in touch.shapes
            for has, shape in zip((d.HAS_SPHERE, d.HAS_BOX, d.HAS_PLANE), SHAPES, strict=True)
        },
    }
    if touch.moves:
        out |= {d.BODY: touch.body, d.BODY_SHAPE: SHAPES.index(touch.shapes[touch.body])}
    if isinstance(touch, LinkContactPlan):
        numbers = wp.types.vector(length=len(touch.shapes), dtype=wp.int32)
        links = [NO_LINK if c == NO_LINK else touch.links[c] for c in touch.capsules]
        out |= {d.MET_CAPSULE: numbers(*touch.capsules), d.MET_LINK: numbers(*links)}
    if touch.contacts:
        carries = wp.types.matrix(shape=(joints, joints), dtype=getattr(wp, structure.precision))
        out |= {
            d.CONTACT_MEMORY: structure.contact_memory,
            d.CONTACT_TABLE: whole_table(touch.contacts),
            d.CARRIES: carries(*map(float, chain.from_iterable(structure.moves()))),
        }
    return out


def whole_table(rows: Sequence[Sequence[int]]) -> Any:
    """Return whole numbers as a matrix that device code indexes."""
    table = wp.types.matrix(shape=(len(rows), len(rows[0])), dtype=wp.int32)
    return table(*chain.from_iterable(rows))
