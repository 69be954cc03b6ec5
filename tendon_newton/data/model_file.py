"""Model files: an actuator, the effects already in the model, and what is unknown.

This file knows the format alone. Which actuators, effects and parameters exist is checked by the
packages that build them.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from tendon_newton.data.bench_overrides import (
    OF_BENCH,
    BenchOverrides,
    read_bench_overrides,
    write_bench_overrides,
)
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.html_table import html_table
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys, write_toml
from tendon_newton.data.files.values import is_count
from tendon_newton.data.servo_names import name_of
from tendon_newton.errors import InvalidModelFile, TendonNewtonError, listed, shown
from tendon_newton.frozen_mapping import frozen

KNOWN_KEYS = ("actuator", "effects", "bench_overrides", "fit", "tolerances")
SERVO = "servo"  # Key of an effect that is about one servo


@dataclass(frozen=True, kw_only=True)
class NamedValues:
    """An actuator or an effect by name, with its numbers (and file names)."""

    name: str
    """Key in the table of actuators or effects."""
    values: Mapping[str, float | str]
    """Parameters in SI units; words only where a parameter is a file."""
    servo: int | None = None
    """Servo that an effect is about, counted from 0; None where it is about all."""

    def __post_init__(self) -> None:
        """Refuse numbers that are not finite; protect the rest."""
        if not self.name:
            raise InvalidModelFile("a name must not be empty; it is ''")
        for key, value in self.values.items():
            if not isinstance(value, str) and not isfinite(value):
                raise InvalidModelFile(
                    f"{listed([key])} of {shown(self.name)} must be finite; it is {value}"
                )
        object.__setattr__(self, "values", frozen(self.values))

    def __repr__(self) -> str:
        numbers = (
            f"{key}={value!r}" if isinstance(value, str) else f"{key}={value:.6g}"
            for key, value in self.values.items()
        )
        return f"{self.cause}({', '.join(numbers)})"

    @property
    def cause(self) -> str:
        """Name of an effect with its servo, as in ``gain_error of servo 1``."""
        return name_of(self.name, self.servo)


@dataclass(frozen=True, kw_only=True)
class Model:
    """What a model file says, before any table of effects or actuators has been asked."""

    actuator: NamedValues
    """The actuator model and its numbers."""
    effects: tuple[NamedValues, ...] = ()
    """Effects already in the model, each once; that of one servo stands there for that of all."""
    bench_overrides: Mapping[str, BenchOverrides] = field(default_factory=dict[str, BenchOverrides])
    """Nominal numbers that differ, by bench."""
    fit: tuple[str, ...] = ()
    """Numbers of the actuator or a bench that are unknown and refitted with every candidate."""
    tolerances: Mapping[str, float] = field(default_factory=dict[str, float])
    """Effect, or number of the actuator -> standard deviation of what states it, in place of the
    catalogue's: a share where it cannot be zero, else in its unit. What has none is exact, and no
    cause, such as a limit that a servo's register holds."""

    def __post_init__(self) -> None:
        """Refuse doubled entries; protect the rest."""
        refuse_doubles([effect.cause for effect in self.effects], "effect")
        refuse_doubles(self.fit, "fit entry")
        for name, tolerance in self.tolerances.items():
            if tolerance < 0.0:
                raise InvalidModelFile(
                    f"tolerances: {listed([name])} must be a number from 0 on; it is {tolerance:g}"
                )
        object.__setattr__(self, "bench_overrides", frozen(self.bench_overrides))
        object.__setattr__(self, "tolerances", frozen(self.tolerances))

    def on_bench(
        self, bench: str, given: BenchOverrides | None = None, but: Collection[str] = ()
    ) -> "Model":
        """Return the model of one bench: effects of `OF_BENCH` in the size that it has there.

        Args:
            bench: Name of the bench.
            given: What a recording says of it, which counts more than what the model says.
            but: Effects that stay as they are.
        """
        own = self.bench_overrides.get(bench, BenchOverrides()).given
        every = {**own, **(given.given if given else {})}
        factors = {key: every[key][0] for key in OF_BENCH if key in every and key not in but}
        if not factors:
            return self
        rest = BenchOverrides(**{key: own[key] for key in own.keys() - factors.keys()})
        effects = list[NamedValues]()
        for effect in self.effects:
            number = OF_BENCH.get(effect.name, "")
            size = effect.values.get(number)
            if isinstance(size, float) and effect.name in factors:
                values = {**effect.values, number: factors[effect.name] * size}
                effect = replace(effect, values=values)
            effects.append(effect)
        overrides = {**self.bench_overrides, bench: rest}
        return replace(self, effects=tuple(effects), bench_overrides=overrides)

    def __repr__(self) -> str:
        parts = [repr(self.actuator), *map(repr, self.effects)]
        parts += [f"bench_overrides: {listed(self.bench_overrides)}"] * bool(self.bench_overrides)
        parts += [f"fit: {listed(self.fit)}"] * bool(self.fit)
        return f"Model({'; '.join(parts)})"

    def _repr_html_(self) -> str:
        """List its numbers in a notebook."""
        rows = [
            (part.cause, key, value if isinstance(value, str) else f"{value:.6g}")
            for part in (self.actuator, *self.effects)
            for key, value in part.values.items()
        ]
        unknown = f"; to be fitted: {listed(self.fit)}" if self.fit else ""
        return html_table(f"Model{unknown}", ("part", "number", "value in SI units"), rows)


