"""All that decides a kernel's code: the topology, the actuator, the effects, the precision."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

from tendon_newton.actuators import find_actuator
from tendon_newton.data.recording import DrivenBy
from tendon_newton.effects import EFFECTS, Effect, Stage, find_effect, law_of
from tendon_newton.simulation.contact.contact_plan import BODY_COORDINATES, NO_CONTACTS, ContactPlan
from tendon_newton.simulation.model.route_plan import NO_ROUTES, RoutePlan

Precision = Literal["float32", "float64"]
# Stages with a jet per joint; the other stages with jets have one per tendon
JOINT_STAGES = (Stage.SPRING, Stage.DAMPING)


@dataclass(frozen=True, kw_only=True)
class Structure:
    """All that decides a kernel's code; numbers that only decide results are not in it."""

    parents: tuple[int, ...]  # Index of each joint's parent joint, -1 for the base, shape (J,)
    revolute: tuple[bool, ...]  # Whether each joint turns (or else slides), shape (J,)
    tendon_count: int
    actuator: str
    effects: tuple[str, ...]  # Names in the order of the catalogue
    by_servo: tuple[str, ...] = ()  # Effects of which each servo has numbers of its own
    # Whether the chain moves in one plane, which costs a third of the general equations
    planar: bool = True
    precision: Precision = "float64"
    driven_by: DrivenBy = "command"
    # Whether each spool has a coordinate of its own: how far it leads its mechanism
    free_spool: bool = False
    routes: RoutePlan = NO_ROUTES  # Paths of the tendons whose moment arms are not constant
    touch: ContactPlan = NO_CONTACTS  # Where links may meet obstacles

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.parents)

    @property
    def spool_count(self) -> int:
        """Number of spools that have a coordinate of their own."""
        return self.tendon_count if self.free_spool else 0

    @property
    def first_body(self) -> int:
        """Where the coordinates of a free body begin."""
        return self.joint_count + self.spool_count

    @property
    def coordinate_count(self) -> int:
        """Number of coordinates of a world: its joints, its spools, its free body."""
        return self.first_body + (BODY_COORDINATES if self.touch.moves else 0)

    @property
    def has_rotor(self) -> bool:
        """Whether a rotor's inertia stands between the motor and the load cell."""
        return self.driven_by == "command" and find_actuator(self.actuator).rotor

    @property
    def declarations(self) -> tuple[type[Effect], ...]:
        """The effects themselves."""
        return tuple(find_effect(name) for name in self.effects)

    @property
    def offsets(self) -> dict[str, int]:
        """Where each effect's first parameter stands in a world's parameter vector."""
        at = len(find_actuator(self.actuator).parameters)
        table = {}
        for effect in self.declarations:
            table[effect.name] = at
            at += len(effect.parameters) * self.copies(effect.name)
        return table

    def copies(self, effect: str) -> int:
        """Return how often an effect's numbers stand in a world's parameter vector."""
        return self.tendon_count if effect in self.by_servo else 1

    def stride(self, effect: str) -> int:
        """Return how much further the next servo's numbers stand; 0 where all have the same."""
        return len(find_effect(effect).parameters) if effect in self.by_servo else 0

    def starts(self, effect: str) -> tuple[int, ...]:
        """Return where each copy of an effect's numbers starts."""
        first, stride = self.offsets[effect], self.stride(effect)
        return tuple(first + stride * copy for copy in range(self.copies(effect)))

    @property
    def parameter_count(self) -> int:
        """Length P of a world's parameter vector, two zeros of padding included."""
        effects = sum(len(e.parameters) * self.copies(e.name) for e in self.declarations)
        return len(find_actuator(self.actuator).parameters) + effects + 2

    @property
    def dry_offsets(self) -> tuple[int, ...]:
        """Where the parameters stand that make a tendon stick."""
        return self._offsets(lambda effect: effect.dry)

    @property
    def smooth_offsets(self) -> tuple[int, ...]:
        """Where the parameters stand with which nothing sticks."""
        return self._offsets(lambda effect: effect.smooth)

    def _offsets(self, names_of: Callable[[type[Effect]], tuple[str, ...]]) -> tuple[int, ...]:
        return tuple(
            start + index
            for effect in self.declarations
            for start in self.starts(effect.name)
            for index, parameter in enumerate(effect.parameters)
            if parameter.name in names_of(effect)
        )

    @property
    def may_hold(self) -> bool:
        """Whether dry friction, or a motor at its greatest speed, may hold a tendon."""
        return bool(self.dry_offsets) or self.uses(Stage.SPEED)

    @property
    def memories(self) -> dict[str, tuple[int, ...]]:
        """Where each effect with internal state keeps its numbers in a world's memory."""
        at = 0
        table = {}
        for effect in self.declarations:
            if self.remembers(effect):
                size = self.memory_size(effect)
                table[effect.name] = tuple(at + size * i for i in range(len(effect.renewals())))
                at += size * len(effect.renewals())
        return table

    def memory_size(self, effect: type[Effect]) -> int:
        """Return how many joints or tendons an effect has a memory of."""
        return self.coordinate_count if effect.memory in JOINT_STAGES else self.tendon_count

    @property
    def cell_memory(self) -> int:
        """Where lagging load cells keep their readings in a world's memory, behind all effects."""
        kept = [effect for effect in self.declarations if self.remembers(effect)]
        return sum(self.memory_size(effect) * len(effect.renewals()) for effect in kept)

    @property
    def held_memory(self) -> int:
        """Where the forces that an actuator holds stand in a world's memory, behind the cells."""
        return self.cell_memory + (self.tendon_count if self.uses(Stage.CELL_LAG) else 0)

    @property
    def holds_force(self) -> bool:
        """Whether the actuator's force is decided outside the kernels and held."""
        return self.driven_by == "command" and find_actuator(self.actuator).held

    @property
    def contact_memory(self) -> int:
        """Where contacts keep how far they are stretched in a world's memory, behind all others."""
        return self.held_memory + (2 * self.tendon_count if self.holds_force else 0)

    @property
    def memory_count(self) -> int:
        """Length S of a world's memory."""
        return self.contact_memory + self.touch.memory_count

    def uses(self, stage: Stage) -> bool:
        """Return whether any effect acts in a stage."""
        return any(self.hook(effect, stage) for effect in self.declarations)

    def hook(self, effect: type[Effect], stage: Stage) -> Callable[..., Any] | None:
        """Return an effect's device function of a stage, None where it does not act here."""
        replaced = self.free_spool and stage in effect.spool_stages
        return None if replaced else effect.hook(stage)

    def remembers(self, effect: type[Effect]) -> bool:
        """Return whether an effect has internal state here."""
        replaced = self.free_spool and effect.memory in effect.spool_stages
        return effect.memory is not None and not replaced

    @property
    def coordinate_parents(self) -> tuple[int, ...]:
        """Parent of each coordinate; a spool's and a body's is the base."""
        return (*self.parents, *[-1] * (self.coordinate_count - self.joint_count))

    def moves(self) -> tuple[tuple[bool, ...], ...]:
        """Return whether coordinate j carries link k, shape (J, J); spools and bodies none."""
        parents = self.coordinate_parents
        table = [[False] * len(parents) for _ in parents]
        for link in range(self.joint_count):
            joint = link
            while joint >= 0:
                table[joint][link] = True
                joint = parents[joint]
        return tuple(map(tuple, table))


def in_catalogue_order(causes: Iterable[str]) -> tuple[str, ...]:
    """Return the effects of causes as the catalogue has them: so they act within a stage."""
    effects = {law_of(cause).name for cause in causes}
    return tuple(name for name in EFFECTS if name in effects)
