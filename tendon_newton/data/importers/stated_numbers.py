"""What a mapping file states of logs that no column holds: start, and known numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from tendon_newton.data.bench_overrides import BenchOverrides, read_bench_overrides
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.toml_file import refuse_unknown_keys
from tendon_newton.data.recording import no_overrides
from tendon_newton.errors import InvalidMapping, TendonNewtonError, shown

STATED_KEYS = ("start", "bench_overrides", "actuator_overrides", "load_cell_rate")


@dataclass(frozen=True, kw_only=True)
class StatedNumbers:
    """Numbers of the logs whose names match a pattern."""

    pattern: str
    """Pattern of the logs' names, as in a shell: ``kp100_*``."""
    start: Literal["equilibrium", "first_row"] | None = None
    """State from which a simulation starts; None leaves it."""
    bench_overrides: BenchOverrides = field(default_factory=BenchOverrides)
    """Numbers of the bench."""
    actuator_overrides: Mapping[str, float] = field(default_factory=no_overrides)
    """Numbers of the actuator, in its own units."""
    load_cell_rate: float | None = None
    """Rate of the load cell [Hz], where it is slower than the rows."""

    def with_(self, other: "StatedNumbers") -> "StatedNumbers":
        """Return these numbers where the other has none of its own."""
        return replace(
            self,
            start=other.start or self.start,
            bench_overrides=BenchOverrides(
                **{**self.bench_overrides.given, **other.bench_overrides.given}
            ),
            actuator_overrides={**self.actuator_overrides, **other.actuator_overrides},
            load_cell_rate=other.load_cell_rate or self.load_cell_rate,
        )


def read_stated(where: str, pattern: str, table: Mapping[str, Any]) -> StatedNumbers:
    """Read one table.

    Args:
        where: File and table, for messages.
        pattern: Names of logs that it holds for.
        table: The table.
    """
    refuse_unknown_keys(table, STATED_KEYS, where, InvalidMapping)
    start = table.get("start")
    if start not in (None, "equilibrium", "first_row"):
        raise InvalidMapping(
            f"{where}: start must be 'equilibrium' or 'first_row'; it is {shown(start)}"
        )
    rate = finite_number(table.get("load_cell_rate", 1.0))
    if rate is None or rate <= 0.0:
        raise InvalidMapping(
            f"{where}: load_cell_rate must be a positive number; it is "
            f"{shown(table['load_cell_rate'])}"
        )
    try:
        overrides = read_bench_overrides(table.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidMapping(f"{where}: {error}") from error
    stated = CheckedTable({"actuator_overrides": {}, **table}, where, InvalidMapping)
    return StatedNumbers(
        pattern=pattern,
        start=start,
        bench_overrides=overrides,
        actuator_overrides=stated.numbers("actuator_overrides"),
        load_cell_rate=rate if "load_cell_rate" in table else None,
    )
