"""The numbers of a `newton.Model` as our kernels read them: per world, in joint coordinates."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import newton
import numpy as np
import warp as wp

from tendon_newton.actuators import find_actuator
from tendon_newton.data.recording import Array, Indices
from tendon_newton.device_code.structs import Mechanism as MechanismNumbers
from tendon_newton.errors import InvalidAsset
from tendon_newton.simulation.chains.rotations import rotation_matrices
from tendon_newton.simulation.contact.contact_arrays import (
    body_numbers,
    contact_numbers,
    free_shapes,
    read_contact_plan,
)
from tendon_newton.simulation.contact.contact_plan import NO_CONTACTS, ContactPlan
from tendon_newton.simulation.model.assembly import Assembly, KernelSet
from tendon_newton.simulation.model.route_arrays import read_numbers, read_plan
from tendon_newton.simulation.model.route_plan import NO_ROUTES, RoutePlan

# A `newton.Model` after `finalize`; its class declares every array as optional
FinalModel: TypeAlias = Any
# Axis of the base about which a bench that is not level is tipped
TIPPING_AXIS = np.array([0.0, 1.0, 0.0])
PUSH_FORCE = 1.0e30  # A direct drive pushes with any force [N]; a string with none
# Numbers of each joint, and the arrays of a Newton model that hold one per degree of freedom
JOINT_NUMBERS = {
    "stiffness": "joint_stiffness",
    "damping": "joint_damping",
    "friction": "joint_friction",
    "armature": "joint_armature",
    "lower": "joint_limit_lower",
    "upper": "joint_limit_upper",
    "limit_stiffness": "joint_limit_ke",
    "limit_damping": "joint_limit_kd",
}
# Arrays of a mechanism that hold vectors, masses and inertias of each joint's link
PER_COORDINATE = ("offset", "centre", "axis", "mass", "inertia")
# How the names of arrays begin that belong to a world and not to its chains
OF_A_WORLD = ("obstacle_", "body_")
NO_STOP = 1.0e30  # Neither a spool nor a body has an end stop within this [m, rad]


@dataclass(frozen=True, kw_only=True)
class Topology:
    """How the joints of one world hang together."""

    parents: tuple[int, ...]  # Parent joint of each joint, -1 for the base, shape (J,)
    revolute: tuple[bool, ...]  # Whether each joint turns (or else slides), shape (J,)
    tendon_count: int  # Number of tendons D
    routes: RoutePlan = NO_ROUTES  # Paths of the tendons whose moment arms are not constant
    touch: ContactPlan = NO_CONTACTS  # Where links may meet obstacles


def read_topology(model: FinalModel) -> Topology:
    """Read the topology that all worlds of a model share.

    Raises:
        InvalidAsset: A joint is neither revolute nor prismatic nor fixed to the base.
    """
    joints = moving_joints(model)[0]
    kinds = model.joint_type.numpy()
    parents = model.joint_parent.numpy()
    children = model.joint_child.numpy()
    moved_by = {int(children[joint]): index for index, joint in enumerate(joints)}
    return Topology(
        parents=tuple(moved_by.get(int(parents[joint]), -1) for joint in joints),
        revolute=tuple(bool(kinds[joint] == newton.JointType.REVOLUTE) for joint in joints),
        tendon_count=len(model.tendon.spool_radius) // model.world_count,
        routes=read_plan(model, moved_by),
        touch=read_contact_plan(model, moved_by),
    )


def moving_joints(model: FinalModel) -> Indices:
    """Return the indices of the mechanism's joints that move, shape (W, J)."""
    kinds = model.joint_type.numpy()
    moving = (kinds == newton.JointType.REVOLUTE) | (kinds == newton.JointType.PRISMATIC)
    parents = model.joint_parent.numpy()
    fixed = (kinds == newton.JointType.FIXED) & (parents < 0)
    unknown = ~moving & ~fixed
    unknown[body_joints(model)] = False
    if np.any(unknown):
        label = model.joint_label[int(np.argmax(unknown))]
        raise InvalidAsset(
            f"joint {label} must be revolute or prismatic (or fix a body to the base); "
            "weld bodies together in the asset instead of by fixed joints"
        )
    return np.flatnonzero(moving).reshape(model.world_count, -1)


