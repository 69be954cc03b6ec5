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
from tendon_newton.data.files.html_table import html_table
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys, write_toml
from tendon_newton.data.files.values import are_tables, are_words, is_count, is_table
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
    table = read_toml(path, InvalidModelFile, "a model is a TOML file")
    refuse_unknown_keys(table, KNOWN_KEYS, str(path), InvalidModelFile)
    try:
        return Model(
            actuator=beside(read_actuator(table.get("actuator")), path.parent),
            effects=read_effects(table.get("effects", [])),
            bench_overrides=read_benches(table.get("bench_overrides", {})),
            fit=read_fit(table.get("fit", [])),
            tolerances=read_tolerances(table.get("tolerances", {})),
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


def read_actuator(table: Any) -> NamedValues:
    """Read the ``[actuator]`` table."""
    if not is_table(table):
        raise InvalidModelFile(
            f"a model names its actuator in a table [actuator]; it is {shown(table)}"
            if table is not None
            else "a model names its actuator in a table [actuator]; there is none"
        )
    return read_named(table, "kind", "[actuator]")


def beside(actuator: NamedValues, folder: Path) -> NamedValues:
    """Return an actuator whose file, if it lies beside the model, is named by its full path."""
    file = actuator.values.get("file")
    if not isinstance(file, str) or not (folder / file).is_file():
        return actuator
    whole = str((folder / file).resolve())
    return NamedValues(name=actuator.name, values={**actuator.values, "file": whole})


def read_effects(tables: Any) -> tuple[NamedValues, ...]:
    """Read the ``[[effects]]`` tables."""
    if not are_tables(tables):
        raise InvalidModelFile("effects must be an array of tables, [[effects]]")
    return tuple(read_effect(table, f"[[effects]] {index}") for index, table in enumerate(tables))


def read_effect(table: Mapping[str, Any], where: str) -> NamedValues:
    """Read one of the ``[[effects]]`` tables; a servo is a whole number from 0 on."""
    servo = table.get(SERVO)
    if servo is not None and not is_count(servo):
        raise InvalidModelFile(
            f"{where}: {SERVO} must be the number of a servo, 0 for that of theta_0; "
            f"it is {shown(servo)}"
        )
    rest = {key: value for key, value in table.items() if key != SERVO}
    return replace(read_named(rest, "name", where), servo=servo)


def read_named(table: Mapping[str, Any], key: str, where: str) -> NamedValues:
    """Read a table whose ``key`` names it and whose other keys are its values."""
    name = table.get(key)
    if not isinstance(name, str):
        came = f"it is {shown(name)}" if key in table else f"there are {listed(table)}"
        raise InvalidModelFile(f"{where}: {key} must be a string that names it; {came}")
    values: dict[str, float | str] = {}
    for parameter, value in table.items():
        if parameter == key:
            continue
        number = value if isinstance(value, str | float) else finite_number(value)
        if number is None:
            raise InvalidModelFile(
                f"{where}: {listed([parameter])} of {shown(name)} must be a number; "
                f"it is {shown(value)}"
            )
        values[parameter] = number
    return NamedValues(name=name, values=values)


def read_benches(table: Any) -> dict[str, BenchOverrides]:
    """Read the ``bench_overrides`` table."""
    if not is_table(table) or not are_tables([*table.values()]):
        raise InvalidModelFile(
            "bench_overrides must hold one table per bench, as in "
            f"{{finger = {{mass = [0.012, 0.008]}}}}; it is {shown(table)}"
        )
    return {bench: read_bench_overrides(row) for bench, row in table.items()}


def read_fit(names: Any) -> tuple[str, ...]:
    """Read the ``fit`` list."""
    if not are_words(names):
        raise InvalidModelFile(f"fit must be a list of names; it is {shown(names)}")
    return tuple(names)


def read_tolerances(table: Any) -> dict[str, float]:
    """Read the ``tolerances`` table."""
    if not is_table(table):
        raise InvalidModelFile(
            f"tolerances must be a table such as {{load_cell_gain = 0.01}}; it is {shown(table)}"
        )
    out = dict[str, float]()
    for name, value in table.items():
        number = finite_number(value)
        if number is None or number < 0.0:
            raise InvalidModelFile(
                f"tolerances: {listed([name])} must be a number from 0 on; it is {shown(value)}"
            )
        out[name] = number
    return out


def refuse_doubles(names: Sequence[str], kind: str) -> None:
    """Refuse a list that names something twice."""
    for name, count in Counter(names).items():
        if count > 1:
            raise InvalidModelFile(
                f"every {kind} stands once; {shown(name)} is there {count} times"
            )
