"""Where each number of a model stands in the parameter vector of a kernel.

Each servo may have numbers of its own of some effects (`ParameterTable.by_servo`). A search sees
them as causes of their own, beside the effect of all servos.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.parameters import BenchScale, Parameter, with_unit
from tendon_newton.data.recording import Array, Indices
from tendon_newton.data.servo_names import effect_of, name_of, servo_of
from tendon_newton.effects import find_effect, law_of
from tendon_newton.errors import InvalidModelFile, look_up
from tendon_newton.simulation.model.bench_numbers import OWNER
from tendon_newton.simulation.model.structure import in_catalogue_order

# Radii [m] that a spool may have; a direct drive's angle is its excursion, so that it has 1
SPOOL_RADII = (1.0e-3, 1.0)
FORCE_LIMITS = (1.0e-6, 1.0e6)  # Greatest forces [N] that a motor may have
# Keys that any actuator may carry besides its own parameters
SHARED_KEYS = ("spool_radius", "force_limit", "file")


@dataclass(frozen=True, kw_only=True)
class ParameterTable:
    """The parameter vector of one structure: the actuator's numbers, then each effect's."""

    actuator: str  # Kind of the actuator
    effects: tuple[str, ...]  # Effects in the order of the catalogue
    by_servo: tuple[str, ...] = ()  # Effects of which each servo has numbers of its own
    servos: int = 1  # Number of servos D
    # Whether each servo moves a finger of its own, which may then have effects of its own
    independent: bool = False
    # Effects of `by_servo` that all servos may share. Kernels do not read shared numbers; they
    # stand for each servo that has none of its own.
    shared: tuple[str, ...] = ()
    bench: tuple[Parameter, ...] = ()  # Unknown numbers of benches; `bench_numbers` has them
    # Scale of the benches: ranges and units follow it
    scale: BenchScale = field(default_factory=BenchScale)

    @property
    def bench_columns(self) -> slice:
        """Places of the benches' numbers, which kernels do not read."""
        return slice(len(self.owners) - len(self.bench), len(self.owners))

    @cached_property
    def owners(self) -> tuple[tuple[str, Parameter], ...]:
        """(actuator, cause or bench, parameter) of each place, shape (P - 2,)."""
        rows = [(self.actuator, p.on(self.scale)) for p in find_actuator(self.actuator).parameters]
        causes = [cause for name in self.effects for cause in self.causes(name)]
        for cause in (*causes, *self.shared):
            rows += [(cause, p.on(self.scale)) for p in law_of(cause).parameters]
        return (*rows, *((OWNER, p) for p in self.bench))

    def causes(self, effect: str) -> tuple[str, ...]:
        """Return what kernels read of an effect: its numbers, or those of each servo."""
        if effect not in self.by_servo:
            return (effect,)
        return tuple(name_of(effect, servo) for servo in range(self.servos))

    def columns(self, owner: str) -> tuple[int, ...]:
        """Return the places of an actuator's or effect's parameters."""
        return self._places.get(owner, ())

    @cached_property
    def _places(self) -> dict[str, tuple[int, ...]]:
        """The places of each owner."""
        found: dict[str, tuple[int, ...]] = {}
        for i, (name, _) in enumerate(self.owners):
            found[name] = (*found.get(name, ()), i)
        return found

    def column(self, owner: str, parameter: str) -> int:
        """Return the place of one parameter."""
        names = {self.owners[i][1].name: i for i in self.columns(owner)}
        return look_up(f"parameter of {owner!r}", parameter, names)

    def null_vector(self) -> Array:
        """Return the vector without effects, the actuator at its typical values, shape (P,)."""
        values = [p.nominal if n == self.actuator else p.null for n, p in self.owners]
        return np.array([*values, 0.0, 0.0])

    def of_chain(self, chains: int) -> ParameterTable:
        """Return the table of one of K equal chains: each has numbers of its own anyhow."""
        servos = self.servos // chains
        return replace(self, servos=servos, by_servo=self.by_servo if servos > 1 else ())

    def _chain_columns(self, chains: int) -> Indices:
        """Return the places of what the kernels of each of K chains read, shape (K, P')."""
        end = len(self.owners)
        out = []
        for chain in range(chains):
            own = list(self.columns(self.actuator))
            for effect in self.effects:
                causes = self.causes(effect)
                share = len(causes) // chains
                chosen = causes[chain * share :][:share] if effect in self.by_servo else causes
                own += [column for cause in chosen for column in self.columns(cause)]
            out.append([*own, end, end + 1])
        return np.array(out, dtype=np.intp)

    def kernel_vectors(self, vectors: Array, chains: int = 1) -> Array:
        """Return what kernels of K equal chains, (..., K, P'), read of worlds' vectors (..., P)."""
        out, null = vectors, self.null_vector()
        for effect in self.shared:
            whole = list(self.columns(effect))
            given = (vectors[..., whole] != null[whole]).any(axis=-1, keepdims=True)
            if not given.any():
                continue
            out = vectors.copy() if out is vectors else out
            for cause in self.causes(effect):
                own = list(self.columns(cause))
                none = (vectors[..., own] == null[own]).all(axis=-1, keepdims=True)
                out[..., own] = np.where(given & none, vectors[..., whole], vectors[..., own])
        return out[..., self._chain_columns(chains)]

    def vector(self, model: Model, actuator_overrides: Mapping[str, float] | None = None) -> Array:
        """Return a model's numbers with one recording's own actuator numbers, shape (P,).

        Effects that the model does not have are at null. What it says of one servo counts there
        before what it says of all.

        Raises:
            InvalidModelFile: A parameter is missing, unknown or outside its range, or an effect is
                about a servo that is not there, or cannot be about one.
            UnknownName: An effect is not in the catalogue.
        """
        out = self.null_vector()
        given = {k: v for k, v in model.actuator.values.items() if k not in SHARED_KEYS}
        actuator = NamedValues(
            name=model.actuator.name, values={**given, **(actuator_overrides or {})}
        )
        declared = find_actuator(actuator.name).parameters
        check_values(actuator, declared, f"actuator {actuator.name!r}")
        self._write(out, actuator.name, actuator, declared)
        own = {effect.name for effect in model.effects if effect.servo is not None}
        for entry in sorted(model.effects, key=lambda effect: effect.servo is not None):
            declared = find_effect(entry.name).parameters
            check_values(entry, declared, f"effect {entry.name!r}")
            check_servo(entry, self.servos, independent=self.independent)
            is_one = entry.servo is not None or (
                entry.name in self.shared and entry.name not in own
            )
            for cause in (entry.cause,) if is_one else self.causes(entry.name):
                self._write(out, cause, entry, declared)
        return out

    def _write(
        self, out: Array, owner: str, entry: NamedValues, declared: Sequence[Parameter]
    ) -> None:
        """Put the numbers of one entry of a model where its owner's stand."""
        for parameter in declared:
            value = entry.values.get(parameter.name, parameter.null)
            out[self.column(owner, parameter.name)] = float(value)

    def values(self, owner: str, vector: Array) -> dict[str, float]:
        """Return one owner's numbers by name."""
        return {self.owners[i][1].name: float(vector[i]) for i in self.columns(owner)}