def body_joints(model: FinalModel) -> Indices:
    """Return the index of each world's joint that lets its free body move, shape (W,) or (0,)."""
    carriers = model.shape_body.numpy()[free_shapes(model)]
    return np.flatnonzero(np.isin(model.joint_child.numpy(), carriers))


@dataclass(frozen=True, kw_only=True)
class RestFrames:
    """The chain at q = 0 in the axes of the base; vectors are constant in their link's frame."""

    offset: Array  # From the parent joint's origin to the joint's [m], shape (W, J, 3)
    axis: Array  # Joint axes, unit vectors, shape (W, J, 3)
    centre: Array  # From the joint's origin to its link's centre of mass [m], shape (W, J, 3)
    inertia: Array  # Inertia of each link about its centre of mass [kg m2], shape (W, J, 3, 3)
    origin: Array  # The joints' origins [m], shape (W, J, 3)
    body_position: Array  # Origins of the links' own frames [m], shape (W, J, 3)
    body_rotation: Array  # Rotation from the links' own frames to the base, shape (W, J, 3, 3)


def rest_frames(model: FinalModel, topology: Topology) -> RestFrames:
    """Place every joint and link of every world at q = 0."""
    joints = moving_joints(model)
    worlds, count = joints.shape
    parent_frame = model.joint_X_p.numpy().astype(np.float64)[joints]
    child_frame = model.joint_X_c.numpy().astype(np.float64)[joints]
    axes = model.joint_axis.numpy().astype(np.float64)[model.joint_qd_start.numpy()[joints]]
    bodies = model.joint_child.numpy()[joints]
    base = base_frames(model, joints)
    position, rotation = np.zeros((worlds, count, 3)), np.zeros((worlds, count, 3, 3))
    origin, axis = np.zeros((worlds, count, 3)), np.zeros((worlds, count, 3))
    for j, parent in enumerate(topology.parents):
        at, turned = (position[:, parent], rotation[:, parent]) if parent >= 0 else base
        origin[:, j] = at + np.einsum("wab,wb->wa", turned, parent_frame[:, j, :3])
        joint_turned = turned @ rotation_matrices(parent_frame[:, j, 3:])
        axis[:, j] = np.einsum("wab,wb->wa", joint_turned, axes[:, j])
        rotation[:, j] = joint_turned @ np.swapaxes(
            rotation_matrices(child_frame[:, j, 3:]), -1, -2
        )
        position[:, j] = origin[:, j] - np.einsum(
            "wab,wb->wa", rotation[:, j], child_frame[:, j, :3]
        )
    com = model.body_com.numpy().astype(np.float64)[bodies]
    inertia = model.body_inertia.numpy().astype(np.float64)[bodies]
    parents = np.array(topology.parents)
    parent_origin = np.where((parents >= 0)[:, None], origin[:, parents], 0.0)
    return RestFrames(
        offset=origin - parent_origin,
        axis=axis / np.linalg.norm(axis, axis=-1, keepdims=True),
        centre=position + np.einsum("wjab,wjb->wja", rotation, com) - origin,
        inertia=rotation @ inertia @ np.swapaxes(rotation, -1, -2),
        origin=origin,
        body_position=position,
        body_rotation=rotation,
    )


def base_frames(model: FinalModel, joints: Indices) -> tuple[Array, Array]:
    """Return position (W, 3) and rotation (W, 3, 3) of what the first joints are mounted on."""
    worlds = len(joints)
    parents = model.joint_parent.numpy()
    children = model.joint_child.numpy()
    position, rotation = np.zeros((worlds, 3)), np.tile(np.eye(3), (worlds, 1, 1))
    mount = parents[joints[:, 0]]
    if np.all(mount >= 0):
        order = np.argsort(children)
        fixed = order[np.searchsorted(children, mount, sorter=order)]
        frame = model.joint_X_p.numpy().astype(np.float64)[fixed]
        own = model.joint_X_c.numpy().astype(np.float64)[fixed]
        rotation = rotation_matrices(frame[:, 3:]) @ np.swapaxes(
            rotation_matrices(own[:, 3:]), -1, -2
        )
        position = frame[:, :3] - np.einsum("wab,wb->wa", rotation, own[:, :3])
    return position, rotation


