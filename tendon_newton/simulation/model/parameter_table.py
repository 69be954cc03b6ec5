"""Where each number of a model stands in the parameter vector of a kernel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.parameters import BenchScale, Parameter, with_unit
from tendon_newton.data.recording import Array
from tendon_newton.effects import find_effect
from tendon_newton.errors import InvalidModelFile, unknown_name
from tendon_newton.simulation.model.bench_numbers import OWNER

SPOOL_RADII = (1.0e-3, 1.0)
"""Radii [m] that a spool may have; a direct drive's angle is its excursion, so that it has 1."""
SHARED_KEYS = ("spool_radius", "file")
"""Keys that any actuator may carry besides its own parameters."""


@dataclass(frozen=True, kw_only=True)
class ParameterTable:
    """The parameter vector of one structure: the actuator's numbers, then each effect's."""

    actuator: str
    """Kind of the actuator."""
    effects: tuple[str, ...]
    """Effects in the order of the catalogue."""
    bench: tuple[Parameter, ...] = ()
    """Unknown numbers of benches; `bench_numbers` has them."""
    scale: BenchScale = field(default_factory=BenchScale)
    """Scale of the benches: ranges and units follow it."""

    @property
    def bench_columns(self) -> slice:
        """Places of the benches' numbers, which kernels do not read."""
        return slice(len(self.owners) - len(self.bench), len(self.owners))

    @property
    def owners(self) -> tuple[tuple[str, Parameter], ...]:
        """(actuator, effect or bench, parameter) of each place, shape (P - 2,)."""
        rows = [(self.actuator, p.on(self.scale)) for p in find_actuator(self.actuator).parameters]
        for name in self.effects:
            rows += [(name, p.on(self.scale)) for p in find_effect(name).parameters]
        return (*rows, *((OWNER, p) for p in self.bench))

    def columns(self, owner: str) -> tuple[int, ...]:
        """Return the places of an actuator's or effect's parameters."""
        return tuple(i for i, (name, _) in enumerate(self.owners) if name == owner)

    def column(self, owner: str, parameter: str) -> int:
        """Return the place of one parameter."""
        for i, (name, p) in enumerate(self.owners):
            if name == owner and p.name == parameter:
                return i
        raise unknown_name(
            f"parameter of {owner!r}", parameter, [p.name for n, p in self.owners if n == owner]
        )

    def null_vector(self) -> Array:
        """Return the vector without effects, the actuator at its typical values, shape (P,)."""
        values = [p.nominal if n == self.actuator else p.null for n, p in self.owners]
        return np.array([*values, 0.0, 0.0])

    def kernel_vectors(self, vectors: Array) -> Array:
        """Return what the kernels read of parameter vectors, shape (..., P)."""
        span = self.bench_columns
        return np.concatenate([vectors[..., : span.start], vectors[..., span.stop :]], axis=-1)

    def vector(self, model: Model, actuator_overrides: Mapping[str, float] | None = None) -> Array:
        """Return a model's numbers with one recording's own actuator numbers, shape (P,).

        Effects that the model does not have are at null.

        Raises:
            InvalidModelFile: A parameter is missing, unknown or outside its range.
            UnknownName: An effect is not in the catalogue.
        """
        out = self.null_vector()
        given = {k: v for k, v in model.actuator.values.items() if k not in SHARED_KEYS}
        actuator = NamedValues(
            name=model.actuator.name, values={**given, **(actuator_overrides or {})}
        )
        for entry, kind in [(actuator, "actuator"), *((e, "effect") for e in model.effects)]:
            declared = (
                find_actuator(entry.name) if kind == "actuator" else find_effect(entry.name)
            ).parameters
            check_values(entry, declared, f"{kind} {entry.name!r}")
            for parameter in declared:
                value = entry.values.get(parameter.name, parameter.null)
                out[self.column(entry.name, parameter.name)] = float(value)
        return out

    def values(self, owner: str, vector: Array) -> dict[str, float]:
        """Return one owner's numbers by name."""
        return {
            p.name: float(vector[i]) for i, (name, p) in enumerate(self.owners) if name == owner
        }


def spool_radius_of(model: Model) -> float | None:
    """Return the spool radius [m] that a model's actuator gives in place of the bench's, if any.

    Raises:
        InvalidModelFile: It is a word, or no spool of a servo has this radius.
    """
    radius = model.actuator.values.get("spool_radius")
    if radius is None:
        return None
    low, high = SPOOL_RADII
    if isinstance(radius, str) or not low <= radius <= high:
        raise InvalidModelFile(
            f"spool_radius of actuator {model.actuator.name!r} must be between {low:g} and "
            f"{high:g} m (a shaft counts as 1 m); it is {radius!r}"
        )
    return float(radius)


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
        if key not in known:
            raise unknown_name(f"parameter of {where}", key, known)
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
