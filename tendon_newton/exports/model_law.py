"""What slots and constants of the law stand for in a program of one model."""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.device_code import placeholders, slots
from tendon_newton.effects import Effect, Stage, find_effect
from tendon_newton.law.servo import duty_of_force, force_of_duty
from tendon_newton.simulation.model.assembly import ANGLE_SIDES, MEMORIES, STAGES
from tendon_newton.simulation.model.parameter_table import ParameterTable
from tendon_newton.simulation.model.structure import in_catalogue_order


@dataclass(frozen=True)
class ModelLaw:
    """The law of one model, whose programs know one tendon or joint at a time."""

    model: Model
    # Whether a spool moves on its own, so that some effects act at it in place of their stages
    free_spool: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects in the order of the catalogue."""
        return in_catalogue_order(tuple(effect.name for effect in self.model.effects))

    @property
    def table(self) -> ParameterTable:
        """Where the numbers of its actuator and effects stand."""
        return ParameterTable(actuator=self.model.actuator.name, effects=self.names)

    @property
    def parameters(self) -> list[float]:
        """These numbers."""
        return [float(x) for x in self.table.vector(self.model)]

    @cached_property
    def memories(self) -> dict[str, range]:
        """Where what its effects remember stands."""
        out: dict[str, range] = {}
        count = 0
        for name in self.names:
            effect = find_effect(name)
            if effect.memory is not None and not self._is_replaced(effect, effect.memory):
                out[name] = range(count, count + len(effect.renewals()))
                count = out[name].stop
        return out

    @cached_property
    def constants(self) -> dict[Any, int]:
        """What the constants of the device code are; a held force stands behind all memories."""
        actuator = find_actuator(self.model.actuator.name)
        count = sum(len(places) for places in self.memories.values())
        uses = {
            stage: any(find_effect(name).hook(stage) is not None for name in self.names)
            for stage in (Stage.DUTY, Stage.SLIDING)
        }
        return {
            placeholders.TENDONS: 1,
            placeholders.HAS_ROTOR: actuator.rotor,
            placeholders.FREE_SPOOL: self.free_spool,
            placeholders.HAS_DUTY: uses[Stage.DUTY],
            placeholders.HAS_BRISTLES: uses[Stage.SLIDING],
            placeholders.HAS_MEMORY: count > 0,
            placeholders.HELD_MEMORY: count,
        }

    @property
    def memory_size(self) -> int:
        """How many numbers a program keeps of a tendon or joint."""
        held = find_actuator(self.model.actuator.name).held
        return max(self.constants[placeholders.HELD_MEMORY] + 2 * held, 1)

    @cached_property
    def functions(self) -> dict[Any, Callable[..., Any]]:
        """Device functions of the slots that hold no effects."""
        actuator = find_actuator(self.model.actuator.name)
        return {
            slots.actuator_force: actuator.force,
            slots.armature: actuator.armature,
            slots.asked_duty: actuator.duty if actuator.modulated else duty_of_force,
            slots.driven_force: actuator.driven if actuator.modulated else force_of_duty,
        }

    def holds_effects(self, slot: Any) -> bool:
        """Tell whether something is a slot for effects."""
        slots_of_stages = [own for own, _ in (*STAGES.values(), *MEMORIES.values())]
        return any(slot is own for own in (*slots_of_stages, *ANGLE_SIDES.values()))

    def text(self, slot: Callable[..., Any], carry: Callable[[str, Any], str]) -> str:
        """Return the function in which the effects of a slot act one after the other.

        `carry` puts a device function before it and returns its name.
        """
        kinds = {name: kind.__name__ for name, kind in inspect.get_annotations(slot).items()}
        result = kinds.pop("return")
        signal, *others = kinds
        owner = next((name for name in others if name in ("tendon", "joint")), None)
        given = "".join(f", {name}" for name in others if name in ("tendon", "joint", "time"))
        lines = [f'"""{slot.__doc__}"""', f"out = {'memory' if 'memory' in kinds else signal}"]
        for name, target, function in self._acting(slot):
            carried = carry(f"{name}_{function.__name__}", function)
            source = signal if "memory" in kinds else "out"
            lines.append(f"{target} = {carried}({source}{given}, {self._values(name, owner)})")
        arguments = ", ".join(f"{name}: {kind}" for name, kind in kinds.items())
        body = "\n    ".join([*lines, "return out"])
        return f"def {slot.__name__}({arguments}) -> {result}:\n    {body}"

    def _acting(self, slot: Callable[..., Any]) -> Iterator[tuple[str, str, Callable[..., Any]]]:
        """Return the effects of a slot: name, what is written, and the device function."""
        for name in self.names:
            effect = find_effect(name)
            hook = effect.hook(Stage.ANGLE)
            if hook is not None and ANGLE_SIDES.get(effect.side) is slot:
                yield name, "out", hook
            for stage, (own, _) in STAGES.items():
                hook = effect.hook(stage)
                if own is slot and hook is not None and not self._is_replaced(effect, stage):
                    yield name, "out", hook
            for stage, (own, _) in MEMORIES.items():
                if own is slot and effect.memory is stage and name in self.memories:
                    for renewal, place in zip(effect.renewals(), self.memories[name], strict=True):
                        yield name, f"out[{place}]", renewal

    def _is_replaced(self, effect: type[Effect], stage: Stage) -> bool:
        return self.free_spool and stage in effect.spool_stages

    def _values(self, name: str, owner: str | None) -> str:
        """Return the text of an effect's own numbers and memories."""
        first = self.table.columns(name)[0]
        kept = [f"{owner}.memory[{place}]" for place in self.memories.get(name, ()) if owner]
        kept += ["real(0.0)"] * (2 - len(kept))
        return f"Values(p[{first}], p[{first + 1}], p[{first + 2}], {', '.join(kept)})"