def plane_basis(frames: RestFrames, topology: Topology) -> Array | None:
    """Return the basis (2, 3) of the plane in which the chain moves, None if there is none."""
    axis = frames.axis[0]
    turning = np.array(topology.revolute)
    normal = axis[turning][0] if turning.any() else np.linalg.svd(axis)[2][-1]
    aligned = np.allclose(axis[turning], normal, atol=1e-6)
    inside = np.allclose(axis[~turning] @ normal, 0.0, atol=1e-6)
    if not (aligned and inside):
        return None
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(helper, normal)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first)])


def plane_of(model: FinalModel, topology: Topology) -> Array | None:
    """Return the plane (2, 3) in which a model's chain moves, None if there is none.

    Routed tendons run in space, so that a chain that has some counts as one in space.
    """
    if topology.routes.spans:
        return None
    return plane_basis(rest_frames(model, topology), topology)


def fill_mechanism(model: FinalModel, kernels: KernelSet | Assembly) -> Any:
    """Return the `Mechanism` struct of a kernel set, filled from a model's arrays.

    Where the kernels are those of one chain of several, each chain of a world counts as a world;
    obstacles stay a world's.
    """
    structure = kernels.structure
    topology = read_topology(model)
    frames = rest_frames(model, topology)
    types = kernels.types
    struct = types[MechanismNumbers]()
    copies = len(topology.parents) // structure.joint_count
    chains = model.world_count * copies

    def put(name: str, values: Array) -> None:
        scalar = np.float64 if structure.precision == "float64" else np.float32
        if len(values) < chains and not name.startswith(OF_A_WORLD):
            values = values.reshape(chains, values.shape[1] // copies, *values.shape[2:])
        values = with_more(name, values, structure.coordinate_count - structure.joint_count)
        dtype = types[MechanismNumbers].vars[name].type.dtype
        exact = np.ascontiguousarray(values, dtype=scalar)
        setattr(struct, name, wp.array(exact, dtype=dtype, device=model.device))

    tendons = tendon_numbers(model)
    for name, values in (joint_numbers(model) | tendons).items():
        put(name, values)
    put("arms", chain_arms(moment_arms(model, topology), copies))
    if topology.routes.spans:
        routes = read_numbers(model, topology.routes, frames, topology.tendon_count)
        put("path_point", routes.point)
        put("path_frame", routes.frame)
        put("path_radius", routes.radius)
        put("path_turn", routes.turn)
        put("excursion_offset", tendons["excursion_offset"] + routes.rest_length)
    put("mass", model.body_mass.numpy()[model.joint_child.numpy()[moving_joints(model)]])
    vectors = {name: getattr(frames, name) for name in ("offset", "centre", "axis")}
    vectors |= gravity_numbers(model, copies)
    basis = plane_basis(frames, topology) if structure.planar else None
    if topology.touch.contacts:
        for name, values in contact_numbers(model, topology.touch, frames, basis).items():
            put(name, values)
    if basis is not None and topology.touch.contacts:
        plane = np.vstack([basis, np.cross(basis[0], basis[1])])
        put("contact_plane", np.broadcast_to(plane, (chains, 3, 3)))
    if topology.touch.moves:
        for name, values in body_numbers(model, vectors["gravity"][::copies]).items():
            put(name, values)
    for name, values in vectors.items():
        put(name, values if basis is None else values @ basis.T)
    inertia = frames.inertia
    if basis is not None:
        normal = np.cross(basis[0], basis[1])
        inertia = np.einsum("a,wjab,b->wj", normal, inertia, normal)
    put("inertia", inertia)
    return struct


def gravity_numbers(model: FinalModel, copies: int) -> dict[str, Array]:
    """Return gravity [m/s^2] of each chain, and what it becomes as a bench is tipped about +y.

    Rodrigues' formula needs y x g, and what of g is normal to y.
    """
    gravity = np.broadcast_to(model.gravity.numpy()[:1], (model.world_count, 3))
    if len(model.gravity) >= model.world_count:
        gravity = model.gravity.numpy()[: model.world_count]
    gravity = np.repeat(gravity, copies, axis=0)
    across = np.cross(TIPPING_AXIS, gravity)
    along = -np.cross(TIPPING_AXIS, across)
    return {"gravity": gravity, "gravity_across": across, "gravity_along": along}


def coordinate_axis(name: str) -> int | None:
    """Return the axis of a mechanism's array that counts coordinates, None where none does."""
    if name == "arms":
        return 2
    return 1 if name == "rest" or name in JOINT_NUMBERS or name in PER_COORDINATE else None


def with_more(name: str, values: Array, further: int) -> Array:
    """Return numbers of joints with columns for spools and a body, which meet no stop.

    Arrays that have no column per joint stay as they are. Values have the shape (W, J, ...), those
    of the arms (W, D, J).
    """
    axis = coordinate_axis(name)
    if further == 0 or axis is None:
        return values
    shape = list(values.shape)
    shape[axis] = further
    stop = {"lower": -NO_STOP, "upper": NO_STOP}.get(name, 0.0)
    return np.concatenate([values, np.full(shape, stop)], axis=axis)


def spools_are_free(model: FinalModel, actuator: str) -> bool:
    """Tell whether spools need coordinates of their own: strings pulled by servos with a rotor."""
    strings = np.any(model.tendon.direct.numpy() == 0)
    return bool(strings) and find_actuator(actuator).rotor


def chain_arms(arms: Array, copies: int) -> Array:
    """Return moment arms (W, D, J) [m] of K chains at their own joints, (W K, D / K, J / K)."""
    worlds, tendons, joints = arms.shape
    blocks = arms.reshape(worlds, copies, tendons // copies, copies, joints // copies)
    own = blocks[:, np.arange(copies), :, np.arange(copies)]
    return own.swapaxes(0, 1).reshape(worlds * copies, tendons // copies, joints // copies)


def joint_numbers(model: FinalModel) -> dict[str, Array]:
    """Return the joints' springs, dampers, frictions and stops, each shape (W, J)."""
    joints = moving_joints(model)
    speeds, coordinates = model.joint_qd_start.numpy()[joints], model.joint_q_start.numpy()[joints]
    numbers = {name: getattr(model, array).numpy()[speeds] for name, array in JOINT_NUMBERS.items()}
    return {**numbers, "rest": model.joint_rest_q.numpy()[coordinates]}


def tendon_numbers(model: FinalModel) -> dict[str, Array]:
    """Return the tendons' numbers, each shape (W, D)."""
    tendon: Any = model.tendon
    shape = (model.world_count, -1)
    numbers = {
        name: getattr(tendon, name).numpy().reshape(shape)
        for name in ("excursion_offset", "spool_radius", "force_limit")
    }
    numbers["least_tension"] = np.where(tendon.direct.numpy().reshape(shape) > 0, -PUSH_FORCE, 0.0)
    return numbers


def moment_arms(model: FinalModel, topology: Topology) -> Array:
    """Return the moment arms [m], shape (W, D, J)."""
    tendon: Any = model.tendon
    joints = moving_joints(model)
    arms = np.zeros((model.world_count, topology.tendon_count, joints.shape[1]))
    if hasattr(tendon, "arm_tendon"):  # Newton keeps no columns without rows
        place = np.searchsorted(joints.ravel(), tendon.arm_joint.numpy())
        world, joint = np.divmod(place, joints.shape[1])
        row = tendon.arm_tendon.numpy() % topology.tendon_count
        np.add.at(arms, (world, row, joint), tendon.arm_coef.numpy())
    return arms


def joint_places(model: Any) -> tuple[Any, Any]:
    """Return the places of positions and of velocities on the model's device, each shape (W, J)."""
    return starts_of(model, moving_joints(model))


def body_places(model: Any) -> tuple[Any, Any]:
    """Return where each free body's positions and velocities begin, each shape (W,)."""
    return starts_of(model, body_joints(model))


def starts_of(model: Any, joints: Any) -> tuple[Any, Any]:
    """Return where positions and velocities of some joints begin, on the model's device."""
    positions, velocities = (
        wp.array(starts.numpy()[joints], dtype=wp.int32, device=model.device)
        for starts in (model.joint_q_start, model.joint_qd_start)
    )
    return positions, velocities
