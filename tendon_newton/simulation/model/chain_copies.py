"""A mechanism of several equal chains, such as a hand of fingers, as that many small mechanisms.

Chains that share no joint and no tendon feel each other only through a body that they move. Kernels
for one of them, run for each, compile in the time of a finger, and step a hand in that of its
fingers. What a world has of all its joints, chain by chain, is in memory what its chains have of
theirs; obstacles are in every chain's way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.data.recording import Array
from tendon_newton.device_code.placeholders import DeviceArray
from tendon_newton.errors import InvalidModelFile
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.contact.contact_plan import ContactPlan
from tendon_newton.simulation.model.mechanism_arrays import Topology, moment_arms, read_topology
from tendon_newton.simulation.model.route_plan import NO_PULLEY, RoutePlan, SpanPlan


@dataclass(frozen=True, kw_only=True)
class ChainCopies:
    """How often a world has a chain."""

    count: int  # Chains K of each world
    topology: Topology  # Topology of one chain

    @property
    def independent(self) -> bool:
        """Whether each of several servos moves a chain of its own."""
        return self.count > 1 and self.topology.tendon_count == 1


def copies_of(model: Any) -> ChainCopies:
    """Return the equal chains of a Newton model's worlds."""
    whole = read_topology(model)
    return chain_copies(whole, moment_arms(model, whole))


def are_independent(mechanism: Mechanism) -> bool:
    """Tell whether each of several servos moves a finger of its own, all of one kind."""
    several = len(mechanism.tendons) > 1  # else no model need be built
    return several and copies_of(build_model(mechanism, 1, device="cpu")).independent


def chain_copies(topology: Topology, arms: Array) -> ChainCopies:
    """Divide a mechanism into as many equal chains as it has, one after the other.

    The moment arms [m] have the shape (W, D, J).
    """
    joints, tendons = len(topology.parents), topology.tendon_count
    if topology.touch.pairs:  # what a link does to another is in one implicit step for both
        return ChainCopies(count=1, topology=topology)
    for count in range(min(joints, tendons), 1, -1):
        parts = (joints, tendons, len(topology.routes.bodies), len(topology.touch.links))
        if any(part % count for part in parts):
            continue
        chains = [chain_at(topology, k, count) for k in range(count)]
        if all(chain == chains[0] for chain in chains) and are_disjoint(arms, count):
            return ChainCopies(count=count, topology=chains[0])
    return ChainCopies(count=1, topology=topology)


def chain_at(topology: Topology, k: int, count: int) -> Topology:
    """Return chain k of some, numbered from its own first joint; -2 stands for another chain's."""
    joints = len(topology.parents) // count
    own = slice(k * joints, (k + 1) * joints)
    return Topology(
        parents=tuple(numbered(parent, k * joints, joints) for parent in topology.parents[own]),
        revolute=topology.revolute[own],
        tendon_count=topology.tendon_count // count,
        routes=routes_at(topology.routes, k, count, joints),
        touch=touch_at(topology.touch, k, count, joints),
    )


def routes_at(routes: RoutePlan, k: int, count: int, joints: int) -> RoutePlan:
    """Return the paths of chain k, numbered from its own first point and tendon."""
    points = len(routes.bodies) // count
    tendons = max((span.tendon for span in routes.spans), default=-1) + 1
    per_chain = tendons // count
    own = range(k * points, (k + 1) * points)
    spans = [span for span in routes.spans if span.start in own]
    return RoutePlan(
        bodies=tuple(numbered(routes.bodies[n], k * joints, joints) for n in own),
        spans=tuple(
            SpanPlan(
                tendon=span.tendon - k * per_chain,
                start=span.start - k * points,
                end=span.end - k * points,
                pulley=span.pulley if span.pulley == NO_PULLEY else span.pulley - k * points,
            )
            for span in spans
        ),
    )


def touch_at(touch: ContactPlan, k: int, count: int, joints: int) -> ContactPlan:
    """Return where chain k may meet the obstacles of all."""
    if not touch.contacts:
        return touch
    capsules = len(touch.links) // count
    own = touch.links[k * capsules : (k + 1) * capsules]
    return replace(
        touch, links=tuple(numbered(link, k * joints, joints) for link in own), chains=count
    )


def numbered(joint: int, first: int, count: int) -> int:
    """Return a joint's number within its chain, -1 for the base, -2 for a joint elsewhere."""
    if joint < 0:
        return joint
    return joint - first if first <= joint < first + count else -2


def are_disjoint(arms: Array, count: int) -> bool:
    """Tell whether no tendon has an arm at a joint of another chain."""
    worlds, tendons, joints = arms.shape
    blocks = arms.reshape(worlds, count, tendons // count, count, joints // count)
    others = ~np.eye(count, dtype=bool)
    return not np.any(blocks.transpose(1, 3, 0, 2, 4)[others])


@wp.kernel(enable_backward=False)
def spread_kernel(count: int, worlds: DeviceArray[wp.bool], chains: DeviceArray[wp.bool]) -> None:
    """Mark all chains of the worlds that are marked."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    chains[i] = worlds[i // count]


@wp.kernel(enable_backward=False)
def gather_kernel(count: int, chains: DeviceArray[wp.bool], worlds: DeviceArray[wp.bool]) -> None:
    """Mark the worlds of which a chain is marked, and take the marks from the chains."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if chains[i]:
        worlds[i // count] = wp.bool(True)
        chains[i] = wp.bool(False)


def refuse_copies(copies: ChainCopies, effects: Sequence[str]) -> None:
    """Refuse effects of one servo where the kernels see a mechanism of equal chains whole.

    Such kernels take minutes and gigabytes to compile.

    Raises:
        InvalidModelFile: There are several chains.
    """
    if copies.count > 1:
        raise InvalidModelFile(
            "gradients and a force network take fingers that are apart as one mechanism, in which "
            f"all have the same effects; {effects[0]} is of one of {copies.count} fingers: give it "
            "to all servos, or leave it out"
        )