def load_model(path: str | Path) -> Model:
    """Read and check a model file."""
    path = Path(path)
    read = read_toml(path, InvalidModelFile, "a model is a TOML file")
    refuse_unknown_keys(read, KNOWN_KEYS, str(path), InvalidModelFile)
    usual: dict[str, Any] = {"effects": [], "bench_overrides": {}, "fit": [], "tolerances": {}}
    try:
        stated = CheckedTable(read, "", InvalidModelFile)
        actuator = read_named(stated.table("actuator", hint="Write [actuator]"), "kind")
        table = CheckedTable({**usual, **read}, "", InvalidModelFile)
        benches = table.table("bench_overrides")
        return Model(
            actuator=beside(actuator, path.parent),
            effects=tuple(map(read_effect, table.tables("effects", hint="Write [[effects]]"))),
            bench_overrides={
                bench: read_bench_overrides(
                    benches.table(bench, hint="It has numbers, as {mass = [0.012, 0.008]}").values
                )
                for bench in benches.values
            },
            fit=table.words("fit"),
            tolerances=table.numbers("tolerances"),
        )
    except TendonNewtonError as error:
        raise InvalidModelFile(f"{path}: {error}") from error


def write_model(path: str | Path, model: Model) -> None:
    """Write a model so that reading it gives the same numbers, bit for bit."""
    table: dict[str, Any] = {
        "bench_overrides": {
            bench: write_bench_overrides(overrides)
            for bench, overrides in model.bench_overrides.items()
        },
        "fit": list(model.fit),
        "actuator": {"kind": model.actuator.name, **model.actuator.values},
    }
    if model.tolerances:
        table["tolerances"] = dict(model.tolerances)
    effects = [
        {
            "name": effect.name,
            **({} if effect.servo is None else {SERVO: effect.servo}),
            **effect.values,
        }
        for effect in model.effects
    ]
    write_toml(Path(path), table, effects=effects)


def beside(actuator: NamedValues, folder: Path) -> NamedValues:
    """Return an actuator whose file, if it lies beside the model, is named by its full path."""
    file = actuator.values.get("file")
    if not isinstance(file, str) or not (folder / file).is_file():
        return actuator
    whole = str((folder / file).resolve())
    return NamedValues(name=actuator.name, values={**actuator.values, "file": whole})


def read_effect(table: CheckedTable) -> NamedValues:
    """Read one of the ``[[effects]]`` tables; a servo is a whole number from 0 on."""
    servo = table.values.get(SERVO)
    if servo is not None and not is_count(servo):
        table.refuse(SERVO, "the number of a servo, 0 for that of theta_0")
    return replace(read_named(table, "name", but=SERVO), servo=servo)


def read_named(table: CheckedTable, key: str, but: str = "") -> NamedValues:
    """Read a table whose ``key`` names it and whose other keys, but one, are its values."""
    name = table.word(key)
    rest = {own: value for own, value in table.values.items() if own not in (key, but)}
    values = {own: v if isinstance(v, str) else table.number(own) for own, v in rest.items()}
    return NamedValues(name=name, values=values)


def refuse_doubles(names: Sequence[str], kind: str) -> None:
    """Refuse a list that names something twice."""
    for name, count in Counter(names).items():
        if count > 1:
            raise InvalidModelFile(
                f"every {kind} stands once; {shown(name)} is there {count} times"
            )