def table_of(actuator: str, causes: Iterable[str], servos: int, **more: Any) -> ParameterTable:
    """Return the table of a structure: each servo has its own of what is said of one servo.

    Further fields of the table may be given.
    """
    chosen = tuple(causes)
    owned = {effect_of(cause) for cause in chosen if servo_of(cause) is not None}
    effects = in_catalogue_order(chosen)
    by_servo = tuple(name for name in effects if name in owned)
    return ParameterTable(
        actuator=actuator, effects=effects, by_servo=by_servo, servos=servos, **more
    )


def check_servo(entry: NamedValues, servos: int, *, independent: bool) -> None:
    """Refuse an effect of a servo that is not there, and of one servo what is about no servo."""
    if entry.servo is None:
        return
    if not find_effect(entry.name).is_of_servo(independent=independent):
        raise InvalidModelFile(
            f"effect {entry.name!r} is not about a servo: it takes no key servo; "
            f"it has servo = {entry.servo}"
        )
    if entry.servo >= servos:
        raise InvalidModelFile(
            f"servo of effect {entry.name!r} must be one of the bench's: "
            f"{'0 alone' if servos == 1 else f'0 to {servos - 1}'}; it is {entry.servo}"
        )


def spool_radius_of(model: Model) -> float | None:
    """Return the spool radius [m] that a model's actuator gives in place of the bench's, if any.

    Raises:
        InvalidModelFile: It is a word, or no spool of a servo has this radius.
    """
    return shared_number(model, "spool_radius", SPOOL_RADII, "m (a shaft counts as 1 m)")


def force_limit_of(model: Model) -> float | None:
    """Return the greatest force [N] of a model's motor, before its gear, if it gives one.

    It stands in place of the asset's, which says what a servo can pull at most.

    Raises:
        InvalidModelFile: It is a word or out of range.
    """
    return shared_number(model, "force_limit", FORCE_LIMITS, "N")


def shared_number(model: Model, key: str, bounds: tuple[float, float], unit: str) -> float | None:
    """Return what an actuator says of a number that any may carry; another is refused."""
    value = model.actuator.values.get(key)
    if value is None:
        return None
    low, high = bounds
    if isinstance(value, str) or not low <= value <= high:
        raise InvalidModelFile(
            f"{key} of actuator {model.actuator.name!r} must be between {low:g} and "
            f"{high:g} {unit}; it is {value!r}"
        )
    return float(value)


def stiffness_of(model: Model) -> float:
    """Return the force by which a model's servo answers a small turn of its shaft [N/rad].

    A number that is missing or a word is refused where the parameter vector is made.
    """
    name = find_actuator(model.actuator.name).stiffness
    value = None if name is None else model.actuator.values.get(name)
    return value if isinstance(value, float) else 0.0


def check_values(entry: NamedValues, declared: Sequence[Parameter], where: str) -> None:
    """Refuse numbers that are missing, unknown, words, or outside their range."""
    known = {p.name: p for p in declared}
    for key in entry.values:
        look_up(f"parameter of {where}", key, known)
    for name, parameter in known.items():
        if name not in entry.values and parameter.optional:
            continue
        if name not in entry.values:
            raise InvalidModelFile(
                f"{where} needs {name} [{parameter.unit}]; the model gives "
                f"{', '.join(entry.values) or 'nothing'}"
            )
        value = entry.values[name]
        low, high = parameter.widest
        if isinstance(value, str) or not low <= value <= high:
            most = with_unit(f"{high:g}", parameter.unit)
            raise InvalidModelFile(
                f"{name} of {where} must be between {low:g} and {most} "
                f"({parameter.source}); it is {value!r}"
            )
